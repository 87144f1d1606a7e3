# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A partition of the points into regions: numbers, sizes, first points, and the tree nodes that lie in one region."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.compiled.kd_tree import Tree
from topo_region_seg.compiled.nearest import comes_before
from topo_region_seg.compiled.walks import MIXED
from topo_region_seg.data import FloatArray, IntArray


@kernel
def count_off(root: IntArray, weight: IntArray) -> tuple[IntArray, IntArray]:
    """Return the region (N,) of every point, counted from 0 in the order of appearance, and their weights (R,).

    `root` (N,) is the same number below N for the points of a region.
    """
    number = np.full(len(root), -1)
    region = np.empty(len(root), np.int64)
    size = np.zeros(len(root), np.int64)
    count = 0
    for i in range(len(root)):
        r = root[i]
        if number[r] < 0:
            number[r] = count
            count += 1
        region[i] = number[r]
        size[number[r]] += weight[i]
    return region, size[:count].copy()


@kernel
def first_points(channels: FloatArray, region: IntArray, n_regions: int) -> IntArray:
    """Return for each region the point that comes first in the order of its channels (x, y, z, then features).

    Points whose region is below 0 are in none.
    """
    first = np.full(n_regions, -1)
    for point in range(len(region)):
        if region[point] < 0:
            continue
        r = region[point]
        if first[r] < 0 or comes_before(channels, point, first[r]):
            first[r] = point
    return first


@kernel
def region_sizes(region: IntArray, weight: IntArray, n_regions: int) -> IntArray:
    """Return the sum of the weights of each region's points, (R,)."""
    size = np.zeros(n_regions, np.int64)
    for point in range(len(region)):
        if region[point] >= 0:
            size[region[point]] += weight[point]
    return size


@kernel
def uniform_regions(tree: Tree, region: IntArray) -> IntArray:
    """Return for each node the region that all its points belong to, -1 for none, or MIXED if they do not agree."""
    uniform = np.full(len(tree.start), MIXED)
    for node in range(len(uniform) - 1, -1, -1):
        right = tree.right[node]
        if right:
            if uniform[node + 1] == uniform[right]:
                uniform[node] = uniform[right]
            continue
        only = region[tree.order[tree.start[node]]]
        for row in range(tree.start[node] + 1, tree.stop[node]):
            if region[tree.order[row]] != only:
                only = MIXED
                break
        uniform[node] = only
    return uniform
