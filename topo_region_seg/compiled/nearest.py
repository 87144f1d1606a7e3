# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Nearest points, found in the tree: of the points of one leaf at a time, which share the walk, or of one alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.boxes import bound_channel
from topo_region_seg.compiled.dialect import borrowed, index, inlined, kernel
from topo_region_seg.compiled.kd_tree import LEAF
from topo_region_seg.compiled.lanes import trailing_zeros
from topo_region_seg.compiled.near_lanes import insert_lanes, insert_leaf, within_leaves
from topo_region_seg.compiled.walks import Walk, new_walk, next_leaf
from topo_region_seg.data import FloatArray, IntArray

LEAF_SHIFT = 3  # LEAF = 1 << LEAF_SHIFT


class Near(NamedTuple):
    """The points found so far that are nearest to each of up to LEAF points, k at most, and room for the search.

    Rows of `d2` and `point` begin with LEAF cells that hold nothing, the last of which is below every distance, so that
    cells can be looked at beside those before them. Then come the nearest, the nearest of all first, in whole vectors.
    """

    d2: FloatArray  # (LEAF * W,) their squared distances, m²; inf where none is found yet
    point: IntArray  # (LEAF * W,) their ids
    within: FloatArray  # (LEAF,) squared distance up to which points are looked for; below 0: for none
    rows: FloatArray  # (k * LEAF,) their squared distances, place by place, while the points of a leaf are dealt with
    ids: IntArray  # (k * LEAF,) and their ids
    leaf_d2: FloatArray  # (LEAF * LEAF,) squared distances of the points of two leaves
    box: npt.NDArray[np.float32]  # (1, 1, 2, 4) the box around one point
    walk: Walk
    k: int


@kernel
def room_for_near(k: int) -> Near:
    """Return room for the `k` nearest points."""
    width = LEAF + (k + LEAF - 1) // LEAF * LEAF
    d2, point = np.full(LEAF * width, -np.inf), np.zeros(LEAF * width, np.int64)
    box, walk = np.zeros((1, 1, 2, 4), np.float32), new_walk()
    rows, ids = np.empty(LEAF * k), np.zeros(LEAF * k, np.int64)
    return Near(d2, point, np.empty(LEAF), rows, ids, np.empty(LEAF * LEAF), box, walk, k)


@inlined
def width_of(near):  # type: ignore[no-untyped-def]
    """Return how many cells a row has."""
    return len(near.d2) // LEAF


@inlined
def near_point(near, i, place):  # type: ignore[no-untyped-def]
    """Return the id of the point nearest to the i-th but `place` others."""
    return near.point[index(i * width_of(near) + LEAF + place)]


@inlined
def near_distance2(near, i, place):  # type: ignore[no-untyped-def]
    """Return the squared distance, m², of the point nearest to the i-th but `place` others; inf where there is none."""
    return near.d2[index(i * width_of(near) + LEAF + place)]


@inlined
def nearest_of_leaf(tree, blocks, groups, channels, leaf, near):  # type: ignore[no-untyped-def]
    """Fill `near` with the points nearest to those of a leaf, of other groups than theirs, each `within` its own reach.

    `blocks` (L, 3, LEAF) are the positions by leaf and `groups` (N + LEAF,) int32 the groups in the order of the tree;
    of points equally far the first in the order of `channels` (N, C), which begin with the position, is the nearest.
    Return how many leaves were visited.
    """
    own, size = np.int64(tree.start[index(leaf)]), np.int64(tree.stop[index(leaf)] - tree.start[index(leaf)])
    farthest, ties = -1.0, 0
    for i in range(LEAF):
        if i >= size:
            near.within[index(i)] = -1.0
        farthest = max(farthest, near.within[index(i)])
    for cell in range(len(near.rows)):
        near.rows[index(cell)] = np.inf
    near.walk.node[0], near.walk.gap[0] = 0, 0.0
    top, visited = 1, 0
    while farthest >= 0.0:
        other, top = next_leaf(tree, tree.boxes, leaf, farthest, True, near.walk, top)
        if other < 0:
            break
        visited += 1
        start = np.int64(tree.start[index(other)])
        ties |= insert_leaf(blocks, groups, tree.order, own, start, near.within, near.rows, near.ids)
        farthest = -1.0
        for i in range(LEAF):
            farthest = max(farthest, near.within[index(i)])
    width = width_of(near)
    if ties:
        for i in range(LEAF):
            near.within[index(i)] = near.within[index(i)] if ties >> i & 1 else -1.0
        visited += nearest_in_order(tree, blocks, groups, channels, leaf, near)
    for i in range(size):
        if ties >> i & 1:
            continue
        for place in range(near.k):
            cell, row = index(i * width + LEAF + place), index(place * LEAF + i)
            near.d2[cell], near.point[cell] = near.rows[row], near.ids[row]
    return visited


