# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which regions touch, and where: their adjacency graph."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import index, kernel
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.partition import uniform_regions
from topo_region_seg.compiled.walks import PAIR_LEVELS, next_pair
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
    points = np.column_stack(border_pairs(tree, xyz, own - 1, radius * radius))
    width = int(np.max(own, initial=0)) + 1
    key = own[points[:, 0]] * width + own[points[:, 1]]
    order = np.argsort(key, kind="stable")
    key = key[order]
    first = np.flatnonzero(np.diff(key, prepend=-1))
    pairs = np.column_stack(np.divmod(key[first], width)).astype(np.uint32)
    start = np.append(first, len(key)).astype(np.int64)
    return Adjacency(pairs=pairs, counts=np.diff(start), points=points[order], start=start)


@kernel
def border_pairs(tree: Tree, xyz: FloatArray, region: IntArray, reach2: float) -> tuple[IndexArray, IndexArray]:
    """Return all pairs of points (M,) in different regions, not below 0, whose squared distance is at most `reach2`.

    The first point of a pair is the one in the smaller region. `tree` is over the positions `xyz` (N, 3), m.
    """
    a, b = np.empty(1024, np.int32), np.empty(1024, np.int32)
    count = 0
    if len(tree.start) == 0:
        return a[:0].copy(), b[:0].copy()
    uniform = uniform_regions(tree, region)
    stack = np.empty((PAIR_LEVELS, 2), np.int64)
    stack[0, 0], stack[0, 1], top = 0, 0, 1
    while True:
        p, q, top = next_pair(tree, uniform, reach2, stack, top)
        if p < 0:
            break
        if count + LEAF * LEAF > len(a):
            a, b = longer(a), longer(b)
        for row in range(tree.start[p], tree.stop[p]):
            i = tree.order[index(row)]
            first = row + 1 if p == q else tree.start[q]
            for other in range(first, tree.stop[q]):
                j = tree.order[index(other)]
                if region[i] == region[j] or region[i] < 0 or region[j] < 0:
                    continue
                d2 = 0.0
                for c in range(3):
                    d2 += (xyz[i, c] - xyz[j, c]) ** 2
                if d2 <= reach2:
                    a[count], b[count] = (i, j) if region[i] < region[j] else (j, i)
                    count += 1
    return a[:count].copy(), b[:count].copy()


@kernel
def longer(values):  # type: ignore[no-untyped-def]
    """Return a copy with room for as much again."""
    room = np.empty(2 * len(values), values.dtype)
    room[: len(values)] = values
    return room
