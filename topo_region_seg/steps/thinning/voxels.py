# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Voxel thinning for sensors that deliver more points than are needed, or than can be dealt with."""

from __future__ import annotations

import math
from itertools import count
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.voxels import number_voxels, voxel_means
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.params import Params

FINEST_EDGE = 1e-6
"""Edge of a voxel, metres, below which no two points are told apart when a cloud is thinned to a number of points."""
REFINEMENTS = 3
"""Attempts at smaller voxels where those that were found leave less than half of the points that may be left."""


class Thinned(NamedTuple):
    """One point per occupied voxel.

    `xyz` (M, 3) and `rgb` (M, 3) uint8 or None are means over the voxel, `first` (M,) is the first input row
    in the voxel, `voxel` (N,) the voxel of every input row, by which labels are carried back, `weight` (M,) the
    number of input rows in the voxel, and `edge` that of the voxels, metres.
    """

    xyz: FloatArray
    rgb: npt.NDArray[np.uint8] | None
    first: IntArray
    voxel: IntArray
    weight: IntArray
    edge: float


def thin(xyz: FloatArray, rgb: npt.NDArray[np.uint8] | None, voxel_size: float, *, mix_colors: bool = True) -> Thinned:
    """Replace the points of every voxel of edge `voxel_size` (m) by their mean.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions, metres.
    rgb : (N, 3) uint8 or None
        Colors.
    voxel_size : float
        Edge of the grid's cubes, metres, > 0. The grid is aligned with the sensor frame.
    mix_colors : bool
        Whether colors that differ may be averaged; else the points of a voxel of several colors stay as they are.
    """
    voxel, first = number_voxels(xyz, voxel_size)
    if rgb is not None and not mix_colors:
        voxel, first = _apart_where_mixed(voxel, first, rgb)
    return voxels_of(xyz, rgb, voxel, first, voxel_size)


def _apart_where_mixed(voxel: IntArray, first: IntArray, rgb: npt.NDArray[np.uint8]) -> tuple[IntArray, IntArray]:
    """Return voxels (N,) and their first points (M,) in which each point of a voxel of several colors has its own."""
    differs = (rgb != rgb[first[voxel]]).any(axis=1)
    mixed = np.zeros(len(first), np.bool_)
    mixed[voxel[differs]] = True
    alone = np.flatnonzero(mixed[voxel])
    key = voxel.copy()
    key[alone] = len(first) + np.arange(len(alone))
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    order = np.argsort(first)  # numbered in the order of appearance
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return rank[number], first[order]


def thin_to(xyz: FloatArray, rgb: npt.NDArray[np.uint8] | None, most: int, voxel_size: float = 0.0) -> Thinned:
    """Replace the points of every voxel by their mean, with voxels about as small as leave at most `most` of them.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions, metres, finite; at least one.
    rgb : (N, 3) uint8 or None
        Colors.
    most : int
        Number of voxels that must not be exceeded, at least 1.
    voxel_size : float
        Least edge of the voxels, metres. The grid begins at the lower corner of the cloud: were it aligned with the
        sensor frame, whose planes part the points whatever the edge is, eight voxels could not become one.
    """
    inside = xyz - xyz.min(axis=0)
    edge = max(voxel_size, float(np.max(inside)) * 2.0**-15, FINEST_EDGE)
    too_small = edge
    for attempt in count(1):
        voxel, first = number_voxels(inside, edge)
        if len(first) <= most:
            break
        too_small = edge
        # Voxels on surfaces grow fewer with the square of the edge. The growing least step ends every search, whatever
        # the cloud, after 15 attempts: then one voxel holds all.
        edge *= max(math.sqrt(len(first) / most), 1.1**attempt)
    for _ in range(REFINEMENTS):
        if 2 * len(first) >= most or too_small == edge:
            break
        between = math.sqrt(too_small * edge)
        numbered = number_voxels(inside, between)
        if len(numbered[1]) <= most:
            (voxel, first), edge = numbered, between
        else:
            too_small = between
    return voxels_of(xyz, rgb, voxel, first, edge)


def thin_for(
    params: Params, xyz: FloatArray, rgb: npt.NDArray[np.uint8] | None, *, mix_colors: bool = True
) -> Thinned | None:
    """Thin as `voxel_size`, `max_points` and `over_max_points` want it; None if all points are to stay."""
    thinned = None
    if params.voxel_size > 0.0 and len(xyz):
        thinned = thin(xyz, rgb, params.voxel_size, mix_colors=mix_colors)
    left = len(xyz) if thinned is None else len(thinned.xyz)
    if params.over_max_points == "thin" and left > params.max_points:
        return thin_to(xyz, rgb, params.max_points, params.voxel_size)
    return thinned


def unthinned(xyz: FloatArray, rgb: npt.NDArray[np.uint8] | None) -> Thinned:
    """Return all points, each standing for itself."""
    every = np.arange(len(xyz))
    return Thinned(xyz, rgb, every, every, np.ones(len(xyz), np.int64), 0.0)


def voxels_of(
    xyz: FloatArray, rgb: npt.NDArray[np.uint8] | None, voxel: IntArray, first: IntArray, edge: float = 0.0
) -> Thinned:
    """Return the means over voxels of points (N, 3); `voxel` (N,) and `first` (M,) as of :func:`number_voxels`."""
    means = [voxel_means(values, voxel, len(first)) for values in ((xyz,) if rgb is None else (xyz, rgb))]
    mean_rgb = None if rgb is None else np.rint(means[1][0]).astype(np.uint8)
    return Thinned(means[0][0], mean_rgb, first, voxel, means[0][1], edge)
