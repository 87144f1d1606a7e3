# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which region goes on with which one: how far it may have gone, and the rule against plain Python."""

from __future__ import annotations

import numpy as np
import pytest

from topo_region_seg.beyond.tracking.matching import matched
from topo_region_seg.beyond.tracking.merges import joined_regions, parted
from topo_region_seg.beyond.tracking.steady_borders import regions_at_rest, with_steady_borders
from topo_region_seg.beyond.tracking.tracks import Tracks
from topo_region_seg.data import RegionTable

Looks = tuple[list[float], list[float]]  # center (m), mean color


def table_of(looks: list[Looks]) -> RegionTable:
    n = len(looks)
    center, lab = (np.array(column, np.float64) for column in zip(*looks, strict=True))
    label = np.arange(1, n + 1, dtype=np.uint32)
    return RegionTable(
        label=label,
        size=np.full(n, 1000),
        centroid=center,
        minimum=center,
        maximum=center,
        mean_lab=lab,
        mean_normal=np.full((n, 3), np.nan),
        persistence=np.zeros(n),
        confidence=np.full(n, np.nan),
    )


def tracks_of(looks: list[Looks]) -> Tracks:
    table = table_of(looks)
    return Tracks.none().seen(table, table.label, np.full(len(looks), -1))


def points(*shares: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Rows of points in both tables, from (row now, row before, how many)."""
    now, before, count = zip(*shares, strict=True)
    return np.repeat(now, count), np.repeat(before, count)


APART = points((1, 0, 50), (0, 1, 50))
HERE, GRAY = [0.0, 0.0, 1.0], [50.0, 0.0, 0.0]
WITHIN = [([0.099, 0, 1], GRAY), (HERE, [50, 19.8, 0]), (HERE, [69.8, 0, 0]), ([0.06, 0, 1], [50, 0, 12])]
BEYOND = [([0.101, 0, 1], GRAY), (HERE, [50, 20.2, 0]), (HERE, [29.8, 0, 0]), ([0.08, 0, 1], [50, 0, 16])]


@pytest.mark.parametrize(
    ("looks", "known"), [*((looks, True) for looks in WITHIN), *((looks, False) for looks in BEYOND)]
)
def test_what_overlaps_nothing_goes_on_with_what_is_near_and_alike(looks: Looks, known: bool) -> None:
    """Place and color together: one tenth of a meter or 20 dE is too far, and so is their sum."""
    assert matched(table_of([looks]), tracks_of([(HERE, GRAY)]), *APART).tolist() == [0 if known else -1]


@pytest.mark.parametrize(("common", "known"), [(10, True), (9, False)])
def test_a_tenth_in_common_is_an_overlap_whatever_they_look_like(common: int, known: bool) -> None:
    """Of 100 points that the first ones have together; the rest of each is a small part of something large."""
    shares = points((1, 1, common), (1, 2, 40), (3, 2, 1000), (2, 1, 60 - common), (2, 3, 1000))
    far: list[Looks] = [([x, 0.0, 1.0], [x, 0.0, 0.0]) for x in (9.0, 30.0, 60.0)]
    found = matched(table_of([(HERE, GRAY), *far[1:]]), tracks_of(far), *shares)
    assert found.tolist() == [0 if known else -1, 2, 1]


@pytest.mark.parametrize("seed", range(60))
def test_matching_is_by_overlap_then_by_the_highest_sum_of_overlap_and_likeness(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, 5, 2)
    wide = (0.4, 1.0)[seed % 2]  # closer together, several go on with the same ones

    def looks(count: int) -> list[Looks]:
        return [
            (
                (rng.normal(size=3) * 0.04 * wide).tolist(),
                (50 + 6 * wide * rng.normal(size=3)).tolist(),
            )
            for _ in range(count)
        ]

    here, there = looks(n), looks(m)
    now, before = rng.integers(0, n + 1, 300), rng.integers(0, m + 1, 300)
    alike = rng.random(300) < rng.choice([0.0, 0.4, 0.8])
    before[alike] = np.minimum(now[alike], m)
    score, overlap = {}, {}
    for i, j in np.ndindex(int(n), int(m)):
        known = (now == i + 1) & (before > 0)  # where nothing was known, nothing counts
        old = (before == j + 1) & (now > 0)
        union = np.count_nonzero(known | (before == j + 1))
        share = float(np.count_nonzero(known & old) / union) if union else 0.0
        overlap[i, j] = share if share >= 0.1 else 0.0
        (p, c), (q, d) = here[i], there[j]
        far = np.linalg.norm([*(np.subtract(p, q) / 0.1), *(np.subtract(c, d) / 20.0)])
        if far < 1.0 or overlap[i, j]:
            score[i, j] = max(0.0, 1.0 - far) + overlap[i, j]
    wanted = np.full(n, -1)
    for (i, j), share in overlap.items():
        if share > 0.5:
            wanted[i] = j
    for i, j in sorted(score, key=lambda pair: -score[pair]):
        if wanted[i] < 0 and j not in wanted:
            wanted[i] = j
    assert matched(table_of(here), tracks_of(there), now, before).tolist() == wanted.tolist()


def test_a_region_goes_on_with_one_of_the_four_that_are_nearest() -> None:
    there: list[Looks] = [([0.01 * place, 0.0, 1.0], GRAY) for place in range(5)]
    last: Looks = ([-0.03, 0.0, 1.0], GRAY)
    apart = points((1, 0, 50), (0, 1, 50))
    assert matched(table_of([*there[:3], last]), tracks_of(there), *apart).tolist() == [0, 1, 2, 3]
    assert matched(table_of([*there[:4], last]), tracks_of(there), *apart).tolist() == [0, 1, 2, 3, -1]


@pytest.mark.parametrize(("common", "joined"), [(50, True), (49, False)])
def test_a_region_has_become_part_of_another_one_when_half_of_it_has(common: int, joined: bool) -> None:
    now, before = points((1, 1, 90), (1, 2, common), (0, 2, 100 - common), (2, 3, 40))
    assert joined_regions(now, before) == ({1: (1, 2)} if joined else {})


@pytest.mark.parametrize(("size", "joined"), [(10, True), (9, False)])
def test_parts_of_fewer_than_ten_points_are_not_looked_at(size: int, joined: bool) -> None:
    now, before = points((1, 2, size), (1, 1, 90))
    assert joined_regions(now, before) == ({1: (1, 2)} if joined else {})


def test_parts_are_named_from_the_largest_down_and_of_equal_ones_the_first() -> None:
    now, before = points((2, 1, 20), (2, 2, 30), (2, 3, 20), (1, 4, 50))
    assert joined_regions(now, before) == {2: (2, 1, 3)}


def test_what_was_in_no_part_goes_with_the_nearest_that_was() -> None:
    x = np.array([0.0, 1, 2, 3, 4, 5, 6, 7, 20])
    xyz = np.column_stack([x, 0 * x, 0 * x])
    now, before = np.array([1, 1, 1, 1, 1, 1, 1, 1, 2]), np.array([5, 5, 0, 0, 0, 0, 7, 7, 9])
    assert parted(xyz, now, before, {1: (7, 5)}).tolist() == [2, 2, 2, 2, 0, 0, 0, 0, 1]
    assert parted(xyz, now, before, {}).tolist() == [0] * 8 + [1]
    now[0] = 0
    assert parted(xyz, now, before, {1: (7, 5)})[0] == -1


@pytest.mark.parametrize(("way", "rests"), [(0.0049, True), (0.0051, False)])
def test_a_region_rests_while_its_center_goes_less_than_five_millimeters(way: float, rests: bool) -> None:
    xyz = np.random.default_rng(0).normal(size=(40, 3))
    center = np.vstack([np.full(3, np.nan), xyz.mean(axis=0) + [0.0, way, 0.0]])
    found = regions_at_rest(np.zeros(40, np.int64), np.ones(40, np.int64), xyz, center)
    assert found.tolist() == [1 if rests else 0]


def test_a_region_that_has_only_part_of_another_does_not_go_on_with_it() -> None:
    """Each must have most of the other: of two that share one, the larger part goes on with it."""
    region, before = np.repeat([0, 1], [30, 10]), np.ones(40, np.int64)
    xyz = np.zeros((40, 3))
    center = np.vstack([np.full(3, np.nan), np.zeros(3)])
    assert regions_at_rest(region, before, xyz, center).tolist() == [1, 0]


def test_points_stay_while_both_regions_rest_and_they_are_held() -> None:
    region, before = np.array([0, 0, 1, 1, -1, 1]), np.array([1, 1, 1, 2, 1, 0])
    held, free = np.ones(6, bool), np.zeros(6, bool)
    both, first, second = np.array([1, 2]), np.array([1, 0]), np.array([0, 2])
    assert with_steady_borders(region, before, both, held).tolist() == [0, 0, 0, 1, -1, 1]
    for former, hold in ((both, free), (first, held), (second, held)):
        assert with_steady_borders(region, before, former, hold).tolist() == region.tolist()


def test_nothing_rests_where_there_are_no_regions() -> None:
    none, xyz = np.full(4, -1), np.zeros((4, 3))
    assert regions_at_rest(none, np.ones(4, np.int64), xyz, np.zeros((2, 3))).tolist() == []
    assert with_steady_borders(none, np.ones(4, np.int64), np.zeros(0, np.int64), np.ones(4, bool)).tolist() == [-1] * 4
