# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Removal of the plane that carries the objects, and of what lies behind it (paper, section V)."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import kernel, summing
from topo_region_seg.compiled.sampling import sample_rows
from topo_region_seg.data import FloatArray, IntArray, Plane

SAMPLE = 2_000  # about how many points hypotheses are drawn from and judged by
HYPOTHESES = 300
REFINEMENTS = 20  # least-squares fits; two or three usually settle the inliers


def find_floor(xyz: FloatArray, distance: float, min_extent: float, seed: int) -> Plane | None:
    """Find the dominant plane: RANSAC on a sample, then least squares on all inliers until they settle.

    The sample depends on the points alone, not on their order, so that a shuffled cloud gives the same plane.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions in the sensor frame, metres.
    distance : float
        Largest distance of a point of the plane from it, metres.
    min_extent : float
        Shorter side, metres, that a plane needs to carry objects.
    seed : int
        Seed of the search.

    Returns
    -------
    Plane or None
        The plane, its normal towards the sensor; None if there is none, or if its shorter side is below
        `min_extent`, as then it carries no objects but is the face of one.
    """
    if len(xyz) < 3:
        return None
    xyz = np.asfortranarray(xyz)  # column by column, so that the passes over it become vector code
    sample = np.ascontiguousarray(xyz[sample_rows(xyz, SAMPLE, seed)])
    if len(sample) < 3:
        return None  # many points at two places
    triples = np.random.default_rng(seed).integers(0, len(sample), (HYPOTHESES, 3))
    normal, offset, inliers = best_hypothesis(sample, triples, distance)
    if inliers < 3:
        return None
    count = -1
    for _ in range(REFINEMENTS):
        moments = plane_moments(xyz, normal, offset, distance)
        if moments[0] < 3 or moments[0] == count:
            break
        count = moments[0]
        normal, offset = _least_squares(moments)
    if offset < 0.0:
        normal, offset = -normal, -offset
    if _shorter_side(sample, normal, offset, distance) < min_extent:
        return None
    return Plane(normal=(float(normal[0]), float(normal[1]), float(normal[2])), offset=float(offset))


def above(xyz: FloatArray, plane: Plane, distance: float) -> IntArray:
    """Return the rows of `xyz` that lie more than `distance` (m) in front of the plane, on the sensor's side."""
    return rows_above(np.asfortranarray(xyz), np.array(plane.normal), plane.offset, distance)


def _least_squares(moments: FloatArray) -> tuple[FloatArray, float]:
    count, mean = moments[0], moments[1:4] / moments[0]
    xx, xy, xz, yy, yz, zz = moments[4:10] / count
    covariance = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - np.outer(mean, mean)
    normal: FloatArray = np.linalg.eigh(covariance)[1][:, 0]
    return normal, float(-normal @ mean)


def _shorter_side(xyz: npt.NDArray[np.float64], normal: FloatArray, offset: float, distance: float) -> float:
    inliers = xyz[np.abs(xyz @ normal + offset) <= distance]
    if len(inliers) < 3:
        return 0.0
    axes = np.linalg.eigh(np.cov(inliers.T))[1][:, 1:]
    low, high = np.percentile(inliers @ axes, [2.0, 98.0], axis=0)
    return float((high - low).min())


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


@kernel
def rows_above(xyz: FloatArray, normal: FloatArray, offset: float, distance: float) -> IntArray:
    """Return the rows (M,) more than `distance` (m) in front of the plane ``normal · x + offset = 0``."""
    rows = np.empty(len(xyz), np.int64)
    count = 0
    u, v, w = normal[0], normal[1], normal[2]
    for i in range(len(xyz)):
        rows[count] = i
        height = u * xyz[i, 0] + v * xyz[i, 1] + w * xyz[i, 2] + offset
        count += 1 if height > distance else 0
    kept: IntArray = rows[:count].copy()
    return kept
