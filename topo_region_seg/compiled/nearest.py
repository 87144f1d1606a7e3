# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Nearest points, found in the tree: of the points of one leaf at a time, which share the walk, or of one alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.boxes import bound_channel
from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.compiled.kd_tree import LEAF
from topo_region_seg.compiled.walks import LEVELS, next_leaf
from topo_region_seg.data import FloatArray, IntArray


class Near(NamedTuple):
    """The points found so far that are nearest to each of up to LEAF points, k at most, and room for the search."""

    d2: FloatArray  # (LEAF, k) their squared distances, m², the shortest first
    point: IntArray  # (LEAF, k) their ids
    found: IntArray  # (LEAF,) how many there are
    within: FloatArray  # (LEAF,) squared distance up to which points are looked for; below 0: for none
    leaf_d2: FloatArray  # (LEAF,) squared distances of the points of one leaf
    box: npt.NDArray[np.float32]  # (1, 1, 2, 4) the box around one point
    stack: IntArray  # (LEVELS,) nodes that the walk has still to visit


@kernel
def room_for_near(k: int) -> Near:
    """Return room for the `k` nearest points."""
    point, found, stack = np.empty((LEAF, k), np.int64), np.zeros(LEAF, np.int64), np.empty(LEVELS, np.int64)
    box = np.zeros((1, 1, 2, 4), np.float32)
    return Near(np.empty((LEAF, k)), point, found, np.empty(LEAF), np.empty(LEAF), box, stack)


@inlined
def nearest_of_leaf(tree, blocks, channels, leaf, near):  # type: ignore[no-untyped-def]
    """Fill `near` with the points nearest to those of a leaf, themselves included, each `within` its own reach.

    `blocks` (L, 3, LEAF) are the positions by leaf; of points equally far the first in the order of `channels` (N, C),
    which begin with the position, is the nearest. Return how many leaves were visited.
    """
    own, size = np.int64(tree.start[index(leaf)]), np.int64(tree.stop[index(leaf)] - tree.start[index(leaf)])
    near.found[:] = 0
    farthest = -1.0
    for i in range(size):
        farthest = max(farthest, near.within[index(i)])
    near.stack[0] = 0
    top, visited = 1, 0
    while farthest >= 0.0:
        other, top = next_leaf(tree, tree.boxes, leaf, farthest, True, near.stack, top)
        if other < 0:
            break
        visited += 1
        start, others = np.int64(tree.start[index(other)]), np.int64(tree.stop[index(other)] - tree.start[index(other)])
        farthest = -1.0
        for i in range(size):
            if near.within[index(i)] >= 0.0:
                row = index(own // LEAF)
                x, y, z = blocks[row, 0, index(i)], blocks[row, 1, index(i)], blocks[row, 2, index(i)]
                leaf_distances(blocks, start // LEAF, x, y, z, near.leaf_d2)
                for j in range(others):
                    if near.leaf_d2[index(j)] <= near.within[index(i)]:
                        insert_near(channels, np.int64(tree.order[index(start + j)]), near.leaf_d2[index(j)], near, i)
                farthest = max(farthest, near.within[index(i)])
    return visited


@inlined
def begin_near(near, x, y, z):  # type: ignore[no-untyped-def]
    """Begin a walk around one point at the root of the tree."""
    bound_channel(near.box, 0, 0, x, x)
    bound_channel(near.box, 0, 1, y, y)
    bound_channel(near.box, 0, 2, z, z)
    near.stack[0], near.found[0] = 0, 0


@inlined
def leaf_distances(blocks, leaf, x, y, z, leaf_d2):  # type: ignore[no-untyped-def]
    """Fill `leaf_d2` (LEAF,) with the squared distances of a leaf's points from a place."""
    row = index(leaf)
    for j in range(LEAF):
        dx, dy, dz = blocks[row, 0, index(j)] - x, blocks[row, 1, index(j)] - y, blocks[row, 2, index(j)] - z
        leaf_d2[index(j)] = dx * dx + dy * dy + dz * dz


@inlined
def insert_near(channels, other, d2, near, i):  # type: ignore[no-untyped-def]
    """Insert `other` among the points nearest to the i-th; once there are enough, only nearer ones are looked for."""
    row, most = index(i), near.d2.shape[1]
    place = near.found[row]
    while place > 0 and (
        d2 < near.d2[row, index(place - 1)]
        or (d2 == near.d2[row, index(place - 1)] and comes_before(channels, other, near.point[row, index(place - 1)]))
    ):
        place -= 1
        if place + 1 < most:
            near.d2[row, index(place + 1)] = near.d2[row, index(place)]
            near.point[row, index(place + 1)] = near.point[row, index(place)]
    if place < most:
        near.d2[row, index(place)], near.point[row, index(place)] = d2, other
        near.found[row] = min(near.found[row] + 1, most)
        if near.found[row] == most:
            near.within[row] = near.d2[row, index(most - 1)]


@kernel
def comes_before(channels, p, q):  # type: ignore[no-untyped-def]
    """Whether point `p` precedes point `q` in the order of the channels."""
    for c in range(channels.shape[1]):
        if channels[p, c] != channels[q, c]:
            return channels[p, c] < channels[q, c]
    return False
