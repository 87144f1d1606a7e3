# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A recording whose topics hold one cloud in different layouts of points, and the messages of any recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from revision_comparison.inputs import CLOUD_TYPE, Input

FLOAT32, FLOAT64, UINT32 = 7, 8, 6
CAMERA = {"x": (0, "<f4"), "y": (4, "<f4"), "z": (8, "<f4"), "rgb": (16, "<u4")}
PACKED = {"x": (0, "<f4"), "y": (4, "<f4"), "z": (8, "<f4")}
DOUBLE = {"rgba": (0, "<u4"), "x": (8, "<f8"), "y": (16, "<f8"), "z": (24, "<f8")}
LAYOUTS = {
    "/packed_unorganized": (PACKED, 12, False, 0),
    "/padded_rows": (CAMERA, 32, True, 64),
    "/double": (DOUBLE, 40, True, 0),
    "/double_unorganized": (DOUBLE, 32, False, 0),
}
"""By topic: fields, bytes of a point, whether it is organized, bytes after each row."""


def write_layouts(path: Path, clouds: list[Input]) -> None:
    """Write organized clouds with color in every layout, 0.2 s apart."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, (fields, step, organized, padding) in LAYOUTS.items():
            connection = writer.add_connection(topic, CLOUD_TYPE, typestore=store)
            for number, cloud in enumerate(clouds):
                stamp = 1_700_000_000_000_000_000 + 200_000_000 * number
                message = _message(store.types, cloud, fields, step, organized, padding, stamp)
                writer.write(connection, stamp, store.serialize_cdr(message, CLOUD_TYPE))


def messages(path: Path) -> dict[str, npt.NDArray[np.uint8]]:
    """Return the encoded messages of a recording by topic, place in it and log time."""
    from mcap.reader import make_reader

    found: dict[str, npt.NDArray[np.uint8]] = {}
    counts: dict[str, int] = {}
    with path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            number = counts[channel.topic] = counts.get(channel.topic, -1) + 1
            name = f"{channel.topic}[{number}] at {message.log_time}"
            found[name] = np.frombuffer(message.data, np.uint8)
    return found


def _message(
    types: Any, cloud: Input, fields: dict[str, tuple[int, str]], step: int, organized: bool, padding: int, stamp: int
) -> Any:
    height, width = cloud.xyz.shape[:2] if organized else (1, cloud.xyz.size // 3)
    names, offsets, kinds = list(fields), [o for o, _ in fields.values()], [k for _, k in fields.values()]
    layout: Any = {"names": names, "offsets": offsets, "formats": kinds, "itemsize": step}
    points = np.zeros(cloud.xyz.size // 3, layout)
    for axis, name in enumerate("xyz"):
        points[name] = cloud.xyz[..., axis].ravel()
    for name in {"rgb", "rgba"} & set(names):
        r, g, b = np.asarray(cloud.rgb).reshape(-1, 3).astype(np.uint32).T
        points[name] = r << 16 | g << 8 | b
    rows = np.zeros((height, width * step + padding), np.uint8)
    rows[:, : width * step] = np.frombuffer(points.tobytes(), np.uint8).reshape(height, width * step)
    code = {"<f4": FLOAT32, "<f8": FLOAT64, "<u4": UINT32}
    time = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    return types[CLOUD_TYPE](
        header=types["std_msgs/msg/Header"](stamp=time, frame_id="camera"),
        height=height,
        width=width,
        fields=[
            types["sensor_msgs/msg/PointField"](name=name, offset=offset, datatype=code[kind], count=1)
            for name, (offset, kind) in fields.items()
        ],
        is_bigendian=False,
        point_step=step,
        row_step=rows.shape[1],
        data=rows.ravel(),
        is_dense=False,
    )
