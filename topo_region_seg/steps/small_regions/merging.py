# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Small regions united with others, the smallest first."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import borrowed, kernel
from topo_region_seg.compiled.kd_tree import Tree
from topo_region_seg.compiled.nearest import room_for_near
from topo_region_seg.compiled.partition import uniform_regions
from topo_region_seg.compiled.predicate import Criterion
from topo_region_seg.compiled.union_find import find
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.steps.small_regions.candidates import (
    NearLists,
    listed_outside,
    most_alike,
    nearest_outside,
    region_boxes,
)


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
        The points near the representatives of small regions.
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
    tree, blocks, channels, region = borrowed(tree), borrowed(blocks), borrowed(channels), borrowed(region)
    n_regions = len(size)
    parent, uniform = np.arange(n_regions), uniform_regions(tree, region)
    size, representative, rank = size.copy(), representative.copy(), rank.copy()
    boxes, near = region_boxes(channels, region, n_regions), room_for_near(n_candidates)
    # Stacks of regions by size. An entry is stale once its region was absorbed or has grown.
    head = np.full(min_size, -1)
    entry = np.empty(2 * n_regions, np.int64)
    below = np.empty(2 * n_regions, np.int64)
    used, visited = 0, 0
    for r in range(n_regions):
        if size[r] < min_size:
            entry[used], below[used], head[size[r]] = r, head[size[r]], used
            used += 1
    for current in range(1, min_size):
        if head[current] < 0:
            continue
        members = current_members(head[current], entry, below, parent, size, current)
        for r in members[np.argsort(rank[members])]:
            if parent[r] != r or size[r] != current:
                continue
            point = representative[r]
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
                representative[r], rank[r] = representative[other], rank[other]
            for c in range(3):
                boxes[r, 0, c] = min(boxes[r, 0, c], boxes[other, 0, c])
                boxes[r, 1, c] = max(boxes[r, 1, c], boxes[other, 1, c])
            parent[other] = r
            size[r] += size[other]
            if size[r] < min_size:
                entry[used], below[used], head[size[r]] = r, head[size[r]], used
                used += 1
    target = np.empty(n_regions, np.int64)
    for r in range(n_regions):
        target[r] = find(parent, r)
    return target, visited


@kernel
def current_members(top, entry, below, parent, size, current):  # type: ignore[no-untyped-def]
    """Return the regions on a stack that still are regions of size `current`."""
    count = 0
    item = top
    while item >= 0:
        count += 1
        item = below[item]
    members = np.empty(count, np.int64)
    count = 0
    item = top
    while item >= 0:
        r = entry[item]
        if parent[r] == r and size[r] == current:
            members[count] = r
            count += 1
        item = below[item]
    return members[:count]
