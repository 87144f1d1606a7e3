# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Planes through triples of points, and the points near a plane."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.compiled.dialect import kernel, summing
from topo_region_seg.compiled.moments import NO_MOMENTS, with_point
from topo_region_seg.data import FloatArray, IntArray

FIRST = 128
"""Points that a plane is tried on first; what has not half the share of the best one there is not looked at further."""


@kernel
def best_hypothesis(
    xyz: FloatArray,
    triples: IntArray,
    distance: FloatArray,
    fewest: float,
    miss: float,
    axis: FloatArray,
    level: float,
) -> tuple[FloatArray, float, int]:
    """Return normal (3,), offset (m) and inliers of the plane through a triple with most points on it.

    Triples are drawn until a plane with more points, or with the `fewest` (N) that count, is missed with at most the
    probability `miss`. On it are those within their `distance` (N,), m. The points (N, 3) are in no particular order,
    so that the first of them stand for all. The cosine of the angle between normal and `axis` (3,) is at least `level`.
    """
    n = len(xyz)
    first = min(FIRST, n)
    best, best_offset = 0, 0.0
    best_normal = np.zeros(3)
    x, y, z = xyz[:, 0].copy(), xyz[:, 1].copy(), xyz[:, 2].copy()
    enough = draws_needed(fewest / n, miss)
    for t in range(len(triples)):
        if t >= enough:
            break
        p, q, r = xyz[triples[t, 0]], xyz[triples[t, 1]], xyz[triples[t, 2]]
        ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        bx, by, bz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
        u, v, w = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        length = math.sqrt(u * u + v * v + w * w)
        if not length > 0.0:
            continue
        u, v, w = u / length, v / length, w / length
        if abs(u * axis[0] + v * axis[1] + w * axis[2]) < level:
            continue
        offset = -(u * p[0] + v * p[1] + w * p[2])
        inliers = 0
        for i in range(first):
            inliers += abs(u * x[i] + v * y[i] + w * z[i] + offset) <= distance[i]
        if 2 * inliers * n < max(float(best), fewest) * first:
            continue
        for i in range(first, n):
            inliers += abs(u * x[i] + v * y[i] + w * z[i] + offset) <= distance[i]
        if inliers > best:
            best, best_offset = inliers, offset
            best_normal[0], best_normal[1], best_normal[2] = u, v, w
            enough = draws_needed(max(float(best), fewest) / n, miss)
    return best_normal, best_offset, best


@kernel
def draws_needed(share: float, miss: float) -> int:
    """Return how many triples must be drawn for none to lie on a plane with that share of the points with `miss`."""
    return math.ceil(math.log(miss) / math.log(1.0 - share**3)) if share < 1.0 else 1


@summing
def plane_moments(xyz: FloatArray, normal: FloatArray, offset: float, distance: float) -> FloatArray:
    """Return count, sums and sums of products (10,) of the points within `distance` (m) of a plane."""
    moments = NO_MOMENTS
    u, v, w = normal[0], normal[1], normal[2]
    for i in range(len(xyz)):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        moments = with_point(moments, abs(u * x + v * y + w * z + offset) <= distance, x, y, z)
    return np.array(moments)
