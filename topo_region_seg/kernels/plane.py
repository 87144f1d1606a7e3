# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Planes through point triples, and what lies near a plane."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.kernels.borrow import borrowed
from topo_region_seg.kernels.compile import kernel, summing


@kernel
def sample_rows(xyz: FloatArray, size: int, seed: int) -> IntArray:
    """Return about `size` rows, those with the smallest hashes of their coordinates, in the order of the hashes.

    The sample depends on the points alone, not on their order.
    """
    xyz = borrowed(xyz)
    limit = np.float64(size) / max(len(xyz), size)
    hashes = np.empty(len(xyz))
    rows = np.empty(len(xyz), np.int64)
    count = 0
    for i in range(len(xyz)):
        value = np.uint64(seed)
        for c in range(3):
            value = (value ^ np.float64(xyz[i, c]).view(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
            value ^= value >> np.uint64(29)
        value = (value * np.uint64(0xBF58476D1CE4E5B9)) ^ (value >> np.uint64(32))
        share = np.float64(value >> np.uint64(11)) * 2.0**-53
        if share <= limit:
            hashes[count], rows[count] = share, i
            count += 1
    return rows[:count][np.argsort(hashes[:count])]


@kernel
def best_hypothesis(xyz: FloatArray, triples: IntArray, distance: float) -> tuple[FloatArray, float, int]:
    """Return normal (3,), offset (m) and inliers of the plane through a triple with most points within `distance`."""
    best, best_offset = 0, 0.0
    best_normal = np.zeros(3)
    x, y, z = xyz[:, 0].copy(), xyz[:, 1].copy(), xyz[:, 2].copy()
    for t in range(len(triples)):
        p, q, r = xyz[triples[t, 0]], xyz[triples[t, 1]], xyz[triples[t, 2]]
        ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        bx, by, bz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
        u, v, w = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        length = math.sqrt(u * u + v * v + w * w)
        if not length > 0.0:
            continue
        u, v, w = u / length, v / length, w / length
        offset = -(u * p[0] + v * p[1] + w * p[2])
        inliers = 0
        for i in range(len(xyz)):
            inliers += abs(u * x[i] + v * y[i] + w * z[i] + offset) <= distance
        if inliers > best:
            best, best_offset = inliers, offset
            best_normal[0], best_normal[1], best_normal[2] = u, v, w
    return best_normal, best_offset, best


@summing
def plane_moments(xyz: FloatArray, normal: FloatArray, offset: float, distance: float) -> FloatArray:
    """Return count, sums and sums of products (10,) of the points within `distance` (m) of a plane."""
    count, sx, sy, sz = 0.0, 0.0, 0.0, 0.0
    sxx, sxy, sxz, syy, syz, szz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    u, v, w = normal[0], normal[1], normal[2]
    for i in range(len(xyz)):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        near = abs(u * x + v * y + w * z + offset) <= distance
        x, y, z = x if near else 0.0, y if near else 0.0, z if near else 0.0
        count += 1.0 if near else 0.0
        sx += x
        sy += y
        sz += z
        sxx += x * x
        sxy += x * y
        sxz += x * z
        syy += y * y
        syz += y * z
        szz += z * z
    return np.array([count, sx, sy, sz, sxx, sxy, sxz, syy, syz, szz])
