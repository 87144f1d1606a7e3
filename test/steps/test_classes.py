# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Birth, death and persistence of regions, against the components of every scale."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import homogeneous_edges, partition, random_points

import topo_region_seg as trs
from topo_region_seg.data import Cloud, Components
from topo_region_seg.steps.scales.classes import bars_of_regions, classes_of

RADIUS = 0.03
Bar = tuple[float, float]


def bars_by_hand(n: int, lengths: npt.NDArray, pairs: npt.NDArray, size: int, last: float) -> dict[int, Bar]:
    """Return the bar of each point's class at the scale `last`, from the components of every scale, one by one."""
    scales = np.unique(lengths)
    living: dict[frozenset[int], float] = {}  # the points of a class, and its birth
    bars: dict[int, Bar] = {}
    at_last: dict[frozenset[int], float] | None = None
    for scale in [0.0, *scales]:
        if scale > last and at_last is None:
            at_last = dict(living)
        root = partition(n, pairs[lengths <= scale])
        now: dict[frozenset[int], float] = {}
        for one in np.unique(root):
            members = frozenset(np.flatnonzero(root == one).tolist())
            if len(members) < size:
                continue
            before = sorted((birth, -len(points), points) for points, birth in living.items() if points <= members)
            now[members] = before[0][0] if before else float(scale)
            for _, _, points in before[1:]:
                for then in at_last or {}:
                    # What was a class of its own at the last scale, and still is the same class, dies here.
                    if at_last is not None and at_last[then] == living[points] and then <= points:
                        bars.setdefault(min(then), (at_last[then], float(scale)))
        living = now
    at_last = living if at_last is None else at_last
    for then, birth in at_last.items():
        bars.setdefault(min(then), (birth, math.inf))
    return {point: bars[min(then)] for then in at_last for point in then}


def grown(seed: int, n: int) -> tuple[Components, npt.NDArray, npt.NDArray]:
    points, params = random_points(seed, n), trs.Params(max_radius=RADIUS)
    pairs, lengths = homogeneous_edges(points, params)
    inside = lengths <= RADIUS
    return trs.persistent_components(points.xyz, points.lab, points.normals, params), pairs[inside], lengths[inside]


@given(st.integers(0, 2**32 - 1), st.integers(1, 70), st.integers(1, 9), st.floats(0.1, 1.0))
@settings(max_examples=60, deadline=None)
def test_bars_are_those_of_the_components_of_every_scale(seed: int, n: int, size: int, part: float) -> None:
    components, pairs, lengths = grown(seed, n)
    if len(np.unique(lengths)) < len(lengths):
        return  # equal births may be told apart either way
    scale = part * RADIUS
    classes = classes_of(components, np.ones(n, np.int64), size)
    assert (classes.death > classes.birth).all()
    root = components.cut(scale).root
    label = (np.unique(root, return_inverse=True)[1] + 1).astype(np.uint32)
    of = np.unique(label)
    birth, death = bars_of_regions(classes, scale, label, of)
    wanted = bars_by_hand(n, lengths, pairs, size, scale)
    for row, one in enumerate(of):
        first = int(np.flatnonzero(label == one)[0])
        expected = wanted.get(first, (scale, scale))
        if size == 1 and expected[0] == 0.0:
            assert birth[row] == 0.0  # all are born at 0, and which of two dies is a matter of their sizes
        else:
            assert (birth[row], death[row]) == expected


def test_a_small_case_by_hand() -> None:
    """Two heaps of 3 and 2 points that meet at 5, joined by a single point at 7; regions need 2 points."""
    parent, death = np.array([0, 0, 0, 0, 3, 0]), np.array([np.inf, 1.0, 2.0, 5.0, 3.0, 7.0])
    components = Components(np.zeros(6, int), parent, death, 9.0)
    classes = classes_of(components, np.ones(6, int), 2)
    assert sorted(zip(classes.birth, classes.death, strict=True)) == [(1.0, np.inf), (3.0, 5.0)]
    label = np.array([1, 1, 1, 2, 2, 3], np.uint32)
    birth, death_of = bars_of_regions(classes, 4.0, label, np.array([2, 1, 3], np.uint32))
    np.testing.assert_array_equal(birth, [3.0, 1.0, 4.0])
    np.testing.assert_array_equal(death_of, [5.0, np.inf, 4.0])
    heavy = classes_of(components, np.array([1, 1, 1, 4, 1, 1]), 2)
    assert sorted(zip(heavy.birth, heavy.death, strict=True)) == [(0.0, np.inf), (1.0, 5.0)], "the older one lives on"


def cloud(seed: int, n: int) -> Cloud:
    points = random_points(seed, n)
    rgb = (120 + 60 * np.random.default_rng(seed).integers(0, 2, (n, 1)) + np.zeros((1, 3))).astype(np.uint8)
    return Cloud(points.xyz + [0.0, 0.0, 0.8], rgb, 1, n)


PARAMS = trs.Params(
    max_radius=RADIUS, remove_floor=False, voxel_size=0.0, features="color", min_region_size=4, radius=0.02
)


@pytest.mark.parametrize("seed", range(4))
def test_persistence_grows_with_the_cloud_and_does_not_depend_on_the_order_of_the_points(seed: int) -> None:
    given, order = cloud(seed, 150), np.random.default_rng(seed).permutation(150)
    seg = trs.Pipeline(PARAMS).run(given)
    assert len(seg.regions) > 1 and (seg.regions.persistence > 0.0).any()
    other = trs.Pipeline(PARAMS).run(Cloud(given.xyz[order], given.rgb[order], 1, 150))
    np.testing.assert_array_equal(other.regions.persistence, seg.regions.persistence)
    wide = PARAMS.replace(max_radius=2 * RADIUS, radius=0.04)
    scaled = trs.Pipeline(wide).run(replace(given, xyz=2.0 * given.xyz))
    np.testing.assert_allclose(scaled.regions.persistence, 2.0 * seg.regions.persistence, rtol=1e-9)
    bars = seg.region_bars
    np.testing.assert_allclose(np.minimum(bars[:, 1], RADIUS) - bars[:, 0], seg.regions.persistence)


def test_a_region_made_of_small_ones_has_no_persistence() -> None:
    xyz = np.array([[0.0, 0.0, 1.0], [0.001, 0.0, 1.0]])
    rgb = np.array([[255, 0, 0], [0, 255, 0]], np.uint8)
    seg = trs.Pipeline(PARAMS.replace(min_region_size=2)).run(Cloud(xyz, rgb, 1, 2))
    assert len(seg.regions) == 1 and seg.regions.persistence.tolist() == [0.0]
