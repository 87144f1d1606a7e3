# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Clouds in other frames: positions, the places of sensor and base, up and the crop box follow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.placing import FAR, Transform, moved
from topo_region_seg.data import Cloud
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.steps.crop import crop
from topo_region_seg.steps.sensor import up_direction

CAMERA = Camera.kinect(160, 120)


def random_transform(seed: int, reach: float = 3.0) -> tuple[Transform, Rotation, np.ndarray]:
    rng = np.random.default_rng(seed)
    turn, step = Rotation.random(random_state=seed), rng.uniform(-reach, reach, 3)
    x, y, z, w = turn.as_quat()
    return Transform.of_pose((*step, w, x, y, z)), turn, step


@pytest.mark.parametrize("seed", range(4))
def test_transforms_are_those_of_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    xyz = rng.normal(size=(1001, 3)).astype(np.float32)
    xyz[7] = np.nan
    first, turn, step = random_transform(seed)
    second, turn_2, step_2 = random_transform(seed + 10)
    cloud = moved(Cloud(xyz, None, 7, 143), second.after(first))
    expected = turn_2.apply(turn.apply(xyz.astype(np.float64)) + step) + step_2
    np.testing.assert_allclose(cloud.xyz, expected, atol=2e-6)
    assert cloud.xyz.dtype == np.float32 and np.isnan(cloud.xyz[7]).all()
    assert cloud.sensor_pose is not None
    np.testing.assert_allclose(cloud.sensor_pose[:3], turn_2.apply(step) + step_2, atol=1e-12)
    back = Transform.of_pose(second.after(first).pose)
    np.testing.assert_allclose(back.rotation, (turn_2 * turn).as_matrix(), atol=1e-12)


def test_positions_in_a_far_frame_keep_their_precision() -> None:
    far = Transform(np.eye(3), np.array([0.0, 2.0 * FAR, 0.0]))
    cloud = moved(Cloud(np.array([[0.1234567, 0.0, 1.0]], np.float32), None, 1, 1), far)
    assert cloud.xyz.dtype == np.float64


@pytest.mark.parametrize("pose", [(0.0,) * 7, (np.nan, 0, 0, 1, 0, 0, 0), (0, 0, 0, 1, 0, 0)])
def test_what_is_no_pose_is_refused(pose: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="is no pose"):
        Transform.of_pose(pose)


def test_up_and_the_crop_box_are_in_the_base_frame_where_it_is_known() -> None:
    base, turn, step = random_transform(1)
    xyz = np.random.default_rng(0).uniform(-5.0, 5.0, (2000, 3))
    cloud = Cloud(xyz, None, 1, len(xyz), base_pose=base.pose)
    np.testing.assert_allclose(up_direction(cloud, Params()), turn.apply([0.0, 0.0, 1.0]), atol=1e-12)
    np.testing.assert_allclose(up_direction(cloud, Params(up=(0, 3, 0))), turn.apply([0.0, 1.0, 0.0]), atol=1e-12)
    assert up_direction(Cloud(xyz, None, 1, len(xyz)), Params()) is None
    params = Params(crop_box=(-1.0, -2.0, -1.0, 2.0, 2.0, 3.0), max_range=1000.0)
    local = turn.inv().apply(xyz - step)
    inside = ((local >= [-1.0, -2.0, -1.0]) & (local <= [2.0, 2.0, 3.0])).all(axis=1)
    assert 0 < inside.sum() < len(xyz)
    np.testing.assert_array_equal(crop(xyz, np.zeros(3), params, base=base.pose), np.flatnonzero(inside))


@pytest.mark.parametrize("output", ["regions", "objects"])
def test_a_scene_has_the_same_things_in_another_frame(output: str) -> None:
    """Where criteria are met by a hair regions may join otherwise, as positions are rounded otherwise."""
    frame = simulate(tabletop(seed=2), CAMERA, seed=2)
    x, y, z, w = Rotation.from_matrix(CAMERA.rotation).as_quat()
    to_world = Transform.of_pose((*CAMERA.eye, w, x, y, z))
    world = moved(frame.cloud, to_world)
    params = Params(output=output, voxel_size=0.0)  # voxels would lie otherwise
    here = Pipeline(params).run(frame.cloud, lambda *_: None)
    there = Pipeline(params.replace(up=[0.0, 0.0, 1.0])).run(world, lambda *_: None)
    assert output == "regions" or len(here.regions) == len(there.regions) > 1
    assert np.mean((here.labels > 0) == (there.labels > 0)) > 0.99
    assert there.plane is not None and there.plane.normal[2] > 0.999, "the table is level in the world"


def test_boxes_are_upright_where_up_is_known() -> None:
    cloud = simulate(tabletop(seed=2), CAMERA, seed=2).cloud
    up = CAMERA.rotation[2]
    base = Transform(CAMERA.rotation.T, np.zeros(3)).pose
    for given, params in (
        (cloud, Params(up=tuple(up))),
        (replace(cloud, base_pose=base), Params()),
    ):
        seg = Pipeline(params).run(given, lambda *_: None)
        boxes = Answer(None, given, seg).boxes
        vertical = boxes.axes[:, :, 2]
        assert len(vertical) > 1
        np.testing.assert_allclose(vertical, np.tile(up, (len(vertical), 1)), atol=1e-6)
