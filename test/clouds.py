# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""PointCloud2 messages for tests, in the layouts of drivers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from topo_region_seg.offline.bags.types import bag_types

INT8, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64 = range(1, 9)
NUMPY = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
TYPES = bag_types()
XYZ = [("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32)]


@dataclass(frozen=True)
class Driver:
    """What a driver publishes: fields (name, offset, datatype) and the distance of two points in bytes."""

    fields: list[tuple[str, int, int]]
    point_step: int
    color: bool = True


DRIVERS = {
    "realsense": Driver([*XYZ, ("rgb", 16, FLOAT32)], 20),
    "realsense without texture": Driver(XYZ, 16, color=False),
    "depth_image_proc": Driver([*XYZ, ("rgb", 16, FLOAT32)], 32),
    "zed": Driver([*XYZ, ("rgb", 12, FLOAT32)], 16),
    "zivid": Driver([*XYZ, ("rgba", 12, UINT32)], 16),
    "gz-sim": Driver([*XYZ, ("rgb", 16, FLOAT32)], 24),
    "rgb uint32": Driver([*XYZ, ("rgb", 12, UINT32)], 16),
    "separate channels": Driver([*XYZ, ("r", 12, UINT8), ("g", 13, UINT8), ("b", 14, UINT8)], 15),
    "velodyne": Driver(
        [*XYZ, ("intensity", 12, FLOAT32), ("ring", 16, UINT16), ("time", 18, FLOAT32)], 22, color=False
    ),
    "livox": Driver([*XYZ, ("tag", 16, UINT8), ("line", 17, UINT8), ("timestamp", 18, FLOAT64)], 26, color=False),
    "float64": Driver([("x", 0, FLOAT64), ("y", 8, FLOAT64), ("z", 16, FLOAT64), ("rgb", 24, FLOAT32)], 28),
}


def header(sec: int = 1, nanosec: int = 2, frame_id: str = "camera") -> Any:
    return TYPES.Header(stamp=TYPES.Time(sec=sec, nanosec=nanosec), frame_id=frame_id)


def message(
    xyz: np.ndarray,
    rgb: np.ndarray | None = None,
    *,
    driver: Driver = DRIVERS["depth_image_proc"],
    height: int = 1,
    big_endian: bool = False,
    row_padding: int = 0,
    alpha: int = 0,
    sec: int = 1,
) -> Any:
    """Write the points byte by byte field, independently of the code under test; unused bytes hold rubbish."""
    order = ">" if big_endian else "<"
    record = np.dtype(
        {
            "names": [name for name, *_ in driver.fields],
            "formats": [order + NUMPY[kind] for *_, kind in driver.fields],
            "offsets": [offset for _, offset, _ in driver.fields],
            "itemsize": driver.point_step,
        }
    )
    width = len(xyz) // height
    row_step = width * driver.point_step + row_padding
    rows = np.full((height, row_step), 0xA5, np.uint8)
    for row in range(height):
        data = bytearray(rows[row, : width * driver.point_step].tobytes())
        points = np.frombuffer(data, record)  # a copy would not have the unused bytes
        part = slice(row * width, (row + 1) * width)
        for axis, name in enumerate("xyz"):
            points[name] = xyz[part, axis]
        if rgb is not None:
            _put_color(points, rgb[part], alpha, order)
        rows[row, : width * driver.point_step] = np.frombuffer(data, np.uint8)
    fields = [TYPES.PointField(name=n, offset=o, datatype=k, count=1) for n, o, k in driver.fields]
    return TYPES.PointCloud2(
        header=header(sec),
        height=height,
        width=width,
        fields=fields,
        is_bigendian=big_endian,
        point_step=driver.point_step,
        row_step=row_step,
        data=rows.reshape(-1),
        is_dense=False,
    )


def _put_color(points: np.ndarray, rgb: np.ndarray, alpha: int, order: str) -> None:
    red, green, blue = (rgb[:, channel].astype(np.uint32) for channel in range(3))
    packed = (np.uint32(alpha) << np.uint32(24)) | (red << 16) | (green << 8) | blue
    for name in ("rgb", "rgba"):
        if name in points.dtype.names:
            kind = points.dtype[name]
            points[name] = packed.astype(order + "u4").view(kind)
    if "r" in points.dtype.names:
        points["r"], points["g"], points["b"] = red, green, blue


def random_points(n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(n, 3)).astype(np.float32), rng.integers(0, 256, (n, 3), dtype=np.uint8)


def scene(width: int = 64, height: int = 48) -> tuple[np.ndarray, np.ndarray]:
    """A small organized cloud: two walls of different colors at a right angle, no support plane."""
    u, v = np.meshgrid(np.linspace(-0.1, 0.1, width), np.linspace(-0.08, 0.08, height))
    xyz = np.stack([u, v, 0.6 + np.abs(u)], axis=-1).reshape(-1, 3).astype(np.float32)
    rgb = np.where(u.reshape(-1, 1) < 0, [[200, 30, 30]], [[30, 30, 200]]).astype(np.uint8)
    return xyz, rgb
