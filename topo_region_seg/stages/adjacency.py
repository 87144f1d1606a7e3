# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which regions touch, and where: their adjacency graph."""

from __future__ import annotations

import numpy as np

from topo_region_seg.data import Adjacency, FloatArray, LabelArray
from topo_region_seg.kernels.borders import border_pairs
from topo_region_seg.kernels.tree import Tree


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
