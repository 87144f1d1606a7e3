# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which regions touch, and where: their adjacency graph."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import borrowed, index, kernel
from topo_region_seg.compiled.kd_tree import DEEP, Tree, node_gap
from topo_region_seg.compiled.partition import uniform_regions
from topo_region_seg.data import Adjacency, FloatArray, IndexArray, IntArray, LabelArray


def adjacency(xyz: FloatArray, labels: LabelArray, tree: Tree, radius: float) -> Adjacency:
    """Find all pairs of points of different regions up to `radius` (m) apart, by pairs of regions.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions, metres.
    labels : (N,) uint32
        Region of each point, from 1; points with label 0 have no neighbors.
    tree : Tree
        Tree over the positions.
    radius : float
        Largest distance of two points at a border, metres.
    """
    own = labels.astype(np.int64)
    points = np.column_stack(border_pairs(tree, xyz, own, radius * radius))
    width = int(np.max(own, initial=0)) + 1
    key = own[points[:, 0]] * width + own[points[:, 1]]
    order = np.argsort(key, kind="stable")
    key = key[order]
    first = np.flatnonzero(np.diff(key, prepend=-1))
    pairs = np.column_stack(np.divmod(key[first], width)).astype(np.uint32)
    start = np.append(first, len(key)).astype(np.int64)
    return Adjacency(pairs=pairs, counts=np.diff(start), points=points[order], start=start)


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


@kernel
def longer(values):  # type: ignore[no-untyped-def]
    """Return a copy with room for as much again."""
    room = np.empty(2 * len(values), values.dtype)
    room[: len(values)] = values
    return room
