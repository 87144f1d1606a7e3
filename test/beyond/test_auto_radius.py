# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""`max_radius: auto`: lengths in units of the local spacing, and the scale from the barcode."""

from __future__ import annotations

import dataclasses
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from places import ROOT
from scipy.spatial import cKDTree

sys.path.append(str(ROOT))  # last, so that an installed copy of the package is the one that is tested

from benchmarks.beyond.moved import agreement, seen_from
from topo_region_seg.beyond.auto_scale.local_units import LocalUnits, local_units
from topo_region_seg.beyond.auto_scale.neighbors import MOST, image_neighbors, window_of
from topo_region_seg.beyond.auto_scale.stability import stability
from topo_region_seg.compiled.kd_tree import position_tree
from topo_region_seg.data import Cloud
from topo_region_seg.growth import AUTO_REACH, FEWEST_SPACINGS, REFERENCE_SPACING, growth_of_regions, is_auto
from topo_region_seg.offline.cli.parameters import read_value
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.parameter_table import ParameterError
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.steps.normals.estimate import estimate_normals

GROWTH = growth_of_regions(Params())
AUTO = Params(max_radius="auto", voxel_size=0.0, remove_floor=False, max_range=100.0)
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


@settings(deadline=None)
@given(DEPTHS, st.floats(200.0, 1500.0))
def test_a_pixel_is_at_most_the_reference_spacing_wide_at_every_depth(depth: float, focal: float) -> None:
    xyz = wall(depth, focal)
    local = units_of(xyz).at(xyz).reshape(48, 48, 3)
    steps = np.linalg.norm(np.diff(local, axis=1), axis=2)
    assert np.allclose(steps, min(depth / focal, REFERENCE_SPACING), rtol=1e-6)


@settings(deadline=None)
@given(st.floats(0.2, 0.9), st.floats(1.1, 8.0))
def test_lengths_nearby_stay_metres(near: float, far: float) -> None:
    units = LocalUnits(np.eye(3), 1.0, noise=1e-9)
    xyz = np.array([[0.1, -0.1, near], [0.1, -0.1, far]])
    assert np.array_equal(units.at(xyz)[0], xyz[0])
    assert np.array_equal(units.at(xyz[:1]), xyz[:1])
    assert np.allclose(units.normal_radius(xyz, GROWTH), Params().normal_radius * np.array([1.0, far]))


@pytest.mark.parametrize("axes", [np.eye(3), TURNED])
def test_coordinates_go_on_where_lengths_begin_to_grow(axes: np.ndarray) -> None:
    ends = np.array([[0.3, 0.2, 1.0 - 1e-9], [0.3, 0.2, 1.0 + 1e-9]]) @ axes
    assert np.ptp(LocalUnits(axes, 1.0).at(ends), axis=0).max() < 1e-8


@pytest.mark.parametrize("height", [1, 48])
@pytest.mark.parametrize("sigma", [1e-3, 4e-3])
def test_the_noise_is_found(sigma: float, height: int) -> None:
    """Of tilted walls at two depths: the inverse depth has the same noise at both."""
    rng = np.random.default_rng(0)
    for depth in (0.8, 2.0):
        xyz = wall(depth, tilt=0.5)
        noisy = xyz / (1.0 + rng.normal(0.0, sigma, len(xyz)) * xyz[:, 2])[:, None]
        units = local_units(noisy, np.arange(len(xyz)), 48 if height > 1 else len(xyz), height)
        assert units.noise == pytest.approx(sigma, rel=0.12)
        assert units.floor_distance(GROWTH) == pytest.approx(max(0.01, 2.5 * sigma * depth**2), rel=0.15)


@pytest.mark.parametrize("depth", [1.0, 2.0, 3.0])
def test_normals_of_a_noisy_wall_agree(depth: float) -> None:
    """Within about half of the threshold; with the radius of the parameters they do not, far away."""
    rng = np.random.default_rng(0)
    xyz = wall(depth, size=96)
    noisy = xyz / (1.0 + rng.normal(0.0, 1.66e-3, len(xyz)) * xyz[:, 2])[:, None]
    units = local_units(noisy, np.arange(len(xyz)), 96, 96)
    tree = position_tree(noisy)
    inside = np.max(np.abs(xyz[:, :2]), axis=1) < 0.6 * np.max(xyz[:, 0])

    def off(radius: float | np.ndarray) -> float:
        normals = estimate_normals(noisy, tree, radius, 8)[inside]
        return float(np.sqrt(np.nanmean(np.degrees(np.arccos(np.abs(normals[:, 2]))) ** 2)))

    # The root for the two directions in which a plane turns, the factor for what the noise adds to the plane's edge.
    assert off(units.normal_radius(noisy, GROWTH)) < 1.5 * math.sqrt(2.0) * Params().angle_threshold / 2.0
    if depth > 1.0:
        assert off(GROWTH.normal_radius) > 2.0 * off(units.normal_radius(noisy, GROWTH))


