# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Small regions united with others, the smallest first."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.dialect import borrowed, index, inlined, kernel
from topo_region_seg.compiled.kd_tree import Tree
from topo_region_seg.compiled.near_lists import NearLists
from topo_region_seg.compiled.nearest import Near, room_for_near
from topo_region_seg.compiled.order import order_of
from topo_region_seg.compiled.partition import uniform_regions
from topo_region_seg.compiled.predicate import Criterion
from topo_region_seg.compiled.union_find import find
from topo_region_seg.data import FloatArray, IndexArray, IntArray
from topo_region_seg.steps.small_regions.candidates import (
    listed_outside,
    most_alike,
    nearest_outside,
    region_boxes,
)

NONE = -1
MANY = 16
"""Share of the regions, one in so many, from which on regions of one size are put in order by place, not by sorting."""


class Small(NamedTuple):
    """Regions while they grow, R of them, and stacks of the small ones by size.

    An entry of a stack is stale once its region was absorbed or has grown.
    """

    parent: IndexArray  # (R,) union-find
    size: IntArray  # (R,) the following are valid at its roots
    representative: IntArray  # (R,)
    rank: IntArray  # (R,) place of the representative in the order of all such
    boxes: FloatArray  # (R, 2, 3) as `region_boxes` returns them
    head: IntArray  # (min_size,) the upmost entry of the regions of a size; NONE = empty
    entry: IntArray  # (2 R,) the region of an entry
    below: IntArray  # (2 R,) the entry below it
    placed: IntArray  # (R,) room for regions by rank, NONE in all cells


@kernel
def merge_small_regions(
    tree: Tree,
    blocks: FloatArray,
    channels: FloatArray,
    region: IntArray,
    size: IntArray,
    representative: IntArray,
    rank: IntArray,
    lists: NearLists,
    limits: Criterion,
    min_size: int,
    n_candidates: int,
    reach: float,
) -> tuple[IntArray, int]:
    """Unite regions below `min_size`, smallest first.

    Among the `n_candidates` points of other regions nearest to the representative of a region, up to `reach` from the
    region's box, the one with the smallest normalized difference of color and normal is chosen.

    Parameters
    ----------
    tree : Tree
        Over the positions.
    blocks : (L, 3, LEAF) float64
        Positions, as `leaf_blocks` returns them.
    channels : (N, 9) float64
        As in the filtration.
    region : (N,) int64
        The region of each point.
    size, representative, rank : (R,) int64
        Of each region its size, a point, and the place of this point in the order of all such.
    lists : NearLists
        The points near the representatives of small regions, up to `reach` at least.
    limits : Criterion
        In whose units differences are compared.
    min_size, n_candidates : int
        See above.
    reach : float
        Metres.

    Returns
    -------
    target : (R,) int64
        The region that each one ends in.
    visited : int
        How many leaves of the tree were visited where the lists were too short.
    """
    n = len(size)
    small = Small(
        np.arange(n).astype(np.int32),
        size.copy(),
        representative.copy(),
        rank.copy(),
        region_boxes(channels, region, n),
        np.full(min_size, NONE),
        np.empty(2 * n, np.int64),
        np.empty(2 * n, np.int64),
        np.full(n, NONE),
    )
    uniform, near = uniform_regions(tree, region), room_for_near(n_candidates)
    narrow = region.astype(np.int32)
    visited = unite_smallest_first(tree, blocks, channels, narrow, uniform, lists, limits, reach, small, near)
    target = np.empty(n, np.int64)
    for r in range(n):
        target[r] = find(small.parent, r)
    return target, visited


@kernel
def unite_smallest_first(
    tree: Tree,
    blocks: FloatArray,
    channels: FloatArray,
    region: IndexArray,
    uniform: IntArray,
    lists: NearLists,
    limits: Criterion,
    reach: float,
    small: Small,
    near: Near,
) -> int:
    """Unite all small regions that can be; return how many leaves of the tree were visited."""
    tree, blocks, channels, region = borrowed(tree), borrowed(blocks), borrowed(channels), borrowed(region)
    uniform, lists, small, near = borrowed(uniform), borrowed(lists), borrowed(small), borrowed(near)
    parent, size, rank, boxes = small.parent, small.size, small.rank, small.boxes
    used, visited, min_size = 0, 0, len(small.head)
    for r in range(len(size)):
        if size[r] < min_size:
            stack_up(small, r, used)
            used += 1
    for current in range(1, min_size):
        for r in members_in_order(small, current):
            if parent[r] != r or size[r] != current:
                continue
            point = small.representative[r]
            found, all_found = listed_outside(lists, channels, region, parent, boxes, reach, point, r, near)
            if not all_found:
                found, leaves = nearest_outside(
                    tree, blocks, channels, region, parent, uniform, boxes, reach, point, r, near
                )
                visited += leaves
            if found == 0:
                continue
            other = find(parent, region[most_alike(channels, point, near, found, limits)])
            if rank[other] < rank[r]:
                small.representative[r], rank[r] = small.representative[other], rank[other]
            for c in range(3):
                boxes[r, 0, c] = min(boxes[r, 0, c], boxes[other, 0, c])
                boxes[r, 1, c] = max(boxes[r, 1, c], boxes[other, 1, c])
            parent[other] = r
            size[r] += size[other]
            if size[r] < min_size:
                stack_up(small, r, used)
                used += 1
    return visited


@inlined
def stack_up(small, r, item):  # type: ignore[no-untyped-def]
    """Put a region on the stack of its size, as a new entry."""
    top = index(small.size[r])
    small.entry[index(item)], small.below[index(item)], small.head[top] = r, small.head[top], item


@kernel
def members_in_order(small: Small, current: int) -> IntArray:
    """Return the regions on a stack that still are regions of size `current`, in the order of their ranks."""
    small = borrowed(small)
    count, item = 0, small.head[current]
    while item >= 0:
        count += 1
        item = small.below[index(item)]
    members, ranks = np.empty(count, np.int64), np.empty(count)
    count, item = 0, small.head[current]
    while item >= 0:
        r = small.entry[index(item)]
        if small.parent[index(r)] == r and small.size[index(r)] == current:
            members[count], ranks[count] = r, small.rank[index(r)]
            count += 1
        item = small.below[index(item)]
    members, ranks = members[:count], ranks[:count]
    if count * MANY < len(small.placed):
        return members[order_of(ranks)]
    for i in range(count):
        small.placed[index(np.int64(ranks[i]))] = members[i]
    count = 0
    for place in range(len(small.placed)):
        if small.placed[index(place)] >= 0:
            members[count], small.placed[index(place)] = small.placed[index(place)], NONE
            count += 1
    return members
