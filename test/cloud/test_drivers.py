# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The same scene as every driver publishes it gives the same regions; on the node: test_ros_hostile.py."""

from __future__ import annotations

import clouds
import numpy as np
import pytest
from drivers import ROWS, Row, back, published, valid

from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.labeled import labeled_points
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.data import Cloud
from topo_region_seg.offline.simulation import Camera, SimulatedFrame, simulate, tabletop
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline


@pytest.fixture(scope="module")
def frame() -> SimulatedFrame:
    return simulate(tabletop(3), Camera.kinect(320, 240), seed=3)


# Thinning, the plane search, ties in merging and lengths that follow the sensor look at the axes; without them a scene
# may be turned.
TURNED = Params(
    max_radius=0.02, voxel_size=0.0, remove_floor=False, normal_radius=0.015, max_range=1.0, small_regions="remove"
)


def params_of(row: Row) -> Params:
    params = TURNED if row.forward else Params()
    return params if row.layout.color else params.replace(features="normals")


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_the_same_scene_gives_the_same_regions(row: Row, frame: SimulatedFrame) -> None:
    params = params_of(row)
    expected = Pipeline(params).run(frame.cloud).labels[valid(frame.cloud)]
    msg = published(row, frame.cloud)
    before = bytes(msg.data)
    warnings: list[str] = []
    cloud = decode(msg, max_points=params.max_points, warn=lambda code, text: warnings.append(code))
    seg = Pipeline(params).run(cloud)
    labels = back(row, frame.cloud, seg.labels)
    assert warnings == []
    assert bytes(msg.data) == before
    assert len(seg.regions) > 5
    if row.forward:
        assert_same_partition(labels, expected)
    else:
        np.testing.assert_array_equal(labels, expected)
    assert_output(row, msg, cloud, seg)


def assert_same_partition(labels: np.ndarray, expected: np.ndarray) -> None:
    """Regions of equal size are numbered by their coordinates, which have been turned."""
    pairs = np.unique(np.stack([labels, expected]), axis=1)
    assert pairs.shape[1] == len(np.unique(labels)) == len(np.unique(expected))
    np.testing.assert_array_equal(pairs[:, pairs[0] == 0], [[0], [0]])


def assert_output(row: Row, msg: object, cloud: Cloud, seg: object) -> None:
    """Hold that header, size, order, coordinates and color of the input come back, beside the labels."""
    out = labeled_points(clouds.TYPES, Answer(msg, cloud, seg))
    assert (out.header, out.height, out.width) == (msg.header, msg.height, msg.width)
    assert [f.name for f in out.fields] == ["x", "y", "z", "rgb", "label"]
    again = decode(out, max_points=10**6)
    np.testing.assert_array_equal(again.xyz, cloud.xyz)
    if row.layout.color:
        np.testing.assert_array_equal(again.rgb, cloud.rgb)


def test_the_rows_hold_what_drivers_publish(frame: SimulatedFrame) -> None:
    without_depth = ~valid(frame.cloud)
    assert without_depth.any()
    for row in ROWS:
        msg = published(row, frame.cloud)
        organized = row.fill is not None
        assert (msg.height, msg.width) == ((240, 320) if organized else (1, (~without_depth).sum()))
        assert msg.point_step == row.layout.point_step
        assert [(f.name, f.offset, f.datatype) for f in msg.fields] == row.layout.fields
