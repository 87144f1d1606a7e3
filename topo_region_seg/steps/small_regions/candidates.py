# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What a small region may join: the points of other regions that are nearest to its representative.

Most small regions are single points, or few. So the nearest points of each representative are found beforehand, for a
leaf of the tree at a time. A region searches the tree itself only where too few of these are left, as they are its own
points or far from its box.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import borrowed, index, inlined, kernel
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.lanes import trailing_zeros
from topo_region_seg.compiled.near_lanes import within_leaf
from topo_region_seg.compiled.near_lists import NOBODY, NearLists, keep_list
from topo_region_seg.compiled.nearest import Near, begin_near, found_near, insert_near, near_point, nearest_of_leaf
from topo_region_seg.compiled.union_find import find
from topo_region_seg.compiled.walks import next_leaf
from topo_region_seg.data import FloatArray, IndexArray

ABOVE = 1.0 + 1e-9  # by this factor rounding does not lengthen the bound of a search


@kernel
def fill_near_lists(
    tree: Tree,
    blocks: FloatArray,
    groups: IndexArray,
    channels: FloatArray,
    wanted: npt.NDArray[np.bool_],
    near: Near,
    first_node: int,
    end_node: int,
    lists: NearLists,
) -> int:
    """Fill the lists of the `wanted` points (N,) in the leaves of some nodes; return how many leaves it took.

    `groups` (N + LEAF,) are the regions in the order of the tree, to begin with: they only grow.
    """
    tree, blocks, groups = borrowed(tree), borrowed(blocks), borrowed(groups)
    channels, wanted, near, lists = borrowed(channels), borrowed(wanted), borrowed(near), borrowed(lists)
    visited = 0
    for leaf in range(first_node, end_node):
        if tree.right[index(leaf)]:
            continue
        first, size = tree.start[index(leaf)], tree.stop[index(leaf)] - tree.start[index(leaf)]
        for i in range(size):
            near.within[index(i)] = lists.reach**2 if wanted[index(tree.order[index(first + i)])] else -1.0
        visited += nearest_of_leaf(tree, blocks, groups, channels, leaf, near)
        for i in range(size):
            point = tree.order[index(first + i)]
            if wanted[index(point)]:
                keep_list(lists, point, near, i)
    return visited


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


@inlined
def listed_outside(lists, channels, region, parent, boxes, reach, point, own, near):  # type: ignore[no-untyped-def]
    """Put the points from the list of `point` in `near` that are outside of its region, `own`, and near its box.

    The list goes as far as the `reach` at least. Return how many, and whether the tree holds no other that is nearest.
    """
    found, row = 0, index(lists.row[index(point)])
    for place in range(lists.near.shape[1]):
        other = np.int64(lists.near[row, index(place)])
        if other == NOBODY:
            # All points are listed that are in reach of this one, which is the region's only place.
            alone = True
            for c in range(3):
                alone = alone and boxes[own, 0, c] == boxes[own, 1, c]
            return found, alone
        if find(parent, region[index(other)]) != own and near_box(channels, other, boxes, own, reach):
            near.point[index(LEAF + found)] = other
            found += 1
            if found == near.k:
                return found, True
    return found, False


@kernel
def nearest_outside(  # type: ignore[no-untyped-def]
    tree, blocks, channels, region, parent, uniform, boxes, reach, point, own, near
):
    """Fill `near` with the points nearest to `point` that are up to `reach` from the box of its region, `own`.

    Points of the region itself are left out. Return how many are found, and how many leaves were visited. `region` (N,)
    is the region of a point and `parent` the union-find of the regions; `uniform` (K,) is the region that all points of
    a node belong to, if any; `boxes` (R, 2, 3) are those of the regions.
    """
    tree, blocks, channels, region = borrowed(tree), borrowed(blocks), borrowed(channels), borrowed(region)
    parent, uniform, boxes, near = borrowed(parent), borrowed(uniform), borrowed(boxes), borrowed(near)
    x, y, z = channels[index(point), 0], channels[index(point), 1], channels[index(point), 2]
    begin_near(near, x, y, z)
    # What is near the box is no farther from the point than the box's farthest corner and the reach together.
    corner2 = 0.0
    for c in range(3):
        place = channels[index(point), index(c)]
        corner2 += max(place - boxes[own, 0, c], boxes[own, 1, c] - place) ** 2
    near.within[0] = ABOVE * (math.sqrt(corner2) + reach) ** 2
    top, visited = 1, 0
    while True:
        node, top = next_leaf(tree, near.box, 0, near.within[0], True, near.walk, top)
        if node < 0:
            break
        visited += 1
        only = uniform[index(node)]
        if only >= 0 and find(parent, only) == own:
            continue
        start, stop = np.int64(tree.start[index(node)]), np.int64(tree.stop[index(node)])
        hits = within_leaf(blocks, start, x, y, z, near.within[0], near.leaf_d2)
        while hits:
            j = trailing_zeros(hits)
            hits &= hits - 1
            d2 = near.leaf_d2[index(j)]
            if d2 <= near.within[0] and j < stop - start:
                other = np.int64(tree.order[index(start + j)])
                if find(parent, region[index(other)]) != own and near_box(channels, other, boxes, own, reach):
                    insert_near(channels, other, d2, near, 0)
    return found_near(near, 0), visited


@inlined
def near_box(channels, point, boxes, own, reach):  # type: ignore[no-untyped-def]
    """Whether a point is up to `reach` from the box of a region."""
    gap2 = 0.0
    for c in range(3):
        place = channels[index(point), index(c)]
        gap2 += max(boxes[own, 0, c] - place, place - boxes[own, 1, c], 0.0) ** 2
    return gap2 <= reach * reach


@inlined
def most_alike(channels, point, near, found, limits):  # type: ignore[no-untyped-def]
    """Return the near point with the smallest sum of squared differences in units of the limits; ties: the nearest."""
    best, choice = np.inf, near_point(near, 0, 0)
    for place in range(found):
        other = near_point(near, 0, place)
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