@kernel
def nearest_in_order(tree, blocks, groups, channels, leaf, near):  # type: ignore[no-untyped-def]
    """Do the same one by one, for points of which others are equally far; `near.within` may be shorter already."""
    tree, blocks, groups, near = borrowed(tree), borrowed(blocks), borrowed(groups), borrowed(near)
    channels = borrowed(channels)
    own, size = np.int64(tree.start[index(leaf)]), np.int64(tree.stop[index(leaf)] - tree.start[index(leaf)])
    farthest = -1.0
    for i in range(LEAF):
        empty_row(near, i)
        farthest = max(farthest, near.within[index(i)])
    near.walk.node[0], near.walk.gap[0] = 0, 0.0
    top, visited = 1, 0
    while farthest >= 0.0:
        other, top = next_leaf(tree, tree.boxes, leaf, farthest, True, near.walk, top)
        if other < 0:
            break
        visited += 1
        start, others = np.int64(tree.start[index(other)]), np.int64(tree.stop[index(other)] - tree.start[index(other)])
        hits = within_leaves(blocks, groups, own, start, near.within, near.leaf_d2)
        while hits:
            place = trailing_zeros(hits)
            hits &= hits - 1
            i, j, d2 = place & (LEAF - 1), place >> LEAF_SHIFT, near.leaf_d2[index(place)]
            # Where the reach is endless it holds what fills up the last leaf, too.
            if d2 <= near.within[index(i)] and j < others:
                insert_near(channels, np.int64(tree.order[index(start + j)]), d2, near, i)
        farthest = -1.0
        for i in range(size):
            farthest = max(farthest, near.within[index(i)])
    return visited


@inlined
def begin_near(near, x, y, z):  # type: ignore[no-untyped-def]
    """Begin a walk around one point at the root of the tree."""
    bound_channel(near.box, 0, 0, x, x)
    bound_channel(near.box, 0, 1, y, y)
    bound_channel(near.box, 0, 2, z, z)
    near.walk.node[0], near.walk.gap[0] = 0, 0.0
    empty_row(near, 0)


@inlined
def empty_row(near, i):  # type: ignore[no-untyped-def]
    """Forget the points nearest to the i-th."""
    first = i * width_of(near)
    for cell in range(first + LEAF, first + width_of(near)):
        near.d2[index(cell)] = np.inf


@kernel
def insert_near(channels, other, d2, near, i):  # type: ignore[no-untyped-def]
    """Insert `other` among the points nearest to the i-th; once there are enough, only nearer ones are looked for."""
    channels, near = borrowed(channels), borrowed(near)
    first = i * width_of(near) + LEAF
    last = first + near.k - 1
    if d2 == near.within[index(i)] and d2 == near.d2[index(last)]:
        if comes_before(channels, other, near.point[index(last)]):
            near.point[index(last)] = other
            put_tie_in_order(channels, other, d2, near, first, last)
        return
    tied = False
    for cell in range(first + width_of(near) - 2 * LEAF, first - 1, -LEAF):
        tied |= insert_lanes(near.d2, near.point, cell, d2, other)
    if tied:
        place = first
        while near.point[index(place)] != other:
            place += 1
        put_tie_in_order(channels, other, d2, near, first, place)
    near.within[index(i)] = min(near.within[index(i)], near.d2[index(last)])


@inlined
def put_tie_in_order(channels, other, d2, near, first, place):  # type: ignore[no-untyped-def]
    """Move the point `other`, in cell `place`, before those equally far that come after it in order."""
    while place > first and near.d2[index(place - 1)] == d2:
        earlier = near.point[index(place - 1)]
        if not comes_before(channels, other, earlier):
            break
        near.point[index(place - 1)], near.point[index(place)] = other, earlier
        place -= 1


@inlined
def found_near(near, i):  # type: ignore[no-untyped-def]
    """Return how many points were found near the i-th."""
    first, found = i * width_of(near) + LEAF, 0
    while found < near.k and near.d2[index(first + found)] < np.inf:
        found += 1
    return found


@kernel
def comes_before(channels, p, q):  # type: ignore[no-untyped-def]
    """Whether point `p` precedes point `q` in the order of the channels."""
    for c in range(channels.shape[1]):
        if channels[p, c] != channels[q, c]:
            return channels[p, c] < channels[q, c]
    return False
