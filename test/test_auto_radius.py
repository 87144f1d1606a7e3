# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""`max_radius: auto`: lengths in units of the local spacing, and the scale from the barcode."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from topo_region_seg.data import Cloud
from topo_region_seg.params import AUTO_REACH, FEWEST_SPACINGS, REFERENCE_SPACING, ParameterError, Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.simulation import Camera, simulate, tabletop
from topo_region_seg.stages.local_units import LocalUnits, local_units
from topo_region_seg.tools.parameters import read_value

AUTO = Params(max_radius="auto", voxel_size=0.0, remove_floor=False, max_range=100.0)  # type: ignore[arg-type]
TURNED = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])  # a camera in a frame of x forward, z up
DEPTHS = st.floats(0.3, 8.0)


def wall(depth: float, focal: float = 525.0, tilt: float = 0.0, size: int = 48) -> np.ndarray:
    """What a camera sees of a plane at a depth, turned by `tilt` radians about the vertical, (size * size, 3)."""
    v, u = np.mgrid[0:size, 0:size] - size / 2.0
    rays = np.stack([u / focal, v / focal, np.ones_like(u)], axis=2).reshape(-1, 3)
    normal = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
    return rays * (depth * normal[2] / (rays @ normal))[:, None]


def units_of(xyz: np.ndarray, side: int = 48) -> LocalUnits:
    return local_units(xyz, np.arange(len(xyz)), side, side)


@given(DEPTHS, st.floats(200.0, 1500.0))
def test_a_pixel_is_the_reference_spacing_wide_at_every_depth(depth: float, focal: float) -> None:
    xyz = wall(depth, focal)
    local = units_of(xyz).at(xyz).reshape(48, 48, 3)
    steps = np.linalg.norm(np.diff(local, axis=1), axis=2)
    assert np.allclose(steps, REFERENCE_SPACING, rtol=1e-6)


@pytest.mark.parametrize("axes", [np.eye(3), TURNED])
@given(st.lists(st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), DEPTHS), min_size=1, max_size=20))
def test_positions_come_back(axes: np.ndarray, seen: list[tuple[float, float, float]]) -> None:
    image = np.array(seen)
    xyz = np.column_stack([image[:, :2] * image[:, 2:], image[:, 2]]) @ axes
    units = LocalUnits(axes, 0.7)
    assert np.allclose(units.back(units.at(xyz)), xyz, atol=1e-12)


@pytest.mark.parametrize("tilt", [0.0, 0.5, -1.0])
def test_normals_are_those_of_the_surface_in_metres(tilt: float) -> None:
    xyz = wall(1.3, tilt=tilt, focal=60.0)
    units = units_of(xyz)
    grid = units.at(xyz).reshape(48, 48, 3)
    across, down = np.gradient(grid, axis=1), np.gradient(grid, axis=0)
    normals = np.cross(across, down).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    found = units.normals_back(normals, grid.reshape(-1, 3)).reshape(48, 48, 3)[1:-1, 1:-1].reshape(-1, 3)
    assert np.allclose(found, [-math.sin(tilt), 0.0, -math.cos(tilt)], atol=2e-3)
    assert np.isnan(units.normals_back(np.full((1, 3), np.nan), grid[0, :1])).all()


def test_a_camera_in_another_frame_sees_the_same() -> None:
    xyz = wall(1.3, tilt=0.4)
    apart, turned = (cKDTree(units_of(points).at(points)).query_pairs(0.004) for points in (xyz, xyz @ TURNED))
    assert apart == turned


def scaled(cloud: Cloud, factor: float) -> Cloud:
    return replace(cloud, xyz=(cloud.xyz.astype(np.float64) * factor))


@settings(deadline=None, max_examples=8)
@given(st.floats(0.3, 6.0))
def test_the_same_image_from_farther_away_has_the_same_regions(factor: float) -> None:
    cloud = simulate(tabletop(1), Camera.kinect(160, 120), 1, None).cloud
    near, far = Pipeline(AUTO).run(scaled(cloud, 1.0)), Pipeline(AUTO).run(scaled(cloud, factor))
    assert far.params.radius == pytest.approx(near.params.radius, rel=1e-6)
    assert np.mean(near.labels != far.labels) < 1e-3  # what lies on a threshold may fall to either side
    assert not np.array_equal(near.labels, Pipeline(AUTO.replace(max_radius=0.005)).run(scaled(cloud, factor)).labels)


