# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Normals of points on a grid: the neighbors within a radius are looked for among the blocks around."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import borrowed, index, kernel, summing
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.data import FloatArray, IndexArray
from topo_region_seg.steps.normals.estimate import WIDEN
from topo_region_seg.steps.normals.fit import fit_normal

TILE = 4
"""Blocks along the side of a tile, whose points look for neighbors together."""
TOUCH = 1.0
"""Widths of a block beyond the radius up to which the middle of one is that touches the neighborhood."""
FARTHEST = 12
"""Blocks around a tile among which neighbors are looked for, at most."""

Single = npt.NDArray[np.float32]


def block_normals(xyz: FloatArray, at: IndexArray, radius: float | FloatArray, min_neighbors: int) -> FloatArray:
    """Return the unit normals (N, 3) of points, turned towards the sensor at the origin.

    The neighborhood is the blocks that the ball of the radius touches. A point with fewer than `min_neighbors` there,
    itself included, takes the points of the blocks that touch its own, up to three radii away; with fewer than three it
    gets NaN.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions in the sensor frame, metres.
    at : (H, W) int32
        Point of each block; -1 where there is none.
    radius : float or (N,) float64
        Radius of the neighborhoods, or of each point's own, metres.
    min_neighbors : int
        Neighbors that are enough.
    """
    normals = np.full((len(xyz), 3), np.nan)
    if len(xyz):
        planes = np.full((3, *at.shape), np.nan, np.float32)
        planes[:, at >= 0] = xyz.T  # points come in the order of the blocks
        each = np.ascontiguousarray(np.broadcast_to(np.float64(radius), len(xyz)))
        given = planes, at, xyz, each, min_neighbors, _spacing(planes), normals
        side_by_side(tile_normals, [(*given, *part) for part in in_parts(-(-at.shape[0] // TILE))])
    return normals


def _spacing(planes: Single) -> float:
    """Return how far blocks side by side are apart, as a share of their distance from the sensor."""
    some = planes[:, ::4]
    step = np.sqrt(((some[:, :, 1:] - some[:, :, :-1]) ** 2).sum(axis=0))
    share = step / np.sqrt((some[:, :, 1:] ** 2).sum(axis=0))
    known = share[np.isfinite(share)]
    return float(np.quantile(known, 0.1)) if len(known) else np.inf


@kernel
def tile_normals(  # type: ignore[no-untyped-def]
    planes, at, xyz, radius, min_neighbors, spacing, normals, first, end
):
    """Fill the `normals` (N, 3) of the points in some rows of tiles; `planes` (3, H, W) are the positions."""
    planes, at, xyz, normals = borrowed(planes), borrowed(at), borrowed(xyz), borrowed(normals)
    radius = borrowed(radius)
    height, width = at.shape
    candidates = np.empty((3, (TILE + 2 * FARTHEST) ** 2), np.float32)
    moments = np.empty(10)
    for top in range(first * TILE, min(end * TILE, height), TILE):
        for left in range(0, width, TILE):
            low, right = min(top + TILE, height), min(left + TILE, width)
            nearest2, widest = np.inf, 0.0
            for v in range(top, low):
                for u in range(left, right):
                    p = at[v, u]
                    if p >= 0:
                        nearest2 = min(nearest2, xyz[p, 0] ** 2 + xyz[p, 1] ** 2 + xyz[p, 2] ** 2)
                        widest = max(widest, radius[p])
            if nearest2 == np.inf:
                continue
            reach = int(min(max(widest / max(spacing * np.sqrt(nearest2), 1e-9) + TOUCH, 1.0), FARTHEST))
            n = 0
            for v in range(max(top - reach, 0), min(low + reach, height)):
                for u in range(max(left - reach, 0), min(right + reach, width)):
                    candidates[0, index(n)] = planes[0, v, u]
                    candidates[1, index(n)] = planes[1, v, u]
                    candidates[2, index(n)] = planes[2, v, u]
                    n += planes[0, v, u] == planes[0, v, u]
            for v in range(top, low):
                for u in range(left, right):
                    p = at[v, u]
                    if p < 0:
                        continue
                    x, y, z = planes[0, v, u], planes[1, v, u], planes[2, v, u]
                    within = radius[p] + TOUCH * spacing * np.sqrt(np.float64(x * x + y * y + z * z))
                    add_moments(candidates, n, x, y, z, np.float32(within * within), moments)
                    if moments[0] < min_neighbors:
                        touching(planes, v, u, WIDEN * radius[p], moments)
                    if moments[0] >= 3.0:
                        fit_normal(moments, xyz[p, 0], xyz[p, 1], xyz[p, 2], normals[p])


@summing
def add_moments(candidates, n, x, y, z, within, moments):  # type: ignore[no-untyped-def]
    """Write the ten moments of the candidates within reach of a point, from it on, in single precision."""
    none = np.float32(0.0)
    count = sx = sy = sz = sxx = sxy = sxz = syy = syz = szz = none
    for j in range(n):
        dx = candidates[0, index(j)] - x
        dy = candidates[1, index(j)] - y
        dz = candidates[2, index(j)] - z
        inside = dx * dx + dy * dy + dz * dz <= within
        dx, dy, dz = dx if inside else none, dy if inside else none, dz if inside else none
        count += np.float32(1.0) if inside else none
        sx, sy, sz = sx + dx, sy + dy, sz + dz
        sxx, sxy, sxz = sxx + dx * dx, sxy + dx * dy, sxz + dx * dz
        syy, syz, szz = syy + dy * dy, syz + dy * dz, szz + dz * dz
    moments[0], moments[1], moments[2], moments[3], moments[4] = count, sx, sy, sz, sxx
    moments[5], moments[6], moments[7], moments[8], moments[9] = sxy, sxz, syy, syz, szz


@kernel
def touching(planes, v, u, wide, moments):  # type: ignore[no-untyped-def]
    """Write the moments of a block and of those that touch it, up to `wide` (m) away."""
    moments[:] = 0.0
    height, width = planes.shape[1:]
    for r in range(max(v - 1, 0), min(v + 2, height)):
        for c in range(max(u - 1, 0), min(u + 2, width)):
            dx = np.float64(planes[0, r, c]) - planes[0, v, u]
            dy = np.float64(planes[1, r, c]) - planes[1, v, u]
            dz = np.float64(planes[2, r, c]) - planes[2, v, u]
            if dx * dx + dy * dy + dz * dz <= wide * wide:
                moments[0] += 1.0
                moments[1], moments[2], moments[3] = moments[1] + dx, moments[2] + dy, moments[3] + dz
                moments[4], moments[5], moments[6] = moments[4] + dx * dx, moments[5] + dx * dy, moments[6] + dx * dz
                moments[7], moments[8], moments[9] = moments[7] + dy * dy, moments[8] + dy * dz, moments[9] + dz * dz
