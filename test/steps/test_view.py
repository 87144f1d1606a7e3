# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The sensor told from a frame, lengths that follow from it, and labels on the image grid, against plain Python."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pytest
from frames import Array, constant, grid_of, kinect, plane
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import ndimage

from topo_region_seg.params import Params
from topo_region_seg.steps.view.grid import ImageGrid
from topo_region_seg.steps.view.label_image import kept_labels, sizes_of, united_labels, wide_labels
from topo_region_seg.steps.view.lengths import (
    AS_GIVEN,
    NORMAL_ERROR,
    Lengths,
    lengths_of,
    local_positions,
    pixels_of,
    scales,
)
from topo_region_seg.steps.view.model import LEAST, sensor_model
from topo_region_seg.steps.view.outlines import OCCLUDED, OWN, TOUCHING, relations
from topo_region_seg.steps.view.scene import FREE, Scene
from topo_region_seg.steps.view.table import KNOTS, DepthTable

Ints = npt.NDArray[np.int32]
SIZE = 240, 320
SLOPES = [(0.0, 0.0), (0.5, 0.0), (0.3, -0.8)]


def stereo(z: Array) -> Array:
    return 0.0005 + 0.002 * z**2


def even(z: Array) -> Array:
    return np.full_like(z, 0.004)


@pytest.mark.parametrize("pixel", [1 / 265.0, 1 / 525.0, 1 / 900.0])
@pytest.mark.parametrize("slopes", SLOPES)
@pytest.mark.parametrize("sigma", [kinect, stereo, even])
def test_noise_and_pixels_are_those_that_the_frame_was_made_with(pixel, slopes, sigma) -> None:
    xyz, true = plane(*SIZE, pixel, slopes, 1.2, sigma, seed=1)
    model = sensor_model(grid_of(xyz, *SIZE))
    assert model is not None
    assert model.pixel == pytest.approx(pixel, rel=0.01)
    assert model.middle == pytest.approx(np.median(true), rel=0.01) and model.valid == 1.0
    depths = np.quantile(true, [0.1, 0.3, 0.5, 0.7, 0.9])
    np.testing.assert_allclose(model.noise_at(depths), sigma(depths), rtol=0.15)


@pytest.mark.parametrize("scale", [0.5, 3.0])
def test_in_other_units_noise_is_as_many_times_as_large_and_angles_stay(scale) -> None:
    xyz, true = plane(*SIZE, 1 / 525.0, (0.3, -0.9), 1.2, kinect, seed=2)
    model, other = sensor_model(grid_of(xyz, *SIZE)), sensor_model(grid_of(scale * xyz, *SIZE))
    assert model is not None and other is not None
    depths = np.quantile(true, [0.1, 0.5, 0.9])
    np.testing.assert_allclose(other.noise_at(scale * depths), scale * model.noise_at(depths), rtol=1e-3)
    assert other.pixel == pytest.approx(model.pixel, rel=1e-6)


def test_holes_change_little() -> None:
    xyz, true = plane(*SIZE, 1 / 525.0, (0.3, -0.9), 1.2, kinect, seed=3)
    rng = np.random.default_rng(3)
    holes = ndimage.binary_dilation(rng.random(SIZE) < 0.002, iterations=5).ravel()
    assert 0.05 < holes.mean() < 0.3
    model = sensor_model(grid_of(np.where(holes[:, None], np.nan, xyz), *SIZE))
    assert model is not None and model.pixel == pytest.approx(1 / 525.0, rel=0.01)
    assert model.valid == pytest.approx(1.0 - holes.mean(), abs=0.03)
    depths = np.quantile(true, [0.1, 0.5, 0.9])
    np.testing.assert_allclose(model.noise_at(depths), kinect(depths), rtol=0.15)


