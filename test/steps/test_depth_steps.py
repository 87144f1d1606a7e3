# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps of the depth: those that made planes were rounded to."""

from __future__ import annotations

import numpy as np
import pytest
from frames import grid_of, kinect, plane
from scipy.spatial.transform import Rotation

from topo_region_seg.beyond.objects.image import sensor_model_of
from topo_region_seg.data import Cloud
from topo_region_seg.steps.view.depth_steps import BINS, depth_steps
from topo_region_seg.steps.view.model import sensor_model

SIZE = 240, 320
PIXEL = 1.0 / 300.0


def depths(seed: int = 0) -> np.ndarray:
    """Depths of a slanted plane, 0.7 to 2 m, with a Kinect's noise."""
    return plane(*SIZE, PIXEL, (0.3, 0.9), 1.0, kinect, seed)[0][:, 2]


def image(depth: np.ndarray) -> np.ndarray:
    v, u = (np.mgrid[0 : SIZE[0], 0 : SIZE[1]].reshape(2, -1).T - [(SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2]).T * PIXEL
    return np.column_stack([u * depth, v * depth, depth])


@pytest.mark.parametrize("step", [0.0005, 0.001, 0.004])
def test_steps_of_equal_length_are_told_at_every_depth(step: float) -> None:
    at, found = depth_steps((np.round(depths() / step) * step).astype(np.float32))
    assert len(at) == BINS and (np.diff(at) > 0.0).all()
    np.testing.assert_allclose(found, step, rtol=0.01)


@pytest.mark.parametrize("rounded", [None, 0.0001])
def test_steps_of_a_disparity_grow_with_the_square_of_the_depth(rounded: float | None) -> None:
    disparity_step = 0.003  # of the inverse depth, 1/m
    depth = 1.0 / (np.round(1.0 / depths() / disparity_step) * disparity_step)
    if rounded:
        depth = np.round(depth / rounded) * rounded
    at, found = depth_steps(depth.astype(np.float32))
    np.testing.assert_allclose(found, disparity_step * at**2, rtol=0.12)


def test_depths_without_steps_and_too_few_tell_none() -> None:
    assert np.isnan(depth_steps(depths().astype(np.float32))[1]).all()
    at, found = depth_steps(np.full(50, 1.0, np.float32))
    assert np.isnan(at).all() and np.isnan(found).all()
    assert np.isnan(depth_steps(np.full(50_000, 1.0, np.float32))[1]).all()  # one depth is no step
    assert np.isnan(depth_steps(np.empty(0, np.float32))[1]).all()


def test_depths_at_which_nothing_was_seen_are_no_steps() -> None:
    depth = np.round(depths() / 0.001) * 0.001
    far = np.where(np.arange(len(depth)) % 2, depth, depth + 5.0)
    far[far % 0.05 < 0.025] = np.nan
    np.testing.assert_allclose(depth_steps(far.astype(np.float32))[1], 0.001, rtol=0.02)


def test_the_model_of_a_sensor_tells_the_step_between_depths_and_in_other_frames() -> None:
    depth = np.round(depths() / 0.002) * 0.002
    model = sensor_model(grid_of(image(depth), *SIZE))
    assert model is not None
    np.testing.assert_allclose(model.step_at(np.array([0.1, 1.0, 9.0])), 0.002, rtol=0.01)
    pose = Rotation.from_euler("xyz", (-2.0, 0.1, 0.3))
    moved = (pose.apply(image(depth)) + [3.0, -2.0, 1.0]).astype(np.float32)
    x, y, z, w = pose.as_quat()
    cloud = Cloud(moved, None, *SIZE, sensor_pose=(3.0, -2.0, 1.0, w, x, y, z))
    told = sensor_model_of(cloud)
    assert told is not None
    np.testing.assert_allclose(told.step_at(np.array([1.0])), 0.002, rtol=0.02)


def test_a_model_without_steps_tells_none_at_any_depth() -> None:
    model = sensor_model(grid_of(image(depths()), *SIZE))
    assert model is not None and np.isnan(model.step_at(np.array([0.5, 1.0, 9.0]))).all()
