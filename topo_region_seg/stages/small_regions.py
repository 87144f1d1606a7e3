# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of regions below the minimum size (paper, section IV.E)."""

from __future__ import annotations

import numpy as np

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.kernels.merging import count_off, first_points, merge_small_regions
from topo_region_seg.kernels.tree import Tree
from topo_region_seg.params import Params
from topo_region_seg.stages.homogeneity import criterion

NEAREST = 8  # points of other regions among which the most alike is chosen
NONE = -1


def settle_small_regions(
    channels: FloatArray, tree: Tree, root: IntArray, weight: IntArray, params: Params
) -> IntArray:
    """Merge or remove the regions that stand for fewer than `min_region_size` input points.

    Merging goes from the smallest region to the largest (ties: smallest coordinate triple). Around the
    region's representative, here the point with the smallest coordinate triple so that the order of the
    points does not matter, the nearest points of other regions are looked up; the region joins that of the
    point with the smallest normalized difference of color and normal. A region that has no other region to
    join stays.

    Parameters
    ----------
    channels : (N, 9) float64
        Positions (m), colors and normals, as `homogeneity_channels` returns them.
    tree : Tree
        Tree over the positions.
    root : (N,) int64
        Smallest point id of each point's component.
    weight : (N,) int64
        Number of input points that each point stands for.
    params : Params
        Uses `min_region_size`, `small_regions` and the criterion.

    Returns
    -------
    (N,) int64
        Region of each point, counted from 0 in no particular order; -1 for removed points.
    """
    region, size = count_off(root, weight)
    small = size < params.min_region_size
    if not small.any():
        return region
    if params.small_regions == "remove":
        kept = np.where(small, NONE, np.cumsum(~small) - 1)
        return kept[region]
    representative = first_points(channels, region, len(size))
    target = merge_small_regions(
        tree,
        channels,
        region,
        size,
        representative,
        _ranks(channels[representative]),
        criterion(params),
        params.min_region_size,
        NEAREST,
    )
    return count_off(target[region], weight)[0]


def _ranks(points: FloatArray) -> IntArray:
    """Return the place of each point (R, 9) in their order: by x, then y, z and the features."""
    order = np.argsort(points[:, 0])
    if (np.diff(points[order, 0]) == 0.0).any():
        order = np.lexsort(points[:, ::-1].T)
    rank = np.empty(len(points), np.int64)
    rank[order] = np.arange(len(points))
    return rank
