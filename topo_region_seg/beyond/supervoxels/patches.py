# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions divided into supervoxels: connected, homogeneous patches of bounded extent.

A patch grows from its seed along edges of the same graph whose components the regions are, so it never leaves its
region. The patches compete: the point most similar to the mean of a patch joins first (as in SNIC: Achanta and
Süsstrunk, Superpixels and polygons using simple non-iterative clustering, CVPR 2017).
"""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.beyond.supervoxels.block_edges import block_edges, joined_along
from topo_region_seg.beyond.supervoxels.growth import FREE, LANES, Patches, grow_patches
from topo_region_seg.beyond.supervoxels.near_edges import near_edges
from topo_region_seg.compiled.kd_tree import Tree
from topo_region_seg.compiled.leaf_blocks import leaf_blocks
from topo_region_seg.compiled.partition import count_off
from topo_region_seg.compiled.predicate import Criterion
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.compiled.voxels import number_voxels, voxel_means
from topo_region_seg.data import BoolArray, FloatArray, IndexArray, IntArray
from topo_region_seg.params import Params

NEIGHBORS = 12  # neighbors along which a patch grows
TURN = 30.0  # degrees that count as much as one seed spacing, or a difference of color at the threshold
UNIT = 0.5 / math.sin(math.radians(TURN) / 2.0)  # length of normals whose ends are 1 apart at that angle
SMALLEST = 1.0 / 16.0
"""Share of a cell's points that a patch in it needs: `min_region_size` alone may be most of what a narrow cell has."""
NONE = -1


def supervoxels(
    xyz: FloatArray,
    channels: FloatArray,
    tree: Tree,
    root: IntArray,
    weight: IntArray,
    limits: Criterion,
    params: Params,
) -> IntArray:
    """Divide the components at a scale into patches.

    Every point lies within `seed_spacing` of its patch's seed, a point of the patch. Patches that stand for fewer input
    points than `min_region_size`, and than SMALLEST of those in their seed's cell, are left over: with
    `small_regions` = ``merge`` their points join the patches that reach them within that bound, by edges up to the
    scale, homogeneous or not. What none reaches stays.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions, metres, in which patches are bounded.
    channels : (N, 9) float64
        Positions, colors and normals as the criterion compares them, as `homogeneity_channels` returns them.
    tree : Tree
        Tree over the positions in `channels`.
    root : (N,) int64
        Smallest point id of each point's component at the scale.
    weight : (N,) int64
        Number of input points that each point stands for.
    limits : Criterion
        The criterion, with edges up to the scale.
    params : Params
        Uses `seed_spacing`, `color_threshold`, `min_region_size` and `small_regions`.

    Returns
    -------
    (N,) int64
        Patch of each point, counted from 0 in no particular order; -1 for removed points.
    """
    if len(channels) == 0:
        return np.empty(0, np.int64)
    order = _own_order(channels)
    n = len(order)
    blocks = leaf_blocks(tree, channels[:, :3])
    rank = np.empty(n, np.int32)
    rank[order] = np.arange(n, dtype=np.int32)
    channels = channels[order]
    near, alike = np.empty((n, NEIGHBORS), np.int32), np.empty((n, NEIGHBORS), np.bool_)
    tasks = [(tree, blocks, rank, channels, limits, *part, near, alike) for part in in_parts(len(tree.start))]
    side_by_side(near_edges, tasks)
    patch = np.empty(n, np.int64)
    positions = np.ascontiguousarray(xyz[order])
    patch[order] = _divided(positions, channels, near, alike, root[order], weight[order], params)
    return patch


def supervoxels_of_blocks(
    xyz: FloatArray, channels: FloatArray, at: IndexArray, weight: IntArray, limits: Criterion, params: Params
) -> IntArray:
    """Divide a cloud on an image grid into patches, which grow from each block to those that touch it.

    Seeds are of what hangs together that way. All else is as in :func:`supervoxels`.

    Parameters
    ----------
    xyz, channels, weight, limits, params
        As for :func:`supervoxels`; points come in the order of the blocks.
    at : (H, W) int32
        Point of each block; -1 where there is none.

    Returns
    -------
    (N,) int64
        Patch of each point, counted from 0 in no particular order; -1 for removed points.
    """
    if len(channels) == 0:
        return np.empty(0, np.int64)
    near, alike = block_edges(channels, at, limits)
    return _divided(xyz, channels, near, alike, joined_along(near, alike), weight, params)


