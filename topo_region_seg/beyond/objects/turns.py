# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How much normals turn about each point: to the outside over an edge, to the inside in a groove."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import borrowed, index, inlined, kernel, summing
from topo_region_seg.compiled.kd_tree import LEAF, Tree, box_gap
from topo_region_seg.data import FloatArray

CHUNK = 512  # candidates gathered before they are summed; a multiple of LEAF
CHANNELS = 6


@kernel
def oriented_blocks(tree: Tree, xyz: FloatArray, normals: FloatArray) -> FloatArray:
    """Return positions and normals (N, 3) leaf after leaf, channel after channel; padding is inf."""
    tree, xyz, normals = borrowed(tree), borrowed(xyz), borrowed(normals)
    n = len(xyz)
    blocks = np.full((n + LEAF - 1) // LEAF * CHANNELS * LEAF, np.inf)
    for row in range(n):
        leaf, i = row // LEAF, index(tree.order[index(row)])
        place = leaf * CHANNELS * LEAF + row - leaf * LEAF
        for c in range(3):
            blocks[index(place + c * LEAF)] = xyz[i, c]
            blocks[index(place + (3 + c) * LEAF)] = normals[i, c]
    return blocks


@kernel
def mean_turns(tree: Tree, blocks: FloatArray, radius: float, first_node: int, end_node: int, turn: FloatArray) -> None:
    """Fill `turn` (N,), by point id, for the leaves of some nodes.

    It is the angle, in radians, by which normals turn over `radius` (m) on the mean of all directions, by least
    squares from the points within it: ``radius * sum((n_i - n_j) · (x_i - x_j)) / sum(|x_i - x_j|^2)``. Below 0
    they turn to the inside; it is NaN for a point that has no normal or is alone.
    """
    tree, blocks, turn = borrowed(tree), borrowed(blocks), borrowed(turn)
    reach = np.float32(radius * radius)
    candidates = np.empty(CHANNELS * CHUNK, np.float32)
    own = np.empty(CHANNELS * LEAF, np.float32)
    middle = np.empty(3)
    sums = np.zeros((LEAF, 2))
    stack = np.empty(128, np.int64)
    for a in range(first_node, end_node):
        if tree.right[index(a)]:
            continue
        # Offsets from the leaf are short enough for float32.
        for c in range(3):
            middle[c] = tree.boxes[index(8 * a + c)]
        put_block(blocks, tree.start[index(a)], middle, own, LEAF, 0)
        sums[:] = 0.0
        gathered = 0
        top = 1
        stack[0] = 0
        while top:
            top -= 1
            b = stack[top]
            if box_gap(tree.boxes, 3, a, b, 0) > reach:
                continue
            right = tree.right[index(b)]
            if right:
                stack[top], stack[top + 1] = right, b + 1
                top += 2
                continue
            put_block(blocks, tree.start[index(b)], middle, candidates, CHUNK, gathered)
            gathered += LEAF
            if gathered == CHUNK:
                add_turns(own, candidates, gathered, reach, sums)
                gathered = 0
        add_turns(own, candidates, gathered, reach, sums)
        for i in range(tree.stop[index(a)] - tree.start[index(a)]):
            turn[index(tree.order[index(tree.start[index(a)] + i)])] = radius * sums[i, 0] / sums[i, 1]


@inlined
def put_block(blocks, start, middle, room, stride, place):  # type: ignore[no-untyped-def]
    """Write the leaf whose points begin at row `start` into `room` from `place` on, as offsets from `middle` (3,).

    What has no normal is put out of reach of all others.
    """
    first = np.int64(start) * CHANNELS
    for j in range(LEAF):
        known = abs(blocks[index(first + 3 * LEAF + j)]) <= 1.0
        for c in range(3):
            offset = blocks[index(first + c * LEAF + j)] - middle[index(c)]
            room[index(c * stride + place + j)] = np.float32(offset if known else np.inf)
            normal = blocks[index(first + (3 + c) * LEAF + j)]
            room[index((3 + c) * stride + place + j)] = np.float32(normal if known else 0.0)


@summing
def add_turns(own, candidates, n, reach, sums):  # type: ignore[no-untyped-def]
    """Add to `sums` (LEAF, 2) of a leaf's points what the candidates within reach turn, and their squared distances.

    `own` holds the leaf's points like `candidates`, in which they are CHUNK apart from channel to channel.
    """
    nothing = np.float32(0.0)
    for i in range(LEAF):
        x, y, z = own[i], own[LEAF + i], own[2 * LEAF + i]
        u, v, w = own[3 * LEAF + i], own[4 * LEAF + i], own[5 * LEAF + i]
        turned, squares = nothing, nothing
        for j in range(n):
            dx = candidates[index(j)] - x
            dy = candidates[index(CHUNK + j)] - y
            dz = candidates[index(2 * CHUNK + j)] - z
            near = dx * dx + dy * dy + dz * dz <= reach
            dx, dy, dz = dx if near else nothing, dy if near else nothing, dz if near else nothing
            du = candidates[index(3 * CHUNK + j)] - u
            dv = candidates[index(4 * CHUNK + j)] - v
            dw = candidates[index(5 * CHUNK + j)] - w
            turned += du * dx + dv * dy + dw * dz
            squares += dx * dx + dy * dy + dz * dz
        sums[i, 0] += turned
        sums[i, 1] += squares