def test_depth_steps_between_things_are_not_taken_for_noise() -> None:
    xyz, true = plane(*SIZE, 1 / 525.0, (0.3, -0.9), 1.2, kinect, seed=4)
    steps = (np.arange(SIZE[1]) // 40 % 2 * np.ones(SIZE)).ravel()
    model = sensor_model(grid_of(xyz * (1.0 - 0.15 * steps[:, None]), *SIZE))
    assert model is not None
    middle = np.median(true)
    assert kinect(middle) * 0.6 < model.noise_at(middle) < kinect(middle) * 1.6


def test_exact_depths_have_the_least_noise_and_sparse_images_tell_none() -> None:
    xyz, _ = plane(*SIZE, 1 / 525.0, (0.3, -0.9), 1.2, lambda z: 0.0 * z, seed=5)
    model = sensor_model(grid_of(xyz, *SIZE))
    assert model is not None
    np.testing.assert_allclose(model.noise.value, LEAST, rtol=1e-6)
    few = np.where(np.random.default_rng(5).random(len(xyz))[:, None] < 0.02, xyz, np.nan)
    assert sensor_model(grid_of(few, *SIZE)) is None
    assert sensor_model(grid_of(np.full_like(xyz, np.nan), *SIZE)) is None


def images(most: int, sides: tuple[int, int] = (1, 14)) -> st.SearchStrategy[Ints]:
    shape = st.tuples(st.integers(*sides), st.integers(*sides))
    return shape.flatmap(lambda size: arrays(np.int32, size, elements=st.integers(0, most - 1)))


@settings(max_examples=150, deadline=None)
@given(
    st.one_of(images(3), images(2, (8, 20)).map(lambda a: np.repeat(np.repeat(a[:5, :5], 5, 0), 4, 1))),
    st.one_of(st.integers(2, 8).map(float), st.floats(1.0, 8.0, exclude_min=True)),
)
def test_labels_are_wide_whose_pixels_are_far_enough_from_a_border_on_a_chessboard(label, least) -> None:
    label = np.ascontiguousarray(label)
    found = wide_labels(label.ravel(), *label.shape, 4, least)
    wide = np.pad(label, 1, mode="edge")
    around = np.stack([wide[:-2, 1:-1], wide[2:, 1:-1], wide[1:-1, :-2], wide[1:-1, 2:]])
    border = (around != label).any(axis=0)
    half = ndimage.distance_transform_cdt(~border, "chessboard") + 1 if border.any() else np.full(label.shape, 99)
    assert found.tolist() == [bool((half[label == k] >= least).any()) for k in range(4)]


@settings(max_examples=50, deadline=None)
@given(images(7))
def test_sizes_are_counts_of_pixels(label) -> None:
    assert sizes_of(label.ravel(), 8).tolist() == np.bincount(label.ravel(), minlength=8).tolist()


@settings(max_examples=80, deadline=None)
@given(images(6), st.lists(st.booleans(), min_size=6, max_size=6))
def test_kept_labels_are_counted_again_in_order(label, keep) -> None:
    label = label.ravel()
    found = kept_labels(label, np.array(keep))
    numbers = [k for k in range(1, 6) if keep[k]]
    assert found.tolist() == [numbers.index(k) + 1 if k in numbers else 0 for k in label.tolist()]


@settings(max_examples=80, deadline=None)
@given(images(7), st.lists(st.integers(1, 6), min_size=6, max_size=6))
def test_united_labels_are_one_and_counted_again(label, into) -> None:
    label, group = label.ravel(), [0, *into]
    while any(group[g] != g for g in group):
        group = [group[g] if group[g] != g and g < k else min(g, k) for k, g in enumerate(group)]
    found = united_labels(label, np.array(group))
    numbers = sorted(set(group) - {0})
    assert found.tolist() == [numbers.index(group[k]) + 1 if k else 0 for k in label.tolist()]


def beyond_outlines(label: Ints, depth: Array, n: int, noise: DepthTable, pixel: float):
    """Walk along each row and each column and note which label follows which, and how."""
    pairs: dict[tuple[int, int], list[int]] = {}
    frame, void = [0] * n, [0] * n
    depths = noise.near + np.arange(KNOTS) / noise.density
    lines = [(label[y], depth[y]) for y in range(label.shape[0])]
    lines += [(label[:, x], depth[:, x]) for x in range(label.shape[1])]
    for labels, z in lines:
        seen = [i for i in range(len(labels)) if labels[i] > 0]
        for i, room in ((seen[0], seen[0]), (seen[-1], len(labels) - 1 - seen[-1])) if seen else ():
            (frame if room <= 4 else void)[labels[i]] += 1
        for i, j in pairwise(seen):
            if labels[i] == labels[j]:
                continue
            step = max(0.008, 4.0 * np.interp(z[i], depths, noise.value)) + 3.0 * (j - i) * pixel * z[i]
            kind = OWN if z[j] - z[i] > step else OCCLUDED if z[i] - z[j] > step else TOUCHING
            pairs.setdefault((labels[i], labels[j]), [0, 0, 0])[kind] += 1
            other = {OWN: OCCLUDED, OCCLUDED: OWN, TOUCHING: TOUCHING}[kind]
            pairs.setdefault((labels[j], labels[i]), [0, 0, 0])[other] += 1
    return pairs, frame, void


@settings(max_examples=60, deadline=None)
@given(images(5, (1, 18)), st.integers(0, 2**31))
def test_relations_are_those_of_a_walk_along_rows_and_columns(label, seed) -> None:
    rng = np.random.default_rng(seed)
    depth = rng.choice([1.0, 1.01, 1.1, 1.5], label.shape).astype(np.float32)
    noise = DepthTable(0.8, 70.0, rng.uniform(0.0005, 0.02, KNOTS))
    found = relations(label.ravel(), depth.ravel(), *label.shape, 5, noise, 0.002)
    pairs, frame, void = beyond_outlines(label, depth.astype(float), 5, noise, 0.002)
    assert list(zip(found.first.tolist(), found.second.tolist(), strict=True)) == sorted(pairs)
    assert found.pixels.tolist() == [pairs[key] for key in sorted(pairs)]
    assert (found.frame.tolist(), found.void.tolist()) == (frame, void)
    among = [sum(sum(count) for (a, _), count in pairs.items() if a == k) + frame[k] + void[k] for k in range(5)]
    assert found.totals(5).tolist() == [max(total, 1) for total in among]


def test_what_a_large_image_shows_is_not_cut_off() -> None:
    """More transitions than there is room for at first: a chessboard."""
    y, x = np.mgrid[0:80, 0:80]
    label = (1 + (x + y) % 2).astype(np.int32)
    found = relations(label.ravel(), np.ones(6400, np.float32), 80, 80, 3, constant(0.001), 0.002)
    assert found.pixels[:, TOUCHING].tolist() == [2 * 80 * 79] * 2


def scene_of_plane(sigma, far: float = 1.2, pixel: float = 1 / 525.0) -> Scene:
    grid = grid_of(plane(*SIZE, pixel, (0.0, 0.0), far, sigma, seed=6)[0], *SIZE)
    model = sensor_model(grid)
    assert model is not None
    return Scene(grid, model, np.full(grid.height * grid.width, FREE, np.uint8))


@pytest.mark.parametrize("name", ["object_normal_radius", "object_border_radius"])
def test_lengths_that_were_set_are_as_given(name) -> None:
    scene, params = scene_of_plane(kinect, 2.0), Params(output="objects")
    assert lengths_of(scene, params) != AS_GIVEN
    assert lengths_of(scene, params.replace(**{name: 1.25 * getattr(params, name)})) == AS_GIVEN
    assert lengths_of(scene, params.replace(object_radius=0.02)) == lengths_of(scene, params)
    assert scales(AS_GIVEN, np.array([0.3, 1.0, 9.0])).tolist() == [1.0, 1.0, 1.0]


@pytest.mark.parametrize(("noise", "far"), [(0.002, 1.2), (0.004, 1.2), (0.003, 2.0)])
def test_a_plane_fitted_over_the_radius_of_normals_is_turned_by_the_error_that_is_allowed(noise, far) -> None:
    def sigma(z):
        return np.full_like(z, noise)

    scene, params = scene_of_plane(sigma, far), Params(output="objects")
    lengths = lengths_of(scene, params)
    radius = params.object_normal_radius * float(scales(lengths, np.array(far)))
    spacing = far * scene.model.pixel
    reach = int(radius / spacing)
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1] * spacing
    disk = np.hypot(x, y) <= radius
    places = np.column_stack([x[disk], y[disk], np.ones(disk.sum())])
    heights = np.random.default_rng(0).normal(0.0, noise, (len(places), 4000))
    slopes = np.linalg.lstsq(places, heights, rcond=None)[0][:2]
    assert np.sqrt((slopes**2).mean()) == pytest.approx(NORMAL_ERROR, rel=0.15)


