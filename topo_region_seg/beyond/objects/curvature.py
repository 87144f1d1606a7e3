# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The mean curvature of the surface at each point: above zero over an edge, below zero in a groove."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.boxes import LOWER
from topo_region_seg.compiled.dialect import index, inlined, kernel, summing
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.walks import new_walk, next_leaf
from topo_region_seg.data import FloatArray

CHUNK = 512  # candidates gathered before they are summed; a multiple of LEAF


@kernel
def mean_curvatures(
    tree: Tree, blocks: FloatArray, radius: float, first_node: int, end_node: int, curvature: FloatArray
) -> None:
    """Fill `curvature` (N,), by point id, for the leaves of some nodes.

    It is the angle, radians, by which normals turn over `radius` (m) on the mean of all directions, by least squares
    from the points within it: ``radius * sum((n_i - n_j) · (x_i - x_j)) / sum(|x_i - x_j|^2)``. Below 0 they turn to
    the inside. A point that has no normal or is alone gets NaN.
    """
    reach = np.float32(radius * radius)
    candidates = np.empty((6, CHUNK), np.float32)
    own = np.empty((6, LEAF), np.float32)
    middle = np.empty(3)
    sums = np.zeros((LEAF, 2))
    walk = new_walk()
    for a in range(first_node, end_node):
        if tree.right[index(a)]:
            continue
        # Offsets from the leaf are short enough for float32.
        for c in range(3):
            middle[c] = tree.boxes[0, index(a), LOWER, index(c)]
        copy_leaf(blocks, tree.start[index(a)] // LEAF, middle, own, 0)
        sums[:] = 0.0
        gathered = 0
        walk.node[0], walk.gap[0], top = 0, 0.0, 1
        while True:
            b, top = next_leaf(tree, tree.boxes, a, reach, False, walk, top)
            if b < 0:
                break
            copy_leaf(blocks, tree.start[index(b)] // LEAF, middle, candidates, gathered)
            gathered += LEAF
            if gathered == CHUNK:
                add_curvatures(own, candidates, gathered, reach, sums)
                gathered = 0
        add_curvatures(own, candidates, gathered, reach, sums)
        for i in range(tree.stop[index(a)] - tree.start[index(a)]):
            curvature[index(tree.order[index(tree.start[index(a)] + i)])] = radius * sums[i, 0] / sums[i, 1]


@inlined
def copy_leaf(blocks, leaf, middle, room, place):  # type: ignore[no-untyped-def]
    """Write a leaf into `room` (6, M) from `place` on, as offsets from `middle` (3,).

    What has no normal is put out of reach of all others.
    """
    k = index(leaf)
    for j in range(LEAF):
        at = index(place + j)
        known = abs(blocks[k, 3, index(j)]) <= 1.0
        for c in range(3):
            offset, normal = blocks[k, index(c), index(j)] - middle[index(c)], blocks[k, index(3 + c), index(j)]
            room[index(c), at] = np.float32(offset if known else np.inf)
            room[index(3 + c), at] = np.float32(normal if known else 0.0)


@summing
def add_curvatures(own, candidates, n, reach, sums):  # type: ignore[no-untyped-def]
    """Add to `sums` (LEAF, 2) of a leaf's points how far the candidates within reach turn, and their squared distances.

    `own` (6, LEAF) are the leaf's points and `candidates` (6, CHUNK) the others: offsets, and normals.
    """
    nothing = np.float32(0.0)
    for i in range(LEAF):
        x, y, z = own[0, i], own[1, i], own[2, i]
        u, v, w = own[3, i], own[4, i], own[5, i]
        turned, squares = nothing, nothing
        for j in range(n):
            dx = candidates[0, index(j)] - x
            dy = candidates[1, index(j)] - y
            dz = candidates[2, index(j)] - z
            near = dx * dx + dy * dy + dz * dz <= reach
            dx, dy, dz = dx if near else nothing, dy if near else nothing, dz if near else nothing
            du = candidates[3, index(j)] - u
            dv = candidates[4, index(j)] - v
            dw = candidates[5, index(j)] - w
            turned += du * dx + dv * dy + dw * dz
            squares += dx * dx + dy * dy + dz * dz
        sums[i, 0] += turned
        sums[i, 1] += squares