def test_a_cloud_all_around_has_one_unit_from_its_spacing() -> None:
    rng = np.random.default_rng(0)
    xyz = rng.normal(size=(4_000, 3))
    xyz *= 5.0 / np.linalg.norm(xyz, axis=1, keepdims=True)
    units = local_units(xyz, np.arange(len(xyz)), len(xyz), 1)
    near = cKDTree(units.at(xyz)).query(units.at(xyz), k=2)[0][:, 1]
    assert math.isinf(units.depth)
    assert np.median(near) == pytest.approx(REFERENCE_SPACING)
    assert np.allclose(units.back(units.at(xyz)), xyz)


@pytest.mark.parametrize("xyz", [np.empty((0, 3)), np.ones((1, 3)), np.ones((50, 3)), np.zeros((50, 3))])
def test_clouds_without_a_spacing(xyz: np.ndarray) -> None:
    seg = Pipeline(AUTO).run(Cloud(xyz, np.zeros(xyz.shape, np.uint8), 1, len(xyz)))
    assert len(seg.labels) == len(xyz)


def test_the_scale_is_in_the_middle_of_the_longest_stretch() -> None:
    """Squares of 20 x 20 points, 5 spacings and then 14 apart: 3 regions, 2 of them from 5 spacings on, then one."""
    step = REFERENCE_SPACING
    left = np.array([0.0, 19.0 + 5.0, 2 * 19.0 + 5.0 + 14.0]) * step
    y, x = (grid.ravel() * step for grid in np.mgrid[0:20, 0:20])
    xyz = np.concatenate([np.column_stack([x + start, y, np.ones_like(x)]) for start in left])
    spread = np.array([[10.0, 10.0, 10.0], [-10.0, -10.0, 10.0]])  # wide apart: no camera
    cloud = Cloud(np.concatenate([xyz, spread, -spread]), np.zeros((len(xyz) + 4, 3), np.uint8), 1, len(xyz) + 4)
    seg = Pipeline(AUTO.replace(features="normals")).run(cloud)
    assert seg.params.radius == pytest.approx(step * math.sqrt(5.0 * 14.0), rel=1e-6)
    assert FEWEST_SPACINGS * step < seg.params.radius < AUTO_REACH
    assert len(seg.regions) == 2


def test_the_result_says_its_scale_and_can_be_cut() -> None:
    cloud = simulate(tabletop(1), Camera.kinect(160, 120), 1).cloud
    seg = Pipeline(Params(max_radius="auto")).run(cloud)  # type: ignore[arg-type]
    assert (seg.params.max_radius, seg.components.max_radius, seg.barcode.max_radius) == (AUTO_REACH,) * 3
    assert np.array_equal(seg.cut(seg.params.radius).labels, seg.labels)
    finite = np.isfinite(cloud.xyz).all(axis=1)
    for region in seg.regions:
        members = cloud.xyz[(seg.labels == region.label) & finite]
        assert np.allclose(region.centroid, members.mean(axis=0), atol=2e-3), "in metres, in the sensor frame"


def test_the_word_stands_for_the_number_everywhere() -> None:
    params = Params(max_radius="auto")  # type: ignore[arg-type]
    assert params.auto and not Params().auto
    assert params.as_dict()["max_radius"] == "auto"
    assert Params.from_mapping(params.as_dict()) == params
    assert params.replace(angle_threshold=3.0).auto
    row = next(row for row in Params.table() if row.name == "max_radius")
    assert Params(max_radius=read_value(row, "auto")).auto
    assert not params.replace(level="objects").of_level().auto


@pytest.mark.parametrize("value", [0.0, "Auto", "automatic", ""])
def test_nothing_else_stands_for_it(value: object) -> None:
    with pytest.raises(ParameterError, match="max_radius"):
        Params(max_radius=value)  # type: ignore[arg-type]


def test_a_scale_cannot_be_given_and_chosen() -> None:
    with pytest.raises(ParameterError, match=r"radius .* is chosen where max_radius is auto"):
        Params(max_radius="auto", radius=0.01)  # type: ignore[arg-type]
