# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of regions below the minimum size (paper, section IV.E)."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.compiled.kd_tree import Tree
from topo_region_seg.compiled.nearest import nearest_outside
from topo_region_seg.compiled.partition import count_off, first_points, uniform_regions
from topo_region_seg.compiled.predicate import Criterion
from topo_region_seg.compiled.union_find import find
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.params import Params

CANDIDATES = 8  # points of other regions among which the most alike is chosen
NONE = -1


def settle_small_regions(
    channels: FloatArray, tree: Tree, root: IntArray, weight: IntArray, limits: Criterion, params: Params
) -> IntArray:
    """Merge or remove the regions that stand for fewer than `min_region_size` input points.

    Merging goes from the smallest region to the largest (ties: smallest coordinate triple). Around the
    region's representative, here the point with the smallest coordinate triple so that the order of the
    points does not matter, the nearest points of other regions are looked up; the region joins that of the
    point with the smallest normalized difference of color and normal. A region that has no other region to
    join stays.

    Parameters
    ----------
    channels : (N, 9) float64
        Positions (m), colors and normals, as `homogeneity_channels` returns them.
    tree : Tree
        Tree over the positions.
    root : (N,) int64
        Smallest point id of each point's component.
    weight : (N,) int64
        Number of input points that each point stands for.
    limits : Criterion
        The criterion, in whose units differences are compared.
    params : Params
        Uses `min_region_size` and `small_regions`.

    Returns
    -------
    (N,) int64
        Region of each point, counted from 0 in no particular order; -1 for removed points.
    """
    region, size = count_off(root, weight)
    small = size < params.min_region_size
    if not small.any():
        return region
    if params.small_regions == "remove":
        kept = np.where(small, NONE, np.cumsum(~small) - 1)
        return kept[region]
    representative = first_points(channels, region, len(size))
    target = merge_small_regions(
        tree,
        channels,
        region,
        size,
        representative,
        _ranks(channels[representative]),
        limits,
        params.min_region_size,
        CANDIDATES,
    )
    return count_off(target[region], weight)[0]


def _ranks(points: FloatArray) -> IntArray:
    """Return the place of each point (R, 9) in their order: by x, then y, z and the features."""
    order = np.argsort(points[:, 0])
    if (np.diff(points[order, 0]) == 0.0).any():
        order = np.lexsort(points[:, ::-1].T)
    rank = np.empty(len(points), np.int64)
    rank[order] = np.arange(len(points))
    return rank


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
    n_candidates: int,
) -> IntArray:
    """Unite regions below `min_size`, smallest first, and return the region (R,) that each one ends in.

    `tree` is over positions, `channels` (N, 9) as in the filtration; `region` (N,) is the region of a point;
    `size`, `representative` (a point) and `rank` (order of the representatives) are (R,). Among the
    `n_candidates` points of other regions nearest to the representative, the one with the smallest normalized
    difference of color and normal is chosen.
    """
    n_regions = len(size)
    parent = np.arange(n_regions)
    size, representative, rank = size.copy(), representative.copy(), rank.copy()
    uniform = uniform_regions(tree, region)
    near_d2 = np.empty(n_candidates)
    near = np.empty(n_candidates, np.int64)
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
