# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of regions below the minimum size (paper, section IV.E)."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.compiled.dialect import borrowed, index, inlined, kernel
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.leaf_blocks import leaf_blocks
from topo_region_seg.compiled.nearest import begin_near, insert_near, leaf_distances, room_for_near
from topo_region_seg.compiled.partition import count_off, first_points, uniform_regions
from topo_region_seg.compiled.predicate import Criterion
from topo_region_seg.compiled.union_find import find
from topo_region_seg.compiled.walks import next_leaf
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.params import Params

CANDIDATES = 8  # points of other regions among which the most alike is chosen
REACH = 3.0
"""Radii up to which such a point may lie from the box of a small region: farther away it is nothing that touches it."""
ABOVE = 1.0 + 1e-9  # by this factor rounding does not lengthen the bound of a search
NONE = -1


def settle_small_regions(
    channels: FloatArray, tree: Tree, root: IntArray, weight: IntArray, limits: Criterion, params: Params
) -> IntArray:
    """Merge or remove the regions that stand for fewer than `min_region_size` input points.

    Merging goes from the smallest region to the largest (ties: smallest coordinate triple). Around the
    region's representative, here the point with the smallest coordinate triple so that the order of the
    points does not matter, the nearest points of other regions are looked up, up to REACH radii from the region's
    bounding box; the region joins that of the point with the smallest normalized difference of color and normal.
    A region that ends below the minimum size, since nothing is near it, is removed.

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
        The criterion, in whose units differences are compared, and whose radius bounds the search.
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
    if params.small_regions == "merge":
        representative = first_points(channels, region, len(size))
        target = merge_small_regions(
            tree,
            leaf_blocks(tree, channels[:, :3]),
            channels,
            region,
            size,
            representative,
            _ranks(channels[representative]),
            limits,
            # No region can have more points than all have.
            min(params.min_region_size, int(size.sum()) + 1),
            CANDIDATES,
            REACH * math.sqrt(limits.reach),
        )
        region, size = count_off(target[region], weight)
        small = size < params.min_region_size
    kept = np.where(small, NONE, np.cumsum(~small) - 1)
    return kept[region]


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
    blocks: FloatArray,
    channels: FloatArray,
    region: IntArray,
    size: IntArray,
    representative: IntArray,
    rank: IntArray,
    limits: Criterion,
    min_size: int,
    n_candidates: int,
    reach: float,
) -> IntArray:
    """Unite regions below `min_size`, smallest first, and return the region (R,) that each one ends in.

    `tree` is over positions, which are in `blocks` too; `channels` (N, 9) as in the filtration; `region` (N,) is the
    region of a point; `size`, `representative` (a point) and `rank` (order of the representatives) are (R,). Among the
    `n_candidates` points of other regions nearest to the representative, up to `reach` from the region's box, the one
    with the smallest normalized difference of color and normal is chosen.
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
    used = 0
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
            found = nearest_outside(tree, blocks, channels, region, parent, uniform, boxes, reach, point, r, near)
            if found == 0:
                continue
            other = find(parent, region[most_alike(channels, point, near.point, found, limits)])
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
    return target


@kernel
def region_boxes(channels, region, n_regions):  # type: ignore[no-untyped-def]
    """Return the lower and upper bounds of the regions' positions, (R, 2, 3)."""
    boxes = np.empty((n_regions, 2, 3))
    boxes[:, 0] = np.inf
    boxes[:, 1] = -np.inf
    for point in range(len(region)):
        r = region[point]
        for c in range(3):
            boxes[r, 0, c] = min(boxes[r, 0, c], channels[point, c])
            boxes[r, 1, c] = max(boxes[r, 1, c], channels[point, c])
    return boxes


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


@inlined
def nearest_outside(  # type: ignore[no-untyped-def]
    tree, blocks, channels, region, parent, uniform, boxes, reach, point, own, near
):
    """Fill `near` with the points nearest to `point` that are up to `reach` from the box of its region, `own`.

    Points of the region itself are left out; return how many are found. `region` (N,) is the region of a point and
    `parent` the union-find of the regions; `uniform` (K,) is the region that all points of a node belong to, if any;
    `boxes` (R, 2, 3) are those of the regions.
    """
    begin_near(near, channels, point)
    # What is near the box is no farther from the point than the box's farthest corner and the reach together.
    corner2 = 0.0
    for c in range(3):
        place = channels[index(point), index(c)]
        corner2 += max(place - boxes[own, 0, c], boxes[own, 1, c] - place) ** 2
    top, found, farthest = 1, 0, ABOVE * (math.sqrt(corner2) + reach) ** 2
    while True:
        node, top = next_leaf(tree, near.box, 0, farthest, True, near.stack, top)
        if node < 0:
            break
        only = uniform[index(node)]
        if only >= 0 and find(parent, only) == own:
            continue
        start, stop = tree.start[index(node)], tree.stop[index(node)]
        leaf_distances(blocks, start // LEAF, channels, point, near.leaf_d2)
        for i in range(stop - start):
            d2 = near.leaf_d2[index(i)]
            if d2 <= farthest:
                other = tree.order[index(start + i)]
                if find(parent, region[index(other)]) != own and near_box(channels, other, boxes, own, reach):
                    found = insert_near(channels, other, d2, near, found)
                    if found == len(near.d2):
                        farthest = near.d2[index(found - 1)]
    return found


@inlined
def near_box(channels, point, boxes, own, reach):  # type: ignore[no-untyped-def]
    """Whether a point is up to `reach` from the box of a region."""
    gap2 = 0.0
    for c in range(3):
        place = channels[index(point), index(c)]
        gap2 += max(boxes[own, 0, c] - place, place - boxes[own, 1, c], 0.0) ** 2
    return gap2 <= reach * reach


@inlined
def most_alike(channels, point, candidates, found, limits):  # type: ignore[no-untyped-def]
    """Return the candidate with the smallest sum of squared differences in units of the limits; ties: the nearest."""
    best, choice = np.inf, candidates[0]
    for place in range(found):
        other = candidates[place]
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
