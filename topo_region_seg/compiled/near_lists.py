# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The nearest points of some points, kept as lists: where points are sparse, two steps look for them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.compiled.nearest import found_near, near_point
from topo_region_seg.data import IndexArray, IntArray

NOBODY = -1


class NearLists(NamedTuple):
    """The points nearest to each of some points, k at most, up to `reach` (m) away."""

    row: IndexArray  # (N,) row in `near` of each point that has one; NOBODY for all others
    near: IndexArray  # (L, k) the nearest first; NOBODY where there are fewer
    reach: float


def empty_lists(n_points: int, size: int, reach: float) -> NearLists:
    """Return lists of which no point has one yet; memory is taken as they are filled."""
    return NearLists(np.full(n_points, NOBODY, np.int32), np.empty((n_points, size), np.int32), reach)


def no_lists() -> NearLists:
    """Return what stands for lists that nobody wants."""
    return empty_lists(0, 0, 0.0)


@inlined
def keep_list(lists, point, near, i):  # type: ignore[no-untyped-def]
    """Keep what is near the i-th as the list of `point`."""
    found = found_near(near, i)
    row = index(lists.row[index(point)])
    for place in range(lists.near.shape[1]):
        lists.near[row, index(place)] = near_point(near, i, place) if place < found else NOBODY


@kernel
def take_lists(
    given: NearLists, points: IntArray, usable: npt.NDArray[np.bool_], wanted: npt.NDArray[np.bool_], lists: NearLists
) -> None:
    """Copy the lists of `points` (S,) where those `given` are `usable` (S,); mark in `wanted` (N,) those of the others.

    They become the first S of `lists`.
    """
    for i in range(len(points)):
        point = points[i]
        row = given.row[point]
        if row < 0 or not usable[i]:
            wanted[point] = True
            continue
        for place in range(given.near.shape[1]):
            lists.near[i, place] = given.near[row, place]
