# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The clouds that both revisions are given: those of ``bags/``, of the simulator, and of a folder of real data."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

ROOT = Path(__file__).resolve().parents[2]
SIMULATED_BAG = ROOT / "bags" / "tabletop_sim"
CLOUD_TYPE = "sensor_msgs/msg/PointCloud2"
BAGS = ("bags/tabletop_labelled", "bags/laptop_stream", "clouds/watercan.bag")
CLOUDS = ("clouds/milk_color.pcd", "clouds/region_growing_rgb_tutorial.pcd", "clouds/milk_cartoon_all_small_clorox.pcd")


@dataclass(frozen=True)
class Input:
    """A cloud as `topo_region_seg.segment` takes it; `special` ones go through all configurations."""

    name: str
    xyz: npt.NDArray[np.floating]
    rgb: npt.NDArray[np.uint8] | None
    special: bool = False


def inputs(data: Path, *, quick: bool) -> Iterator[Input]:
    """Yield the clouds one by one; of the folder `data` what is there of it."""
    for number, cloud in enumerate(islice(recorded(SIMULATED_BAG), 1 if quick else None)):
        yield Input(cloud.name, cloud.xyz, cloud.rgb, special=number == 0)
        if number == 0:
            yield from _variants(cloud)
    yield from _simulated([(3, (320, 240))] if quick else [(1, (640, 480)), (2, (640, 480)), (5, (160, 120))])
    for path in _present(data, BAGS[-1:] if quick else BAGS):
        for number, cloud in enumerate(recorded(path)):
            yield Input(cloud.name, cloud.xyz, cloud.rgb, special=number == 0 and not quick)
    for path in _present(data, CLOUDS[:1] if quick else CLOUDS):
        yield _from_pcd(path)
    for path in islice(sorted((data / "scenes").glob("*.npz")), 1 if quick else None):
        yield _from_depth(path)


def recordings(data: Path, *, quick: bool) -> list[Path]:
    """Return the recordings to replay."""
    return [SIMULATED_BAG, *([] if quick else _present(data, BAGS))]


def recorded(bag: Path) -> Iterator[Input]:
    """Yield the clouds of a recording, points as float32 x, y, z and `rgb`."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        topics = [c for c in reader.connections if c.msgtype == CLOUD_TYPE and c.topic != "/ground_truth/labels"]
        for number, (topic, _, data) in enumerate(reader.messages(topics)):
            message: Any = reader.deserialize(data, topic.msgtype)
            rows = message.data.reshape(message.height, message.row_step)[:, : message.width * message.point_step]
            points = rows.reshape(message.height, message.width, message.point_step)
            offset = {field.name: field.offset for field in message.fields}

            def column(name: str, points: Any = points, offset: dict[str, int] = offset) -> Any:
                return np.ascontiguousarray(points[..., offset[name] : offset[name] + 4])

            xyz = np.concatenate([column(name).view(np.float32) for name in "xyz"], axis=-1)
            yield Input(f"{bag.stem}/{number}", xyz, np.ascontiguousarray(column("rgb")[..., 2::-1]))


def stored(cloud: Input, folder: Path) -> Path:
    """Write a cloud for the workers; return the file, which has the cloud's name."""
    arrays: dict[str, Any] = {"xyz": cloud.xyz}
    if cloud.rgb is not None:
        arrays["rgb"] = cloud.rgb
    path = folder / f"{cloud.name.replace('/', '_')}.npz"
    np.savez(path, **arrays)
    return path


def _variants(cloud: Input) -> Iterator[Input]:
    """Yield the same cloud in the other forms that the API takes."""
    flat = cloud.xyz.reshape(-1, 3), None if cloud.rgb is None else cloud.rgb.reshape(-1, 3)
    yield Input(f"{cloud.name} unorganized", *flat, special=True)
    yield Input(f"{cloud.name} without color", cloud.xyz, None, special=True)
    yield Input(f"{cloud.name} float64", cloud.xyz.astype(np.float64), cloud.rgb)
    yield Input(f"{cloud.name} zeros for NaN", np.nan_to_num(cloud.xyz), cloud.rgb, special=True)
    yield Input(f"{cloud.name} one row", cloud.xyz[120], None if cloud.rgb is None else cloud.rgb[120])


def _simulated(scenes: list[tuple[int, tuple[int, int]]]) -> Iterator[Input]:
    sys.path.insert(0, str(ROOT))  # these sources, not a copy that is installed
    from topo_region_seg.offline import simulation

    for seed, size in scenes:
        scene, camera = simulation.tabletop(seed), simulation.Camera.kinect(*size)
        cloud = simulation.simulate(scene, camera, seed=seed).cloud
        shape = (cloud.height, cloud.width, 3)
        yield Input(f"simulator/{seed} {size[0]}x{size[1]}", cloud.xyz.reshape(shape), cloud.rgb.reshape(shape))


def _present(data: Path, names: tuple[str, ...]) -> list[Path]:
    return [data / name for name in names if (data / name).exists()]


def _from_pcd(path: Path) -> Input:
    from pypcd4 import PointCloud

    cloud = PointCloud.from_path(path)
    shape = (cloud.metadata.height, cloud.metadata.width, -1)
    columns = cloud.pc_data
    xyz = np.stack([columns[name] for name in "xyz"], axis=-1).astype(np.float32).reshape(shape)
    packed = np.ascontiguousarray(columns["rgb" if "rgb" in columns.dtype.names else "rgba"])
    return Input(path.stem, xyz, np.ascontiguousarray(packed.view(np.uint8).reshape(shape)[..., 2::-1]))


def _from_depth(path: Path) -> Input:
    """Return a depth image with its colors, projected back."""
    with np.load(path) as arrays:
        depth, k, rgb = arrays["depth"] / float(arrays["depth_scale"]), arrays["K"], arrays["rgb"]
    depth[depth <= 0] = np.nan
    v, u = np.mgrid[: depth.shape[0], : depth.shape[1]]
    xyz = np.stack([(u - k[0, 2]) / k[0, 0] * depth, (v - k[1, 2]) / k[1, 1] * depth, depth], axis=-1)
    return Input(path.stem, xyz.astype(np.float32), rgb)
