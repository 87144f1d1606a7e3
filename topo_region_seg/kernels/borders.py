# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Pairs of near points of different regions, found in the tree."""

from __future__ import annotations

import numpy as np

from topo_region_seg.data import FloatArray, IndexArray, IntArray
from topo_region_seg.kernels.borrow import borrowed
from topo_region_seg.kernels.compile import index, inlined, kernel
from topo_region_seg.kernels.merging import uniform_regions
from topo_region_seg.kernels.tree import SLACK, Tree

DEEP = 512  # pairs of nodes that may wait: three a level of the tree at most


@kernel
def border_pairs(tree: Tree, xyz: FloatArray, label: IntArray, reach2: float) -> tuple[IndexArray, IndexArray]:
    """Return all pairs of points (M,) with different labels above 0 whose squared distance is at most `reach2`.

    The first point of a pair is the one with the smaller label. `tree` is over the positions `xyz` (N, 3), m.
    """
    tree, xyz, label = borrowed(tree), borrowed(xyz), borrowed(label)
    a, b = np.empty(1024, np.int32), np.empty(1024, np.int32)
    count = 0
    if len(tree.start) == 0:
        return a[:0].copy(), b[:0].copy()
    uniform = uniform_regions(tree, label)
    stack = np.empty((DEEP, 2), np.int64)
    stack[0, 0], stack[0, 1] = 0, 0
    top = 1
    while top:
        top -= 1
        p, q = stack[top, 0], stack[top, 1]
        if uniform[p] == 0 or uniform[q] == 0 or (uniform[p] == uniform[q] and uniform[p] > 0):
            continue
        if p != q and node_gap(tree.boxes, p, q) > reach2:
            continue
        right_p, right_q = tree.right[p], tree.right[q]
        if p == q and right_p:
            stack[top, 0], stack[top, 1] = p + 1, p + 1
            stack[top + 1, 0], stack[top + 1, 1] = right_p, right_p
            stack[top + 2, 0], stack[top + 2, 1] = p + 1, right_p
            top += 3
            continue
        if right_p or right_q:
            # The larger one is opened.
            if not right_q or (right_p and tree.stop[p] - tree.start[p] >= tree.stop[q] - tree.start[q]):
                stack[top, 0], stack[top, 1] = p + 1, q
                stack[top + 1, 0], stack[top + 1, 1] = right_p, q
            else:
                stack[top, 0], stack[top, 1] = p, q + 1
                stack[top + 1, 0], stack[top + 1, 1] = p, right_q
            top += 2
            continue
        if count + 64 > len(a):
            a, b = longer(a), longer(b)
        for row in range(tree.start[p], tree.stop[p]):
            i = tree.order[index(row)]
            first = row + 1 if p == q else tree.start[q]
            for other in range(first, tree.stop[q]):
                j = tree.order[index(other)]
                if label[i] == label[j] or label[i] == 0 or label[j] == 0:
                    continue
                d2 = 0.0
                for c in range(3):
                    d2 += (xyz[i, c] - xyz[j, c]) ** 2
                if d2 <= reach2:
                    a[count], b[count] = (i, j) if label[i] < label[j] else (j, i)
                    count += 1
    return a[:count].copy(), b[:count].copy()


@inlined
def node_gap(boxes, p, q):  # type: ignore[no-untyped-def]
    """Return at most the squared distance of the boxes of two nodes."""
    gap = 0.0
    for c in range(3):
        below = np.float64(boxes[index(8 * p + c)]) - np.float64(boxes[index(8 * q + 4 + c)])
        above = np.float64(boxes[index(8 * q + c)]) - np.float64(boxes[index(8 * p + 4 + c)])
        apart = max(0.0, below, above)
        gap += apart * apart
    return gap * SLACK


@kernel
def longer(values):  # type: ignore[no-untyped-def]
    """Return a copy with room for as much again."""
    room = np.empty(2 * len(values), values.dtype)
    room[: len(values)] = values
    return room