def test_one_radius_for_all_is_that_of_each() -> None:
    xyz = wall(1.0) + np.random.default_rng(0).normal(0.0, 1e-3, (48 * 48, 3))
    tree = position_tree(xyz)
    each = estimate_normals(xyz, tree, np.where(np.arange(len(xyz)) % 2, 0.01, 0.02), 8)
    for parity, radius in ((0, 0.02), (1, 0.01)):
        alone = estimate_normals(xyz, tree, radius, 8)
        assert np.allclose(each[parity::2], alone[parity::2], atol=1e-9)


def test_a_camera_in_another_frame_sees_the_same() -> None:
    xyz = wall(1.3, tilt=0.4)
    apart, turned = (cKDTree(units_of(points).at(points)).query_pairs(0.004) for points in (xyz, xyz @ TURNED))
    assert apart == turned


def scaled(cloud: Cloud, factor: float) -> Cloud:
    return replace(cloud, xyz=(cloud.xyz.astype(np.float64) * factor))


@settings(deadline=None, max_examples=8)
@given(st.floats(1.0, 6.0))
def test_the_same_image_from_farther_away_has_the_same_regions(factor: float) -> None:
    """All of it lies where lengths grow with the depth: 160 pixels across are four times as wide as 640."""
    cloud = simulate(tabletop(1), Camera.kinect(160, 120), 1, None).cloud
    near, far = Pipeline(AUTO).run(scaled(cloud, 1.0)), Pipeline(AUTO).run(scaled(cloud, factor))
    assert far.scale == pytest.approx(near.scale, rel=1e-6)
    assert np.mean(near.labels != far.labels) < 1e-3  # what lies on a threshold may fall to either side
    assert not np.array_equal(near.labels, Pipeline(AUTO.replace(max_radius=0.005)).run(scaled(cloud, 6.0)).labels)


def test_the_order_of_the_points_does_not_matter() -> None:
    cloud = simulate(tabletop(1), Camera.kinect(160, 120), 1).cloud
    valid = np.flatnonzero(np.isfinite(cloud.xyz).all(axis=1))
    order = np.random.default_rng(0).permutation(valid)
    assert cloud.rgb is not None
    one, other = (Pipeline(AUTO).run(Cloud(cloud.xyz[rows], cloud.rgb[rows], 1, len(rows))) for rows in (valid, order))
    back = np.empty(len(valid), np.int64)
    back[np.argsort(order)] = np.arange(len(valid))
    assert other.scale == pytest.approx(one.scale, rel=1e-9)
    assert np.array_equal(one.labels, other.labels[np.argsort(order)])


def test_a_scene_that_moves_away_keeps_its_regions() -> None:
    views = [seen_from(1, distance, True) for distance in (1.0, 2.0)]
    auto, fixed = (
        [Pipeline(params).run(view.frame.cloud).labels for view in views]
        for params in (Params(), Params(max_radius=0.02))
    )
    near, far = views
    kept = agreement(near, auto[0], far, auto[1])
    assert kept > 0.7
    assert kept > agreement(near, fixed[0], far, fixed[1]) + 0.05
    assert agreement(near, auto[0], near, auto[0]) == pytest.approx(1.0)


