# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Crop, floor and thinning."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import Array
from scipy.spatial.transform import Rotation

from topo_region_seg.params import Params
from topo_region_seg.steps.crop import crop
from topo_region_seg.steps.support.removal import above
from topo_region_seg.steps.support.search import find_support
from topo_region_seg.steps.thinning.voxels import thin, thin_for, thin_to

ORIGIN = np.zeros(3)


def test_crop_drops_what_is_not_a_point() -> None:
    nan, inf = np.nan, np.inf
    xyz = np.array(
        [[0, 0, 1], [nan, 0, 1], [0, inf, 1], [0, 0, 0], [0, 0, -inf], [1e30, 1, 1], [1e-30, 0, 1]], np.float32
    )
    np.testing.assert_array_equal(crop(xyz, ORIGIN, Params()), [0, 6])
    np.testing.assert_array_equal(crop(xyz, ORIGIN, Params(drop_zeros=False)), [0, 3, 6])


def test_crop_by_range_is_distance_from_the_sensor() -> None:
    xyz = np.array([[3.0, 0.0, 4.0], [0.0, 0.0, 5.01], [0.0, -0.5, 0.0], [0.0, 0.0, -1.0]])
    np.testing.assert_array_equal(crop(xyz, ORIGIN, Params(min_range=0.6, max_range=5.0)), [0, 3])


def test_crop_box_in_a_turned_frame() -> None:
    rng = np.random.default_rng(0)
    inside = rng.uniform([-0.1, -0.2, 0.0], [0.1, 0.2, 0.3], (50, 3))
    outside = inside + [0.0, 0.0, 0.5]
    pose = (0.3, -0.1, 1.0, 0.4, -0.2, 1.3)
    to_sensor = Rotation.from_euler("xyz", pose[3:])
    xyz = to_sensor.apply(np.vstack([inside, outside])) + pose[:3]
    params = Params(crop_box=(-0.1, -0.2, 0.0, 0.1, 0.2, 0.3), crop_box_pose=pose)
    np.testing.assert_array_equal(crop(xyz, ORIGIN, params), np.arange(50))


def tabletop(seed: int, noise: float = 0.001) -> tuple[Array, int]:
    """A slanted table (first rows), then a box on it, then a floor behind it."""
    rng = np.random.default_rng(seed)
    table = np.column_stack([rng.uniform(-0.5, 0.5, 8000), rng.uniform(-0.4, 0.4, 8000), rng.normal(0.0, noise, 8000)])
    box = np.column_stack([rng.uniform(-0.1, 0.1, (2000, 2)), np.full(2000, 0.15)])
    floor = np.column_stack([rng.uniform(-1.5, 1.5, (3000, 2)), np.full(3000, -0.7)])
    turn = Rotation.from_euler("x", 130.0, degrees=True)
    sensor = turn.inv().apply([0.0, 0.0, -1.0])
    crossing = sensor + (floor - sensor) * (sensor[2] / (sensor[2] - floor[:, 2]))[:, None]
    floor = floor[(np.abs(crossing[:, :2]) > [0.55, 0.45]).any(axis=1)]  # what the table does not hide
    return turn.apply(np.vstack([table, box, floor])) + [0.0, 0.0, 1.0], len(table)


@pytest.mark.parametrize("seed", range(5))
def test_the_table_goes_with_what_is_behind_it(seed: int) -> None:
    xyz, n_table = tabletop(seed)
    plane = find_support(xyz, 0.01, 0.3, 0).plane
    assert plane is not None
    true_normal = Rotation.from_euler("x", 130.0, degrees=True).apply([0.0, 0.0, 1.0])
    assert np.degrees(np.arccos(min(1.0, abs(true_normal @ plane.normal)))) < 0.1
    assert plane.offset > 0.0  # the sensor is in front
    np.testing.assert_array_equal(above(xyz, plane, 0.01), np.arange(n_table, n_table + 2000))


def test_the_plane_does_not_depend_on_the_order_of_the_points() -> None:
    xyz, _ = tabletop(1)
    plane = find_support(xyz, 0.01, 0.3, 0).plane
    shuffled = find_support(xyz[np.random.default_rng(3).permutation(len(xyz))], 0.01, 0.3, 0).plane
    assert plane is not None
    assert shuffled is not None
    np.testing.assert_allclose([*plane.normal, plane.offset], [*shuffled.normal, shuffled.offset], atol=1e-9)
    assert plane == find_support(xyz, 0.01, 0.3, 0).plane


def test_a_face_too_small_to_carry_objects_stays() -> None:
    rng = np.random.default_rng(0)
    face = np.column_stack([rng.uniform(0.0, 0.1, 5000), rng.uniform(0.0, 0.2, 5000), np.full(5000, 0.8)])
    assert find_support(face, 0.01, 0.3, 0).plane is None
    assert find_support(face, 0.01, 0.05, 0).plane is not None