def _divided(
    xyz: FloatArray,
    channels: FloatArray,
    near: IndexArray,
    alike: BoolArray,
    root: IntArray,
    weight: IntArray,
    params: Params,
) -> IntArray:
    """Return the patches (N,) of points in an order of their own, with their edges (N, K)."""
    seeds, fewest = _seeds(xyz, root, weight, params)
    patches = _ungrown(xyz, channels, near, alike, params)
    bound, everything, no_seeds = params.seed_spacing, np.arange(len(xyz), dtype=np.int32), np.empty(0, np.int32)
    grow_patches(patches, everything, seeds, True, True, bound, UNIT)
    size = np.bincount(patches.patch, weight, len(xyz))
    small = size[patches.patch] < fewest[patches.patch]
    if params.small_regions == "merge" and not small.all():
        _free(patches, small)
        grow_patches(patches, everything[small], no_seeds, False, False, bound, UNIT)
        left = patches.patch == FREE
        _free(patches, left)
        grow_patches(patches, everything[left], no_seeds, True, True, bound, UNIT)
    region, _ = count_off(patches.patch.astype(np.int64), weight)
    if params.small_regions == "remove":
        kept = np.unique(region[~small])
        number = np.full(len(xyz), NONE)
        number[kept] = np.arange(len(kept))
        region = number[region]
    return region


def _own_order(channels: FloatArray) -> IntArray:
    """Return the points (N, 9) in an order of their own, so that the one in which they come does not matter."""
    x, y, z = channels[:, :3].T
    # Many points have an x in common, few their place along an odd direction.
    key = x + math.sqrt(0.5) * y + math.sqrt(0.2) * z
    order = np.argsort(key)
    same = np.diff(key[order]) == 0.0
    tied = np.flatnonzero(np.append(same, False) | np.append(False, same))
    rows = order[tied]
    order[tied] = rows[np.lexsort(channels[rows, ::-1].T)]
    return order


def _seeds(xyz: FloatArray, root: IntArray, weight: IntArray, params: Params) -> tuple[IndexArray, FloatArray]:
    """Return the points (S,) that patches grow from, and the fewest input points (N,) of a patch with a seed there.

    The seeds are, of each component's part in each cell of a grid of `seed_spacing`, the middle one, unless the part
    has fewer input points than that.
    """
    cell, _ = number_voxels(xyz, params.seed_spacing)
    fewest = np.minimum(params.min_region_size, SMALLEST * np.bincount(cell, weight)[cell])
    # Pairs of numbers are numbered as cells are.
    part, first = number_voxels(np.column_stack([cell, root, np.zeros_like(root)]).astype(np.float64), 1.0)
    middle, _ = voxel_means(xyz, part, len(first))
    off = ((xyz - middle[part]) ** 2).sum(axis=1)
    least = np.full(len(first), np.inf)
    np.minimum.at(least, part, off)
    rows = np.flatnonzero(off == least[part])
    _, place = np.unique(part[rows], return_index=True)
    seeds = rows[place]
    enough = np.bincount(part, weight) >= fewest[seeds]
    return np.sort(seeds[enough]).astype(np.int32), fewest


def _ungrown(xyz: FloatArray, channels: FloatArray, near: IndexArray, alike: BoolArray, params: Params) -> Patches:
    """Return the points (N, 9) with their edges and without patches."""
    n = len(xyz)
    traits = np.zeros((n, LANES), np.float32)
    traits[:, 0:3] = (xyz - xyz.mean(axis=0)) / params.seed_spacing
    traits[:, 4:7] = channels[:, 3:6] / max(params.color_threshold, 1e-6)
    traits[:, 8:11] = channels[:, 6:9] * UNIT
    return Patches(
        xyz=xyz,
        traits=traits,
        near=near,
        alike=alike,
        patch=np.full(n, FREE, np.int32),
        sums=np.zeros((n, LANES)),
        mean=np.zeros((n, LANES), np.float32),
        cost=np.full(n, np.inf, np.float32),
        best_patch=np.empty(n, np.int32),
        before=np.empty(n, np.int32),
        after=np.empty(n, np.int32),
    )


def _free(patches: Patches, points: BoolArray) -> None:
    patches.patch[points] = FREE
    patches.cost[points] = np.inf