def scattered(kind: str, n: int) -> np.ndarray:
    """Points in front of a camera that looks along z, as a list."""
    rng = np.random.default_rng(n)
    xyz = np.column_stack([rng.uniform(-0.5, 0.5, (n, 2)), np.ones(n)]) * rng.uniform(0.8, 1.2, (n, 1))
    if kind == "lattice":  # full of equal distances
        xyz[:, :2] = np.round(xyz[:, :2] / xyz[:, 2:], 1) * xyz[:, 2:]
    elif kind == "far out":
        xyz[: n // 200 + 1, 0] += 3.0
    elif kind == "on a line":
        xyz[:, 1] = 0.3 * xyz[:, 2]
    return xyz


@pytest.mark.parametrize("kind", ["evenly", "lattice", "far out", "on a line"])
@pytest.mark.parametrize("n", [49, 300, 5_000])
def test_neighbors_in_the_image_equal_a_tree_and_least_squares(kind: str, n: int) -> None:
    xyz, some = scattered(kind, n), np.arange(0, n, 7)
    image, k = xyz[:, :2] * (1.0 / xyz[:, 2:]), 49  # rounded as in the kernel, so that ties are the same
    nearest, bends, looked = image_neighbors(xyz, np.eye(3), some, *window_of(image[some]), k)
    assert len(nearest) == len(some) and looked >= k * len(some)
    near, _ = cKDTree(image).query(image[some], k=k)
    np.testing.assert_allclose(nearest, near[:, 1], atol=1e-12)
    for s, point in enumerate(some):
        d2 = ((image - image[point]) ** 2).sum(axis=1)
        found = np.lexsort([1.0 / xyz[:, 2], image[:, 1], image[:, 0], d2])[:k]
        plane = np.column_stack([image[found] - image[point], np.ones(k)])
        inverse = 1.0 / xyz[found, 2]
        rest = inverse - plane @ np.linalg.lstsq(plane, inverse, rcond=1e-9)[0]
        assert bends[s] == pytest.approx((rest**2).sum(), rel=1e-6, abs=1e-15)


def test_neighbors_in_the_image_take_little_of_a_large_cloud() -> None:
    xyz = scattered("evenly", 100_000)
    some = np.arange(0, len(xyz), 50)
    image = xyz[:, :2] / xyz[:, 2:]
    _, _, looked = image_neighbors(xyz, np.eye(3), some, *window_of(image[some]), 49)
    assert 49 * len(some) <= looked <= 250 * len(some)


def test_crowded_points_are_given_up_soon_and_found_in_a_tree() -> None:
    rng = np.random.default_rng(0)
    xyz = np.concatenate([scattered("evenly", 200), [0.0, 0.0, 1.0] + 1e-5 * rng.normal(size=(20_000, 3))])
    some = np.arange(0, len(xyz), 10)
    image = xyz[:, :2] / xyz[:, 2:]
    nearest, bends, looked = image_neighbors(xyz, np.eye(3), some, np.full(2, -0.5), np.full(2, 0.5), 49)
    assert len(nearest) == len(bends) == 0
    assert MOST * len(some) < looked <= MOST * len(some) + len(xyz)
    units = local_units(xyz, np.arange(len(xyz)), len(xyz), 1)
    spacing = np.median(cKDTree(image).query(image[some], k=2)[0][:, 1])
    assert units.depth == pytest.approx(REFERENCE_SPACING / spacing, rel=0.1)


def test_a_cloud_all_around_has_one_unit_from_its_spacing() -> None:
    rng = np.random.default_rng(0)
    xyz = rng.normal(size=(4_000, 3))
    xyz *= 5.0 / np.linalg.norm(xyz, axis=1, keepdims=True)
    units = local_units(xyz, np.arange(len(xyz)), len(xyz), 1)
    near = cKDTree(units.at(xyz)).query(units.at(xyz), k=2)[0][:, 1]
    assert math.isinf(units.depth)
    assert np.median(near) == pytest.approx(REFERENCE_SPACING, rel=0.05)  # half of the points are looked at
    assert np.allclose(units.at(xyz) * units.everywhere, xyz)


@pytest.mark.parametrize("xyz", [np.empty((0, 3)), np.ones((1, 3)), np.ones((50, 3)), np.zeros((50, 3))])
def test_clouds_without_a_spacing(xyz: np.ndarray) -> None:
    seg = Pipeline(AUTO).run(Cloud(xyz, np.zeros(xyz.shape, np.uint8), 1, len(xyz)))
    assert len(seg.labels) == len(xyz)


def squares(gaps: list[float]) -> np.ndarray:
    """Squares of 20 x 20 points, a REFERENCE_SPACING apart, with gaps of so many spacings between them, (N, 3)."""
    y, x = (grid.ravel() for grid in np.mgrid[0:20, 0:20])
    left = np.cumsum([0.0, *(19.0 + gap for gap in gaps)])
    return REFERENCE_SPACING * np.concatenate([np.column_stack([x + start, y, np.ones_like(x)]) for start in left])


@pytest.mark.parametrize(
    ("gaps", "regions", "begin", "end"), [([5.0, 20.0], 2, 5.0, 12.0), ([10.0, 20.0], 3, 4.0, 10.0)]
)
def test_the_scale_is_in_the_middle_of_the_stretch_over_which_regions_last(
    gaps: list[float], regions: int, begin: float, end: float
) -> None:
    xyz = squares(gaps)
    spread = np.array([[10.0, 10.0, 10.0], [-10.0, -10.0, 10.0]])  # wide apart: no camera
    cloud = Cloud(np.concatenate([xyz, spread, -spread]), np.zeros((len(xyz) + 4, 3), np.uint8), 1, len(xyz) + 4)
    seg = Pipeline(AUTO.replace(features="normals")).run(cloud)
    assert seg.scale == pytest.approx(REFERENCE_SPACING * math.sqrt(begin * end), rel=1e-6)
    assert FEWEST_SPACINGS * REFERENCE_SPACING < seg.scale < AUTO_REACH
    assert len(seg.regions) == regions


def test_how_long_regions_last_counted_by_hand() -> None:
    """Regions of 4, 4 and 1 points (none below 2): the first two join at 2, the third joins them at 4; the end is 8."""
    parent, order = np.array([0, 0, 0]), np.array([1, 2])
    death, weight = np.array([8.0, 2.0, 4.0]), np.array([4, 4, 1])
    lasting = stability(parent, order, death, weight, 2, 0.8, 1.0)
    assert lasting == pytest.approx([8 * math.log(2) / 9, 8 * math.log(4) / 9, math.log(4)])
    one, none = np.zeros(1, np.int64), np.zeros(0, np.int64)
    assert stability(one, none, np.array([8.0]), one + 1, 1, 0.8, 1.0) == pytest.approx([math.log(8)])
    assert stability(one, none, np.array([8.0]), one + 1, 2, 0.8, 1.0) == pytest.approx([0.0])
    assert stability(none, none, np.zeros(0), none, 1, 0.8, 1.0) == pytest.approx([0.0])


def test_the_result_says_its_scale_and_can_be_cut() -> None:
    cloud = simulate(tabletop(1), Camera.kinect(160, 120), 1).cloud
    seg = Pipeline(Params(max_radius="auto")).run(cloud)
    assert (seg.components.max_radius, seg.barcode.max_radius) == (AUTO_REACH,) * 2
    assert np.array_equal(seg.cut(seg.scale).labels, seg.labels)
    finite = np.isfinite(cloud.xyz).all(axis=1)
    for region in seg.regions:
        members = cloud.xyz[(seg.labels == region.label) & finite]
        assert np.allclose(region.centroid, members.mean(axis=0), atol=2e-3), "in metres, in the sensor frame"


def test_the_word_is_kept_as_it_is() -> None:
    params = Params(max_radius="auto")
    assert params.max_radius == "auto" and is_auto(params) and params == Params()
    assert not is_auto(Params(max_radius=0.02))
    assert Params(**dataclasses.asdict(params)) == params
    assert Params.from_mapping(params.as_dict()) == params
    assert dataclasses.replace(params, angle_threshold=3.0).max_radius == "auto"
    row = next(row for row in Params.table() if row.name == "max_radius")
    assert Params(max_radius=read_value(row, "auto")) == params
    assert not is_auto(params.replace(output="objects"))


def test_the_parameters_of_a_result_give_it_again() -> None:
    cloud = simulate(tabletop(1), Camera.kinect(160, 120), 1).cloud
    seg = Pipeline(Params(max_radius="auto")).run(cloud)
    assert seg.params == Params(max_radius="auto")
    assert np.array_equal(Pipeline(seg.params).run(cloud).labels, seg.labels)


@pytest.mark.parametrize("value", [0.0, "Auto", "automatic", ""])
def test_nothing_else_stands_for_it(value: object) -> None:
    with pytest.raises(ParameterError, match="max_radius"):
        Params(max_radius=value)  # type: ignore[arg-type]


@pytest.mark.parametrize("height", [1, 96])
def test_clutter_without_surfaces_is_no_noise_that_a_plane_takes(height: int) -> None:
    """Depths that have nothing to do with those beside them: as noise, they would put everything on one plane."""
    rng = np.random.default_rng(0)
    y, x = np.mgrid[-0.5:0.5:96j, -0.6:0.6:128j]
    depth = rng.uniform(1.0, 2.0, x.shape)
    xyz = np.stack([x * depth, y * depth, depth], axis=2).reshape(-1, 3)
    seg = Pipeline(AUTO.replace(remove_floor=True, features="normals")).run(
        Cloud(xyz, None, height, len(xyz) // height)
    )
    assert len(seg.index) > 0.8 * len(xyz)
