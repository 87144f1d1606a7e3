# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Borders judged on the image grid, and what is united across them, against plain Python."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from frames import constant, grid_of, plane
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import unite_by_hand
from scipy import ndimage

from topo_region_seg.beyond.objects.convexity import Borders
from topo_region_seg.beyond.objects.fragments import ENCLOSED, SMALL, borders_of_fragments
from topo_region_seg.beyond.objects.grid_borders import PARTS, grid_borders
from topo_region_seg.beyond.objects.spreading import spread_labels
from topo_region_seg.beyond.objects.uniting import unite_convex
from topo_region_seg.steps.view.lengths import Lengths
from topo_region_seg.steps.view.outlines import Relations

Ints = npt.NDArray[np.int64]


def random_borders(seed: int) -> tuple[Borders, int]:
    """Return borders with figures of which no two, nor two sums, are alike."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 16))
    first, second = np.triu_indices(n, 1)
    there = rng.random(len(first)) < rng.uniform(0.1, 0.9)
    first, second = first[there].astype(np.int64), second[there].astype(np.int64)
    pairs = 10.0 ** rng.uniform(1.0, 3.0, len(first))
    convex = pairs * rng.uniform(0.4, 1.0, len(first))
    return Borders(first, second, pairs, convex, rng.random(len(first))), n


def same_partition(a: Ints, b: Ints) -> bool:
    return len(np.unique(np.column_stack([a, b]), axis=0)) == len(np.unique(a)) == len(np.unique(b))


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from([0.5, 0.6, 0.8, 1.0]))
def test_the_surest_border_comes_first_and_what_is_united_is_judged_again(seed, share) -> None:
    borders, n = random_borders(seed)
    wanted = unite_by_hand(borders, np.ones(n, np.bool_), share)
    np.testing.assert_array_equal(unite_convex(borders, n, share), wanted)


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**31))
def test_the_numbers_of_regions_do_not_matter(seed) -> None:
    borders, n = random_borders(seed)
    number = np.random.default_rng(seed).permutation(n)
    first, second = number[borders.first], number[borders.second]
    other = borders._replace(first=np.minimum(first, second), second=np.maximum(first, second))
    order = np.lexsort((other.second, other.first))
    other = Borders(*(np.ascontiguousarray(column[order]) for column in other))
    assert same_partition(unite_convex(other, n, 0.6)[number], unite_convex(borders, n, 0.6))


def test_borders_of_few_pairs_are_not_judged() -> None:
    for pairs, united in ((19.0, [0, 1]), (20.0, [0, 0])):
        one = np.array([pairs])
        borders = Borders(np.array([0]), np.array([1]), one, one, np.zeros(1))
        assert unite_convex(borders, 2, 0.6).tolist() == united


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from([(9, 11, 3), (43, 50, 15), (40, 64, 40)]))
def test_borders_on_the_grid_are_those_of_a_plain_loop(seed, sizes) -> None:
    """In images of which every part, or only some, is near a border of two labels."""
    rng = np.random.default_rng(seed)
    height, width, side = sizes
    pixel, reach = 0.005, 0.02
    xyz, _ = plane(height, width, pixel, (0.5, 0.3), 1.0, lambda z: 0.003 + 0.0 * z, seed)
    blocks = rng.integers(0, 5, (height // side + 1, width // side + 1))
    label = np.repeat(np.repeat(blocks, side, axis=0), side, axis=1)[:height, :width].ravel().astype(np.int32)
    wanted = rng.random(5) < 0.6
    label[rng.random(len(label)) < 0.1] = 0
    normals = rng.normal(size=xyz.shape).astype(np.float32)
    normals[label == 0] = np.nan
    grid, lengths = grid_of(xyz, height, width), Lengths(1.1, 0.7, 4.0)
    found = grid_borders(grid, normals, label, wanted, lengths, reach, pixel)
    expected: dict[tuple[int, int], list[float]] = {}
    for p in np.flatnonzero(label):
        y, x = divmod(int(p), width)
        z = float(grid.depth[p])
        own = min(max(1.1 * z, 0.7), 4.0) * reach
        for part in PARTS:
            far = part * own / (pixel * z)
            straight, slanted = max(1, round(far)), max(1, round(0.71 * far))
            for dx, dy in ((straight, 0), (0, straight), (slanted, slanted), (-slanted, slanted)):
                if not (0 <= x + dx < width and y + dy < height):
                    continue
                q = (y + dy) * width + x + dx
                apart = grid.xyz[p].astype(float) - grid.xyz[q].astype(float)
                distance = np.linalg.norm(apart)
                if label[q] in (0, label[p]) or distance > own or not wanted[[label[p], label[q]]].any():
                    continue
                key = min(label[p], label[q]), max(label[p], label[q])
                row = expected.setdefault(key, [0.0, 0.0, np.inf])
                row[0] += 1.0
                row[1] += (normals[p].astype(float) - normals[q].astype(float)) @ apart > -0.1 * distance
                row[2] = min(row[2], distance)
    assert list(zip(found.first.tolist(), found.second.tolist(), strict=True)) == sorted(expected)
    rows = np.array([expected[key] for key in sorted(expected)]).reshape(-1, 3)
    np.testing.assert_array_equal(np.column_stack([found.pairs, found.convex]), rows[:, :2])
    np.testing.assert_allclose(found.nearest, rows[:, 2])


BOX = np.ones((3, 3))
FLAT = 24, 30


def spread(label: npt.NDArray[np.int32], todo, rounds: int, depth=None) -> npt.NDArray[np.int32]:
    xyz, _ = plane(*FLAT, 0.002, (0.0, 0.0), 1.0, lambda z: 0.0 * z, 0)
    if depth is not None:
        xyz = xyz * depth[:, None]
    normals = np.tile(np.float32([0, 0, -1]), (len(xyz), 1))
    return spread_labels(grid_of(xyz, *FLAT), normals, label, todo, constant(0.001), 0.002, rounds)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), st.integers(0, 12))
def test_labels_spread_ring_by_ring_and_change_none(seed, rounds) -> None:
    rng = np.random.default_rng(seed)
    count = FLAT[0] * FLAT[1]
    label = np.where(rng.random(count) < 0.01, rng.integers(1, 4, count), 0).astype(np.int32)
    todo = rng.random(count) < 0.7
    found = spread(label, todo, rounds)
    assert (found[label > 0] == label[label > 0]).all()
    reached = (label > 0).reshape(FLAT)
    if rounds:
        mask = (todo | (label > 0)).reshape(FLAT)
        reached = ndimage.binary_dilation(reached, BOX, iterations=rounds, mask=mask)
    np.testing.assert_array_equal(found > 0, reached.ravel())
    # What is reached is that which began somewhere in the same piece of the image.
    pieces = ndimage.label((found > 0).reshape(FLAT), BOX)[0].ravel()
    for piece in range(1, pieces.max() + 1):
        assert set(found[pieces == piece]) == set(label[(pieces == piece) & (label > 0)])


def test_labels_do_not_spread_across_a_depth_step() -> None:
    x, y = np.arange(720) % 30, np.arange(720) // 30
    label = np.where((x == 2) & (y == 5), 1, 0).astype(np.int32)
    found = spread(label, np.ones(720, np.bool_), 99, np.where(x < 15, 1.0, 1.04))
    np.testing.assert_array_equal(found == 1, x < 15)
    assert (spread(label, np.ones(720, np.bool_), 99, np.where(x < 15, 1.0, 1.004)) == 1).all()


def test_a_pixel_without_a_label_goes_to_the_plane_that_it_continues() -> None:
    """Between two labels, both beside it: the normals of the left one fit, those of the right one do not."""
    xyz, _ = plane(*FLAT, 0.002, (0.0, 0.0), 1.0, lambda z: 0.0 * z, 0)
    x = np.arange(720) % 30
    for fits, wanted in ((1, 1), (2, 2)):
        label = np.where(x < 15, 1, np.where(x > 15, 2, 0)).astype(np.int32)
        normals = np.where((label == fits)[:, None], [0.0, 0.0, -1.0], [0.8, 0.0, -0.6]).astype(np.float32)
        todo = np.ones(720, np.bool_)
        found = spread_labels(grid_of(xyz, *FLAT), normals, label, todo, constant(0.001), 0.002, 1)
        assert (found[x == 15] == wanted).all()


def one_fragment(touching: float, hidden: float, size: int, pairs: float = 100.0, convex: float = 50.0) -> Borders:
    """Return what is left of the border between a large label 1 and label 2, of 100 outline pixels."""
    counts = np.array([[0.0, touching, hidden], [hidden, touching, 100.0 - touching - hidden]])
    found = Relations(np.array([1, 2]), np.array([2, 1]), counts, np.zeros(6), np.zeros(6))
    given = Borders(np.array([1]), np.array([2]), np.array([pairs]), np.array([convex]), np.zeros(1))
    return borders_of_fragments(given, found, np.array([0, 5000, size]))


def test_a_fragment_is_small_and_touches_what_it_belongs_to() -> None:
    assert one_fragment(20.0, 0.0, SMALL).pairs.tolist() == [100.0]
    assert one_fragment(20.0, 0.0, SMALL + 1).pairs.tolist() == [0.0]
    assert one_fragment(10.0, 0.0, SMALL).pairs.tolist() == [0.0]  # touches along too little
    assert one_fragment(20.0, 30.0, SMALL).pairs.tolist() == [0.0]  # it is rather hidden by it
    assert one_fragment(20.0, 0.0, SMALL).convex.tolist() == [50.0]
    assert one_fragment(40.0, 0.0, SMALL).convex.tolist() == [50.0 + 100.0 * ENCLOSED]
    assert one_fragment(40.0, 0.0, SMALL, convex=90.0).convex.tolist() == [100.0]
