# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Surface normals from the covariance of a neighborhood (paper, section IV.C)."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.leaf_blocks import leaf_blocks
from topo_region_seg.compiled.near_lists import NearLists, no_lists
from topo_region_seg.compiled.nearest import room_for_near
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.data import FloatArray
from topo_region_seg.steps.normals.neighborhoods import fill_normals

WIDEN = 3.0  # where points are sparse, a neighborhood grows to at most this many radii


def estimate_normals(
    xyz: FloatArray, tree: Tree, radius: float | FloatArray, min_neighbors: int, near: NearLists | None = None
) -> FloatArray:
    """Return the unit normals of the points, turned towards the sensor at the origin.

    The neighborhood is everything within the radius. A point with fewer than `min_neighbors` there takes as many
    nearest points within three radii.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions in the sensor frame, metres.
    tree : Tree
        Tree over `xyz`.
    radius : float or (N,) float64
        Radius of the neighborhoods, or of each point's own, metres; below 0 for points that are to have no normal.
    min_neighbors : int
        Neighbors that are enough, the point itself included.
    near : NearLists, optional
        Takes the points near each of those with too few neighbors, which have to be found here, for steps to come.

    Returns
    -------
    (N, 3) float64
        Unit normals; a row of NaN where even the wider neighborhood holds fewer than three points.
    """
    return fitted_planes(xyz, tree, radius, min_neighbors, near)[0]


def fitted_planes(
    xyz: FloatArray, tree: Tree, radius: float | FloatArray, min_neighbors: int, near: NearLists | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return what `estimate_normals` does, and of each point's neighborhood the plane (N, 2).

    That is the point's height over it, metres, and the variance of the heights of all its points, square metres; NaN
    where fewer than `min_neighbors` points are within the radius.
    """
    n = len(xyz)
    normals, planes = np.full((n, 3), np.nan), np.full((n, 2), np.nan)
    each = np.ascontiguousarray(np.broadcast_to(np.float64(radius), n))
    lists = no_lists() if near is None else near
    room = max(min_neighbors - 1, lists.near.shape[1])
    alone = np.arange(n + LEAF, dtype=np.int32)
    given = tree, leaf_blocks(tree, xyz), alone, xyz, each, WIDEN * each, min_neighbors
    side_by_side(
        fill_normals,
        [(*given, room_for_near(room), lists, first, end, normals, planes) for first, end in in_parts(len(tree.start))],
    )
    return normals, planes
