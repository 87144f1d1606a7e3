# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Channels of the points leaf after leaf, as vector code reads them.

Blocks are (L, C, LEAF): of each leaf, each channel of its points, one beside the other. Where the last leaf has fewer
points the rest is inf, which is out of reach of everything.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import index, kernel
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.data import FloatArray, IndexArray


def leaf_blocks(tree: Tree, *columns: FloatArray) -> FloatArray:
    """Return `columns`, each (N, C_i), beside each other in blocks (L, C, LEAF)."""
    blocks = np.empty((leaves_of(len(tree.order)), sum(values.shape[1] for values in columns), LEAF))
    first = 0
    for values in columns:
        fill_blocks(tree.order, values, np.zeros(values.shape[1]), first, blocks)
        first += values.shape[1]
    return blocks


def leaves_of(n_points: int) -> int:
    """Return how many leaves hold so many points."""
    return (n_points + LEAF - 1) // LEAF


@kernel
def fill_blocks(
    order: IndexArray, values: FloatArray, origin: FloatArray, first: int, blocks: npt.NDArray[np.floating]
) -> None:
    """Write `values` (N, C), less their `origin` (C,), into the channels of `blocks` from the `first` on."""
    n, channels = values.shape
    for leaf in range(len(blocks)):
        start = leaf * LEAF
        for i in range(min(LEAF, n - start)):
            point = index(order[index(start + i)])
            for c in range(channels):
                blocks[index(leaf), index(first + c), index(i)] = values[point, index(c)] - origin[index(c)]
        for i in range(n - start, LEAF):
            for c in range(channels):
                blocks[index(leaf), index(first + c), index(i)] = np.inf
