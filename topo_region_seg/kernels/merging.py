# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Uniting small regions with the neighbor that suits them best."""

from __future__ import annotations

import numpy as np

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.kernels.borrow import borrowed
from topo_region_seg.kernels.compile import index, kernel
from topo_region_seg.kernels.leaf_pairs import Criterion
from topo_region_seg.kernels.nearest import comes_before, nearest_outside
from topo_region_seg.kernels.tree import Tree
from topo_region_seg.kernels.union_find import find


@kernel
def count_off(root: IntArray, weight: IntArray) -> tuple[IntArray, IntArray]:
    """Return the region (N,) of every point, counted from 0 in the order of appearance, and their weights (R,).

    `root` (N,) is the same number below N for the points of a region.
    """
    number = np.full(len(root), -1)
    region = np.empty(len(root), np.int64)
    size = np.zeros(len(root), np.int64)
    count = 0
    for i in range(len(root)):
        r = index(root[i])
        if number[r] < 0:
            number[r] = count
            count += 1
        region[i] = number[r]
        size[index(number[r])] += weight[i]
    return region, size[:count].copy()


@kernel
def first_points(channels: FloatArray, region: IntArray, n_regions: int) -> IntArray:
    """Return for each region the point that comes first in the order of its channels (x, y, z, then features).

    Points whose region is below 0 are in none.
    """
    channels, region = borrowed(channels), borrowed(region)
    first = np.full(n_regions, -1)
    for point in range(len(region)):
        if region[point] < 0:
            continue
        r = index(region[point])
        if first[r] < 0 or comes_before(channels, point, first[r]):
            first[r] = point
    return first


@kernel
def region_sizes(region: IntArray, weight: IntArray, n_regions: int) -> IntArray:
    """Return the sum of the weights of each region's points, (R,)."""
    region, weight = borrowed(region), borrowed(weight)
    size = np.zeros(n_regions, np.int64)
    for point in range(len(region)):
        if region[point] >= 0:
            size[index(region[point])] += weight[point]
    return size


@kernel
def merge_small_regions(
    tree: Tree,
    channels: FloatArray,
    region: IntArray,
    size: IntArray,
    representative: IntArray,
    rank: IntArray,
    limits: Criterion,
    min_size: int,
    n_nearest: int,
) -> IntArray:
    """Unite regions below `min_size`, smallest first, and return the region (R,) that each one ends in.

    `tree` is over positions, `channels` (N, 9) as in the filtration; `region` (N,) is the region of a point;
    `size`, `representative` (a point) and `rank` (order of the representatives) are (R,). Among the
    `n_nearest` points of other regions nearest to the representative, the one with the smallest normalized
    difference of color and normal is chosen.
    """
    tree, channels, region = borrowed(tree), borrowed(channels), borrowed(region)
    n_regions = len(size)
    parent = np.arange(n_regions)
    size, representative, rank = size.copy(), representative.copy(), rank.copy()
    uniform = uniform_regions(tree, region)
    near_d2 = np.empty(n_nearest)
    near = np.empty(n_nearest, np.int64)
    # Stacks of regions by size. An entry is stale once its region was absorbed or has grown.
    head = np.full(min_size, -1)
    entry = np.empty(2 * n_regions, np.int64)
    below = np.empty(2 * n_regions, np.int64)
    used = 0
    for r in range(n_regions):
        if size[r] < min_size:
            entry[used], below[used], head[size[r]] = r, head[size[r]], used
            used += 1
    for current in range(1, min_size):
        members = current_members(head[current], entry, below, parent, size, current)
        for r in members[np.argsort(rank[members])]:
            if parent[r] != r or size[r] != current:
                continue
            found = nearest_outside(tree, channels, region, parent, uniform, representative[r], r, near_d2, near)
            if found == 0:
                continue
            other = find(parent, region[most_alike(channels, representative[r], near[:found], limits)])
            if rank[other] < rank[r]:
                representative[r], rank[r] = representative[other], rank[other]
            parent[other] = r
            size[r] += size[other]
            if size[r] < min_size:
                entry[used], below[used], head[size[r]] = r, head[size[r]], used
                used += 1
    target = np.empty(n_regions, np.int64)
    for r in range(n_regions):
        target[r] = find(parent, r)
    return target


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


@kernel
def uniform_regions(tree: Tree, region: IntArray) -> IntArray:
    """Return for each node the region that all its points belong to, or -1."""
    uniform = np.full(len(tree.start), -1)
    for node in range(len(uniform) - 1, -1, -1):
        right = tree.right[node]
        if right:
            if uniform[node + 1] == uniform[right]:
                uniform[node] = uniform[right]
            continue
        only = region[index(tree.order[index(tree.start[node])])]
        for row in range(tree.start[node] + 1, tree.stop[node]):
            if region[index(tree.order[index(row)])] != only:
                only = -1
                break
        uniform[node] = only
    return uniform


@kernel
def most_alike(channels, point, candidates, limits):  # type: ignore[no-untyped-def]
    """Return the candidate with the smallest sum of squared differences in units of the limits; ties: the nearest."""
    best, choice = np.inf, candidates[0]
    for other in candidates:
        color, chord = 0.0, 0.0
        for c in range(3):
            color += (channels[other, 3 + c] - channels[point, 3 + c]) ** 2
            chord += (channels[other, 6 + c] - channels[point, 6 + c]) ** 2
        difference = color / max(limits.color_high, 1e-12)
        if chord == chord:  # a point without a normal is judged by color alone
            difference += chord / max(min(limits.chord_high, 4.0), 1e-12)
        if difference < best:
            best, choice = difference, other
    return choice
