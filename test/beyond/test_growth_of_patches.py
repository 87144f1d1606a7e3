# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which patch a point goes to: the most alike that reaches it, and of two alike the one of the smaller number."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from topo_region_seg.beyond.supervoxels.growth import FREE, LANES, Patches, grow_patches

NONE = np.empty(0, np.int32)


def line(places: list[float], values: list[float], joined: list[tuple[int, int]]) -> Patches:
    """Points on a line (m), each with one trait, with edges between some."""
    n = len(places)
    near = np.full((n, 4), n, np.int32)
    for a, b in joined:
        for p, q in ((a, b), (b, a)):
            near[p, np.flatnonzero(near[p] == n)[0]] = q
    traits = np.zeros((n, LANES), np.float32)
    traits[:, 4] = values
    return Patches(
        xyz=np.column_stack([places, np.zeros(n), np.zeros(n)]),
        traits=traits,
        near=near,
        alike=near < n,
        patch=np.full(n, FREE, np.int32),
        sums=np.zeros((n, LANES)),
        mean=np.zeros((n, LANES), np.float32),
        cost=np.full(n, np.inf, np.float32),
        best_patch=np.empty(n, np.int32),
        before=np.empty(n, np.int32),
        after=np.empty(n, np.int32),
    )


def grown(patches: Patches, seeds: tuple[int, ...], bound: float = 9.0, reseed: bool = False) -> list[int]:
    points = np.arange(len(patches.xyz), dtype=np.int32)
    grow_patches(patches, points, np.array(seeds, np.int32), True, reseed, bound, 1.0)
    return patches.patch.tolist()


@pytest.mark.parametrize("middle", range(3))
@pytest.mark.parametrize("first", [False, True])
def test_of_two_patches_as_much_alike_the_smaller_number_has_the_point(middle: int, first: bool) -> None:
    ends = tuple(point for point in range(3) if point != middle)
    places = [0.0, 0.0, 0.0]
    places[ends[0]], places[ends[1]] = -1.0, 1.0
    patches = line(places, places, [(ends[0], middle), (middle, ends[1])])
    assert grown(patches, ends if first else ends[::-1])[middle] == min(ends)


@pytest.mark.parametrize("order", permutations([0, 2, 4]))
def test_a_point_goes_to_the_patch_that_it_is_most_like(order: tuple[int, ...]) -> None:
    """Point 1 is like 2, point 3 is like 4; each can be reached from both sides."""
    joined = [(0, 1), (1, 2), (2, 3), (3, 4)]
    assert grown(line([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 9.0, 10.0, 29.0, 30.0], joined), order) == [0, 2, 2, 4, 4]


@pytest.mark.parametrize(("bound", "wanted"), [(2.0, [0, 0, 0, FREE]), (1.99, [0, 0, FREE, FREE]), (3.0, [0, 0, 0, 0])])
def test_no_point_is_farther_from_its_seed_than_the_bound(bound: float, wanted: list[int]) -> None:
    places = [0.0, 1.0, 2.0, 3.0]
    assert grown(line(places, [0.0] * 4, [(0, 1), (1, 2), (2, 3)]), (0,), bound) == wanted


def test_what_none_reaches_begins_one_of_its_own() -> None:
    places = [0.0, 1.0, 2.0, 3.0, 4.0]
    patches = line(places, [0.0] * 5, [(0, 1), (1, 2), (2, 3)])
    assert grown(patches, (0,), 1.0, reseed=True) == [0, 0, 2, 2, 4]


def test_the_mean_is_that_of_the_points_and_its_normal_has_unit_length() -> None:
    patches = line([0.0, 1.0, 2.0], [1.0, 2.0, 6.0], [(0, 1), (1, 2)])
    patches.traits[:, 8:11] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [np.nan] * 3]
    assert grown(patches, (0,)) == [0, 0, 0]
    np.testing.assert_allclose(patches.mean[0, 4], 3.0, rtol=1e-6)
    np.testing.assert_allclose(patches.mean[0, 8:11], [np.sqrt(0.5), np.sqrt(0.5), 0.0], rtol=1e-6)
