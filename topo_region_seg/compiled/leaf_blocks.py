# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Positions in blocks, a leaf of the tree after the other, as vector code reads them."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import index, kernel
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.data import FloatArray


@kernel
def leaf_blocks(tree: Tree, xyz: FloatArray) -> FloatArray:
    """Return positions (N, 3) leaf after leaf, coordinate after coordinate; padding is inf."""
    n = len(xyz)
    blocks = np.full((n + LEAF - 1) // LEAF * 3 * LEAF, np.inf)
    for row in range(n):
        leaf = row // LEAF
        for c in range(3):
            blocks[(leaf * 3 + c) * LEAF + row - leaf * LEAF] = xyz[index(tree.order[row]), c]
    return blocks
