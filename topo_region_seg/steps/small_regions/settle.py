# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of regions below the minimum size (paper, section IV.E)."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.leaf_blocks import leaf_blocks
from topo_region_seg.compiled.near_lists import NOBODY, NearLists, empty_lists, take_lists
from topo_region_seg.compiled.nearest import room_for_near
from topo_region_seg.compiled.partition import count_off, first_points
from topo_region_seg.compiled.predicate import Criterion
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.params import Params
from topo_region_seg.steps.small_regions.candidates import fill_near_lists
from topo_region_seg.steps.small_regions.merging import merge_small_regions
from topo_region_seg.steps.small_regions.ranks import ranks_of

CANDIDATES = 8  # points of other regions among which the most alike is chosen
REACH = 3.0
"""Radii up to which such a point may lie from the box of a small region: farther away it is nothing that touches it."""
LISTED = 15
"""Nearest points of each representative that are found beforehand, as most regions have few points."""
NONE = -1


def lists_of_small_regions(n_points: int, max_radius: float) -> NearLists:
    """Return room for lists that serve the small regions of any scale up to `max_radius`, metres."""
    return empty_lists(n_points, LISTED, REACH * max_radius)


def settle_small_regions(
    channels: FloatArray,
    tree: Tree,
    root: IntArray,
    weight: IntArray,
    limits: Criterion,
    params: Params,
    near: NearLists | None = None,
) -> IntArray:
    """Merge or remove the regions that stand for fewer than `min_region_size` input points.

    Merging goes from the smallest region to the largest (ties: smallest coordinate triple). Around the
    region's representative, here the point with the smallest coordinate triple so that the order of the
    points does not matter, the nearest points of other regions are looked up, up to REACH radii from the region's
    bounding box; the region joins that of the point with the smallest normalized difference of color and normal.
    A region that ends below the minimum size, since nothing is near it, is removed, unless it is all there is.

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
    limits : Criterion
        The criterion, in whose units differences are compared, and whose radius bounds the search.
    params : Params
        Uses `min_region_size` and `small_regions`.
    near : NearLists, optional
        Lists from `lists_of_small_regions` that are filled in part, with the nearest of all points.

    Returns
    -------
    (N,) int64
        Region of each point, counted from 0 in no particular order; -1 for removed points.
    """
    region, size = count_off(root, weight)
    small = size < params.min_region_size
    if not small.any():
        return region
    if params.small_regions == "merge":
        reach = REACH * math.sqrt(limits.reach)
        representative = first_points(channels, region, len(size))
        blocks = leaf_blocks(tree, channels[:, :3])
        lists = _lists_of(representative[small], size[small], channels, tree, blocks, region, reach, near)
        target, _ = merge_small_regions(
            tree,
            blocks,
            channels,
            region,
            size,
            representative,
            ranks_of(channels, representative),
            lists,
            limits,
            # No region can have more points than all have.
            min(params.min_region_size, int(size.sum()) + 1),
            CANDIDATES,
            reach,
        )
        region, size = count_off(target[region], weight)
        small = (size < params.min_region_size) & (len(size) > 1)
    kept = np.where(small, NONE, np.cumsum(~small) - 1)
    return kept[region]


def _lists_of(
    points: IntArray,
    size: IntArray,
    channels: FloatArray,
    tree: Tree,
    blocks: FloatArray,
    region: IntArray,
    reach: float,
    near: NearLists | None,
) -> NearLists:
    """Return the points of other regions nearest to some `points` (S,), whose regions are of a `size` (S,)."""
    n = len(channels)
    row, wanted = np.full(n, NOBODY, np.int32), np.zeros(n, np.bool_)
    row[points] = np.arange(len(points), dtype=np.int32)
    lists = NearLists(row, np.empty((len(points), LISTED), np.int32), reach)
    if near is None:
        wanted[points] = True
    else:
        # Of a region of more points, its own may fill the list.
        take_lists(near, points, size <= LISTED + 1 - CANDIDATES, wanted, lists)
    if wanted.any():
        groups = np.zeros(n + LEAF, np.int32)
        groups[:n] = region[tree.order]
        given = tree, blocks, groups, channels, wanted
        parts = [(*given, room_for_near(LISTED), first, end, lists) for first, end in in_parts(len(tree.start))]
        side_by_side(fill_near_lists, parts)
    return lists
