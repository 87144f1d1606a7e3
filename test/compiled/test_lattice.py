# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Where rounding could decide: points exactly a radius apart, far from the middle of their cloud; equal distances."""

from __future__ import annotations

import numpy as np
import pytest

from topo_region_seg.api import persistent_components
from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.compiled.kd_tree import LEAF, position_tree
from topo_region_seg.compiled.leaf_blocks import leaf_blocks
from topo_region_seg.compiled.nearest import found_near, nearest_of_leaf, room_for_near
from topo_region_seg.compiled.predicate import Criterion
from topo_region_seg.params import Params
from topo_region_seg.steps.filtration.persistence import filtration

LOOSE = Criterion(reach=1e30, color_low=0.0, color_high=1e30, chord_low=0.0, chord_high=1e30)
STEP = round(0.01 * 2**36) / 2**36
"""Metres; multiples of it up to 8 km and their differences are exact in double precision, and not in single."""


def stairs(n: int, seed: int) -> np.ndarray:
    """Points each of which has two others at a distance of STEP, along an axis, and all others farther away."""
    axes = np.random.default_rng(seed).integers(0, 3, n - 1)
    return np.concatenate([np.zeros((1, 3)), np.cumsum(np.eye(3)[axes], axis=0)]) * STEP


def components(xyz: np.ndarray, radius: float):
    normals = np.tile([0.0, 0.0, -1.0], (len(xyz), 1))
    return persistent_components(xyz, None, normals, Params(features="normals", max_radius=radius))


@pytest.mark.parametrize("far", [5, 50, 500, 5000])
@pytest.mark.parametrize("seed", range(3))
def test_edges_of_exactly_the_radius_are_found_and_longer_ones_are_not(far: int, seed: int) -> None:
    n = 400
    away = round(far / STEP) * STEP * np.array([1.0, -0.5, 0.25])
    xyz = np.concatenate([stairs(n, seed), stairs(n, seed + 9) + np.round(away / STEP) * STEP])
    order = np.random.default_rng(seed).permutation(2 * n)
    found = components(xyz[order], STEP)
    np.testing.assert_array_equal(found.death[np.isfinite(found.death)], STEP)
    roots = np.unique(found.root)
    assert len(roots) == 2
    assert [len(np.unique(found.root[order < n])), len(np.unique(found.root[order >= n]))] == [1, 1]
    below = components(xyz[order], float(np.nextafter(STEP, 0.0)))
    assert np.isinf(below.death).all()


@pytest.mark.parametrize("limit", Criterion._fields)
@pytest.mark.parametrize(
    ("copies", "scale", "far"),
    [
        *((copies, 1.0, far) for copies in (1, 8, 32) for far in (0.0, 5000.0)),
        *((copies, 1e-21, 0.0) for copies in (1, 8)),  # where squares have few digits left in single precision
        (32, 1e-12, 0.0),
    ],
)
def test_a_pair_exactly_at_a_limit_is_an_edge_and_one_beyond_is_not(
    limit: str, copies: int, scale: float, far: float
) -> None:
    """In one leaf; with copies of each point in a leaf of their own; and in a node of several, whose box decides."""
    rng = np.random.default_rng(7)
    channel = 3 * ("reach", "color", "chord").index(limit.partition("_")[0])
    strict = np.inf if limit.endswith("low") else 0.0
    for _ in range(25):
        pair = scale * rng.normal(size=(2, 9)) + far * (np.arange(9) < 3)
        dx, dy, dz = pair[1, channel : channel + 3] - pair[0, channel : channel + 3]
        square = float(dx * dx + dy * dy + dz * dz)
        channels = np.repeat(pair, copies, axis=0)
        for at, together in ((square, True), (float(np.nextafter(square, strict)), False)):
            limits = LOOSE._replace(**{limit: at})
            roots = filtration(channels, limits, 1e150).root
            assert bool(roots[0] == roots[-1]) is together


def test_pairs_whose_boxes_single_precision_pulls_apart_are_edges_too() -> None:
    """Of very many pairs those whose squared gap is rounded up most; of each point there is a node with a box."""
    ends = np.random.default_rng(7).normal(size=(2, 200_000, 3))
    low, high = ((ends + side * 1.2e-7 * np.abs(ends)).astype(np.float32) for side in (-1.0, 1.0))
    gaps = np.maximum(low[1] - high[0], low[0] - high[1])
    dx, dy, dz = (ends[1] - ends[0]).T
    squares = dx * dx + dy * dy + dz * dz
    hardest = np.argsort((gaps * gaps).sum(axis=1, dtype=np.float32) / squares)[-100:]
    for pair in hardest:
        channels = np.zeros((64, 9))
        channels[:, :3] = np.repeat(ends[:, pair], 32, axis=0)
        roots = filtration(channels, LOOSE._replace(reach=float(squares[pair])), 1e15).root
        assert roots[0] == roots[-1]


@kernel
def nearest_to_leaf(tree, blocks, groups, channels, leaf, within, near):  # type: ignore[no-untyped-def]
    near.within[:] = within
    visited = nearest_of_leaf(tree, blocks, groups, channels, leaf, near)
    return visited, np.array([found_near(near, i) for i in range(len(near.within))])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("wanted", [2, 8, 12])
@pytest.mark.parametrize("reach", [0.5 * STEP, 2.0 * STEP, np.inf])
def test_the_nearest_of_equal_distances_is_the_first_in_the_order_of_the_channels(
    seed: int, wanted: int, reach: float
) -> None:
    rng = np.random.default_rng(seed)
    n = 500
    channels = np.zeros((n, 9))
    channels[:, :3] = rng.integers(0, 9, (n, 3)) * STEP
    channels[:, 3:] = rng.integers(0, 2, (n, 6))
    group = rng.integers(0, 9 if seed % 2 else n, n)
    tree, near = position_tree(channels[:, :3]), room_for_near(wanted)
    blocks, groups = leaf_blocks(tree, channels[:, :3]), np.zeros(n + LEAF, np.int32)
    groups[:n] = group[tree.order]
    leaves = np.flatnonzero(tree.right == 0)
    for leaf in leaves[:: max(1, len(leaves) // 20)]:
        visited, count = nearest_to_leaf(tree, blocks, groups, channels, leaf, reach**2, near)
        # Where points are equally far they are gone through twice.
        assert 1 <= visited <= 2 * len(leaves)
        assert visited < len(leaves) or reach > STEP, "boxes out of reach are not visited"
        rows = near.d2.reshape(LEAF, -1)[:, LEAF:], near.point.reshape(LEAF, -1)[:, LEAF:]
        for i, point in enumerate(tree.order[tree.start[leaf] : tree.stop[leaf]]):
            d2 = sum((channels[:, c] - channels[point, c]) ** 2 for c in range(3))
            others = np.flatnonzero((d2 <= reach**2) & (group != group[point]))
            expected = sorted((d2[j], channels[j].tolist()) for j in others)[:wanted]
            found = [(rows[0][i, k], channels[rows[1][i, k]].tolist()) for k in range(count[i])]
            assert found == expected
