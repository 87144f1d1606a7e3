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
from scipy.spatial import cKDTree

from topo_region_seg.data import BoolArray, FloatArray, IndexArray, IntArray
from topo_region_seg.kernels.growth import grow_patches
from topo_region_seg.kernels.merging import count_off
from topo_region_seg.params import Params
from topo_region_seg.stages.homogeneity import criterion

NEAREST = 12  # neighbors along which a patch grows
TURN = 30.0  # degrees that count as much as one seed spacing, or a difference of color at the threshold
FREE = -1
NONE = -1


def supervoxels(channels: FloatArray, root: IntArray, weight: IntArray, params: Params) -> IntArray:
    """Divide the components at `params.scale` into patches.

    Every point lies within `seed_spacing` of its patch's seed, a point of the patch. Patches that stand for fewer than
    `min_region_size` input points are left over: with `small_regions` = ``merge`` their points join the patches
    that reach them within that bound, by edges up to the scale, homogeneous or not. What none reaches stays.

    Parameters
    ----------
    channels : (N, 9) float64
        Positions (m), colors and normals, as `homogeneity_channels` returns them.
    root : (N,) int64
        Smallest point id of each point's component at the scale.
    weight : (N,) int64
        Number of input points that each point stands for.
    params : Params
        Uses `seed_spacing`, `max_radius`, `radius`, `min_region_size`, `small_regions` and the criterion.

    Returns
    -------
    (N,) int64
        Patch of each point, counted from 0 in no particular order; -1 for removed points.
    """
    if len(channels) == 0:
        return np.empty(0, np.int64)
    # In an order of their own, so that the one in which the points come does not matter.
    order = np.argsort(channels[:, 0])
    if (np.diff(channels[order, 0]) == 0.0).any():
        order = np.lexsort(channels[:, ::-1].T)
    growth = _Growth(channels[order], params)
    growth.start(seeds(growth.channels[:, :3], root[order], weight[order], params))
    size = np.bincount(growth.patch, weight[order])
    small = (size < params.min_region_size)[growth.patch]
    if params.small_regions == "merge" and small.any() and not small.all():
        growth.absorb(small)
    patch = np.empty_like(growth.patch)
    patch[order] = growth.patch
    if params.small_regions == "remove":
        kept = size >= params.min_region_size
        patch = np.where(kept, np.cumsum(kept) - 1, NONE)[patch]
        return patch
    return count_off(patch, weight)[0]


def seeds(xyz: FloatArray, root: IntArray, weight: IntArray, params: Params) -> IntArray:
    """Return the points (S,) that patches grow from: of each component's part in each cell of a grid, the middle one.

    The grid has cells of `seed_spacing`; parts of fewer than `min_region_size` input points get no seed.
    """
    cell = np.floor(xyz / params.seed_spacing).astype(np.int64)
    order = np.lexsort((root, cell[:, 2], cell[:, 1], cell[:, 0]))
    keys = np.column_stack([cell, root])[order]
    first = np.concatenate([[True], (np.diff(keys, axis=0) != 0).any(axis=1)])
    part = np.empty(len(xyz), np.int64)
    part[order] = np.cumsum(first) - 1
    count = np.bincount(part)
    middle = np.column_stack([np.bincount(part, xyz[:, c]) for c in range(3)]) / count[:, None]
    off = ((xyz - middle[part]) ** 2).sum(axis=1)
    by_part = np.lexsort((off, part))
    nearest = by_part[np.concatenate([[0], np.cumsum(count)[:-1]])]
    return np.sort(nearest[np.bincount(part, weight) >= params.min_region_size])


class _Growth:
    """Points, sorted, and the patches that they have joined so far."""

    def __init__(self, channels: FloatArray, params: Params) -> None:
        self.channels = channels
        self.patch: IntArray = np.full(len(channels), FREE, np.int64)
        self._seed: IntArray = np.empty(len(channels), np.int64)
        self._count = 0
        self._limits = criterion(params.replace(max_radius=params.scale, radius=0.0))
        self._bound = params.seed_spacing
        self._near = _neighbors(channels[:, :3], params.scale)
        chord = 2.0 * math.sin(math.radians(TURN) / 2.0)
        self._unit = np.array([params.seed_spacing, max(params.color_threshold, 1e-6), chord])

    def start(self, seed: IntArray) -> None:
        """Grow patches from seeds; points that these do not reach become seeds too."""
        self._seed[: len(seed)] = seed
        self._count = len(seed)
        self._grow(0, alike=True)

    def absorb(self, small: BoolArray) -> None:
        """Let some points join the patches of the others by any edges; what these do not reach is grown anew."""
        self.patch[small] = FREE
        self._grow(self._count, alike=False)
        # A new patch takes a free number: no more are in use than there are points.
        used, self.patch[self.patch >= 0] = np.unique(self.patch[self.patch >= 0], return_inverse=True)
        self._seed[: len(used)] = self._seed[used]
        self._count = len(used)
        self._grow(self._count, alike=True)

    def _grow(self, n_old: int, *, alike: bool) -> None:
        self._count = grow_patches(
            self.channels,
            self._near,
            self.patch,
            self._seed,
            n_old,
            self._count,
            self._limits,
            alike,
            self._bound,
            self._unit,
        )


def _neighbors(xyz: FloatArray, radius: float) -> IndexArray:
    """Return the points nearest to each one, (N, NEAREST) int32; N where there are fewer within the radius."""
    reach = math.nextafter(radius, math.inf)  # the tree's bound is not reached
    # The nearest is the point itself, or one that coincides with it.
    near = cKDTree(xyz).query(xyz, NEAREST + 1, distance_upper_bound=reach)[1]
    return np.ascontiguousarray(near, np.int32)
