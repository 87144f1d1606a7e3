# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Edges from each point to its nearest ones, found in the tree for a leaf at a time."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import borrowed, index, inlined, kernel
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.predicate import Criterion, edge_length
from topo_region_seg.compiled.walks import new_walk, next_leaf
from topo_region_seg.data import BoolArray, FloatArray, IndexArray


@kernel
def near_edges(
    tree: Tree,
    blocks: FloatArray,
    rank: IndexArray,
    channels: FloatArray,
    limits: Criterion,
    first_node: int,
    end_node: int,
    near: IndexArray,
    alike: BoolArray,
) -> None:
    """Fill the edges of the points in the leaves of some nodes.

    Parameters
    ----------
    tree : Tree
        Over the positions.
    blocks : (L, 3, LEAF) float64
        Positions, as `leaf_blocks` returns them.
    rank : (N,) int32
        Row in the arrays that follow of each point of the tree; of points equally far the first is the nearest.
    channels : (N, 9) float64
        The points by rank.
    limits : Criterion
        How far an edge may reach, and along which ones the criterion holds.
    first_node, end_node : int
        The nodes.
    near : (N, K) int32
        For each point the ranks of those nearest to it, the nearest first; N where there are fewer.
    alike : (N, K) bool
        Whether the criterion holds for the two.
    """
    tree, blocks, rank = borrowed(tree), borrowed(blocks), borrowed(rank)
    channels, near, alike = borrowed(channels), borrowed(near), borrowed(alike)
    n, most = near.shape
    d2, ranks = np.empty(LEAF), np.empty(LEAF, np.int64)
    found_d2, found = np.empty((LEAF, most)), np.empty((LEAF, most), np.int64)
    walk = new_walk()
    for a in range(first_node, end_node):
        if tree.right[index(a)]:
            continue
        own, size = np.int64(tree.start[index(a)]), np.int64(tree.stop[index(a)] - tree.start[index(a)])
        # Full of what comes after all that is within reach.
        found_d2[:], found[:] = limits.reach, n
        farthest = limits.reach
        walk.node[0], walk.gap[0], top = 0, 0.0, 1
        while True:
            b, top = next_leaf(tree, tree.boxes, a, farthest, True, walk, top)
            if b < 0:
                break
            start, others = np.int64(tree.start[index(b)]), np.int64(tree.stop[index(b)] - tree.start[index(b)])
            for j in range(others):
                ranks[index(j)] = rank[index(tree.order[index(start + j)])]
            for i in range(size):
                distances(blocks, own // LEAF, i, start // LEAF, d2)
                for j in range(others):
                    if d2[index(j)] <= found_d2[index(i), index(most - 1)] and not (a == b and i == j):
                        insert(found_d2, found, i, d2[index(j)], ranks[index(j)])
            farthest = 0.0
            for i in range(size):
                farthest = max(farthest, found_d2[index(i), index(most - 1)])
        for i in range(size):
            p = np.int64(rank[index(tree.order[index(own + i)])])
            for k in range(most):
                q = found[i, k]
                near[p, k] = q
                alike[p, k] = q < n and edge_length(channels, limits, p, q) >= 0.0


@inlined
def distances(blocks, own, i, leaf, d2):  # type: ignore[no-untyped-def]
    """Fill `d2` (LEAF,) with the squared distances of point `i` of one leaf from those of another."""
    p, q = index(own), index(leaf)
    x, y, z = blocks[p, 0, index(i)], blocks[p, 1, index(i)], blocks[p, 2, index(i)]
    for j in range(LEAF):
        dx, dy, dz = blocks[q, 0, index(j)] - x, blocks[q, 1, index(j)] - y, blocks[q, 2, index(j)] - z
        d2[index(j)] = dx * dx + dy * dy + dz * dz


@inlined
def insert(found_d2, found, i, d2, rank):  # type: ignore[no-untyped-def]
    """Insert a point in row `i` of the nearest ones, in which it may come last and be left out."""
    row, place, most = index(i), found.shape[1], found.shape[1]
    while place > 0 and (
        d2 < found_d2[row, index(place - 1)]
        or (d2 == found_d2[row, index(place - 1)] and rank < found[row, index(place - 1)])
    ):
        place -= 1
        if place + 1 < most:
            found_d2[row, index(place + 1)] = found_d2[row, index(place)]
            found[row, index(place + 1)] = found[row, index(place)]
    if place < most:
        found_d2[row, index(place)], found[row, index(place)] = d2, rank