def test_lengths_stay_within_their_bounds_and_count_in_pixels() -> None:
    lengths, model = Lengths(1.0, 0.7, 4.0), scene_of_plane(kinect).model
    assert scales(lengths, np.array([0.1, 0.7, 2.0, 9.0])).tolist() == [0.7, 0.7, 2.0, 4.0]
    assert pixels_of(0.01, lengths, model, 2.0) == pytest.approx(0.01 * 2.0 / (2.0 / 525.0), rel=0.01)


def test_local_positions_have_lengths_in_units_of_their_scale() -> None:
    rng, lengths = np.random.default_rng(7), Lengths(1.0, 0.7, 4.0)
    z = rng.uniform(0.4, 3.5, 400)
    xyz = np.column_stack([rng.uniform(-0.4, 0.4, (400, 2)) * z[:, None], z])
    for direction in np.eye(3):
        near = xyz + 1e-5 * direction
        local = local_positions(np.concatenate([xyz, near]), np.eye(3), lengths)
        length = np.linalg.norm(local[400:] - local[:400], axis=1) * scales(lengths, z) / 1e-5
        # Along the line of sight, off the middle of the view, also what is beside a point moves.
        np.testing.assert_allclose(length, 1.0, rtol=0.02 if direction[2] == 0 else 0.2)


def test_a_grid_has_points_at_their_pixels_and_nothing_elsewhere() -> None:
    xyz = plane(4, 5, 0.01, (0.2, 0.1), 1.0, kinect, seed=8)[0]
    rows = np.array([0, 3, 7, 19])
    grid = grid_of(np.where(np.isin(np.arange(20), rows)[:, None], xyz, np.nan), 4, 5)
    assert isinstance(grid, ImageGrid) and np.flatnonzero(np.isfinite(grid.depth)).tolist() == rows.tolist()
    np.testing.assert_array_equal(grid.xyz[rows], xyz[rows].astype(np.float32))
    np.testing.assert_array_equal(grid.depth[rows], xyz[rows, 2].astype(np.float32))
