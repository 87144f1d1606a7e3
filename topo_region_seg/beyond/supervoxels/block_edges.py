# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Edges between the points of blocks that touch, and what hangs together along them."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import borrowed, index, kernel
from topo_region_seg.compiled.predicate import Criterion, edge_length
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.compiled.union_find import find
from topo_region_seg.data import BoolArray, FloatArray, IndexArray, IntArray

AROUND = np.array([(v, u) for v in range(-2, 3) for u in range(-2, 3) if 0 < v * v + u * u <= 5], np.int64)
"""Blocks that a point has edges to, in rows and columns from its own."""


def block_edges(channels: FloatArray, at: IndexArray, limits: Criterion) -> tuple[IndexArray, BoolArray]:
    """Return the points (N, 8) of blocks that touch, within reach, and whether the criterion holds (N, 8).

    Parameters
    ----------
    channels : (N, 9) float64
        Positions, colors and normals.
    at : (H, W) int32
        Point of each block; -1 where there is none.
    limits : Criterion
        How far an edge may reach, and along which ones the criterion holds.

    Returns
    -------
    (N, 8) int32, (N, 8) bool
        N stands for none.
    """
    near, alike = np.empty((len(channels), len(AROUND)), np.int32), np.empty((len(channels), len(AROUND)), np.bool_)
    side_by_side(fill_edges, [(channels, at, limits, AROUND, near, alike, *part) for part in in_parts(at.shape[0])])
    return near, alike


@kernel
def fill_edges(
    channels: FloatArray,
    at: IndexArray,
    limits: Criterion,
    around: IntArray,
    near: IndexArray,
    alike: BoolArray,
    first: int,
    end: int,
) -> None:
    """Fill the edges of the points in some rows of blocks."""
    channels, at, near, alike = borrowed(channels), borrowed(at), borrowed(near), borrowed(alike)
    height, width = at.shape
    n = len(channels)
    for v in range(first, end):
        for u in range(width):
            p = np.int64(at[v, u])
            if p < 0:
                continue
            for k in range(len(around)):
                r, c = v + around[k, 0], u + around[k, 1]
                q = np.int64(at[r, c]) if 0 <= r < height and 0 <= c < width else np.int64(-1)
                near[index(p), index(k)], alike[index(p), index(k)] = n, False
                if q >= 0:
                    dx = channels[q, 0] - channels[p, 0]
                    dy = channels[q, 1] - channels[p, 1]
                    dz = channels[q, 2] - channels[p, 2]
                    if dx * dx + dy * dy + dz * dz <= limits.reach:
                        near[index(p), index(k)] = q
                        alike[index(p), index(k)] = edge_length(channels, limits, p, q) >= 0.0


@kernel
def joined_along(near: IndexArray, alike: BoolArray) -> IntArray:
    """Return the smallest point (N,) of each point's component along the edges for which the criterion holds."""
    near, alike = borrowed(near), borrowed(alike)
    n, most = near.shape
    parent = np.arange(n)
    for p in range(n):
        for k in range(most):
            q = np.int64(near[index(p), index(k)])
            if q < p and alike[index(p), index(k)]:
                a, b = find(parent, np.int64(p)), find(parent, q)
                parent[index(max(a, b))] = min(a, b)
    for p in range(n):
        parent[p] = find(parent, np.int64(p))
    return parent