@pytest.mark.parametrize("n", [0, 1, 2, 3, 10])
def test_few_or_coinciding_points_have_no_floor(n: int) -> None:
    assert find_support(np.ones((n, 3)), 0.01, 0.3, 0).plane is None
    assert find_support(np.outer(np.arange(n), [1.0, 0.0, 0.0]) + 1.0, 0.01, 0.3, 0).plane is None


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("places", [1, 2, 3, 5, 20])
def test_many_points_at_few_places_are_an_answer_and_no_error(places: int, seed: int) -> None:
    spots = np.random.default_rng(seed).uniform(-0.5, 0.5, (places, 3)) + [0.0, 0.0, 1.0]
    xyz = np.repeat(spots, 20_000 // places, axis=0)
    plane = find_support(xyz, 0.01, 0.3, 0).plane
    assert places > 2 or plane is None, "two places make no plane"


def test_thinning_keeps_one_mean_per_voxel() -> None:
    rng = np.random.default_rng(0)
    xyz = rng.uniform(-0.1, 0.1, (3000, 3))
    rgb = rng.integers(0, 256, (3000, 3)).astype(np.uint8)
    thinned = thin(xyz, rgb, 0.03)
    cells = np.floor(xyz / 0.03).astype(int)
    assert len(thinned.xyz) == len(np.unique(cells, axis=0))
    assert thinned.rgb is not None
    for voxel in range(len(thinned.xyz)):
        members = np.flatnonzero(thinned.voxel == voxel)
        assert len(np.unique(cells[members], axis=0)) == 1
        assert thinned.first[voxel] == members.min()
        np.testing.assert_allclose(thinned.xyz[voxel], xyz[members].mean(axis=0))
        np.testing.assert_allclose(thinned.rgb[voxel], rgb[members].mean(axis=0), atol=0.5)


@pytest.mark.parametrize("seed", range(3))
def test_thinning_that_mixes_no_colors_keeps_the_points_of_mixed_voxels(seed: int) -> None:
    rng = np.random.default_rng(seed)
    xyz = rng.uniform(-0.1, 0.1, (400, 3))
    rgb = np.array([[200, 0, 0], [0, 0, 200]], np.uint8)[(rng.random(400) < 0.1).astype(int)]
    thinned = thin(xyz, rgb, 0.05, mix_colors=False)
    assert thinned.rgb is not None
    _, cell = np.unique(np.floor(xyz / 0.05).astype(int), axis=0, return_inverse=True)
    wanted: dict[tuple[int, int], list[int]] = {}  # in the order of appearance
    for point, here in enumerate(cell.reshape(-1)):
        mixed = len(np.unique(rgb[cell.reshape(-1) == here], axis=0)) > 1
        wanted.setdefault((-1, point) if mixed else (0, here), []).append(point)
    assert 0 < sum(key[0] < 0 for key in wanted) < len(wanted)
    assert len(thinned.xyz) == len(wanted)
    for voxel, points in enumerate(wanted.values()):
        assert np.flatnonzero(thinned.voxel == voxel).tolist() == points
        assert (thinned.first[voxel], thinned.weight[voxel]) == (points[0], len(points))
        np.testing.assert_allclose(thinned.xyz[voxel], xyz[points].mean(axis=0))
        np.testing.assert_array_equal(thinned.rgb[voxel], rgb[points[0]])


def sheet(side: int) -> np.ndarray:
    x, y = (0.002 * grid.ravel() for grid in np.meshgrid(np.arange(side), np.arange(side)))
    return np.column_stack([x - 0.001 * side, y - 0.001 * side, np.full(x.size, 1.0)])


CROWDS = {
    "sheet": sheet(60),
    "identical": np.full((500, 3), 2.0),
    "line": np.outer(np.arange(800.0), [0.001, -0.002, 0.003]),
    "around the sensor": np.random.default_rng(0).normal(size=(900, 3)),
    "tiny": 1e-300 * np.random.default_rng(0).random((500, 3)),
    "a speck and a far point": np.concatenate([1e-4 * np.random.default_rng(0).random((500, 3)), [[900.0, 0, 0]]]),
    "ever smaller": 0.97 ** np.arange(900.0)[:, None] * [1.0, -1.0, 1.0],
}


@pytest.mark.parametrize("name", CROWDS)
@pytest.mark.parametrize("most", [1, 2, 7, 100])
def test_thinning_to_a_number_never_leaves_more(name: str, most: int) -> None:
    xyz = CROWDS[name]
    thinned = thin_to(xyz, None, most)
    assert 1 <= len(thinned.xyz) <= most
    assert thinned.voxel.max() == len(thinned.xyz) - 1
    assert thinned.weight.sum() == len(xyz)
    assert np.abs(thinned.xyz[thinned.voxel] - xyz).max() <= thinned.edge


def test_thinning_to_a_number_leaves_a_good_part_of_it() -> None:
    for most in (300, 1000, 2500):
        assert len(thin_to(sheet(60), None, most).xyz) > most / 3


def test_a_cloud_is_thinned_to_max_points_only_where_that_is_wanted_and_needed() -> None:
    xyz = sheet(60)
    rejecting, enough = Params(voxel_size=0.0, max_points=1000), Params(voxel_size=0.0, max_points=3600)
    assert thin_for(rejecting, xyz, None) is None
    assert thin_for(enough.replace(over_max_points="thin"), xyz, None) is None
    for voxel_size, wider in ((0.0, True), (0.001, True), (0.006, False)):
        thinned = thin_for(rejecting.replace(over_max_points="thin", voxel_size=voxel_size), xyz, None)
        assert thinned is not None
        assert len(thinned.xyz) <= 1000
        assert (thinned.edge > voxel_size) == wider


def test_thinning_a_wide_cloud_does_not_overflow() -> None:
    xyz = np.array([[0.0, 0.0, 0.0], [9e5, 9e5, 9e5], [0.0001, 0.0, 0.0], [-9e5, 9e5, -9e5]])
    thinned = thin(xyz, None, 0.001)
    assert len(thinned.xyz) == 3
    assert thinned.voxel[0] == thinned.voxel[2]
