# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Removal of the plane that carries the objects, and of what lies behind it (paper, section V)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import FloatArray, IntArray, Plane
from topo_region_seg.kernels.plane import best_hypothesis, plane_moments, sample_rows
from topo_region_seg.kernels.selection import rows_above
from topo_region_seg.params import Params

SAMPLE = 2_000  # about how many points hypotheses are drawn from and judged by
HYPOTHESES = 300
REFINEMENTS = 20  # least-squares fits; two or three usually settle the inliers


def find_floor(xyz: FloatArray, params: Params) -> Plane | None:
    """Find the dominant plane: RANSAC on a sample, then least squares on all inliers until they settle.

    The sample depends on the points alone, not on their order, so that a shuffled cloud gives the same plane.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions in the sensor frame, metres.
    params : Params
        Uses `floor_distance`, `floor_min_extent` and `floor_seed`.

    Returns
    -------
    Plane or None
        The plane, its normal towards the sensor; None if there is none, or if its shorter side is below
        `floor_min_extent`, as then it carries no objects but is the face of one.
    """
    if len(xyz) < 3:
        return None
    xyz = np.asfortranarray(xyz)  # column by column, so that the passes over it become vector code
    sample = np.ascontiguousarray(xyz[sample_rows(xyz, SAMPLE, params.floor_seed)])
    triples = np.random.default_rng(params.floor_seed).integers(0, len(sample), (HYPOTHESES, 3))
    normal, offset, inliers = best_hypothesis(sample, triples, params.floor_distance)
    if inliers < 3:
        return None
    count = -1
    for _ in range(REFINEMENTS):
        moments = plane_moments(xyz, normal, offset, params.floor_distance)
        if moments[0] < 3 or moments[0] == count:
            break
        count = moments[0]
        normal, offset = _least_squares(moments)
    if offset < 0.0:
        normal, offset = -normal, -offset
    if _shorter_side(sample, normal, offset, params.floor_distance) < params.floor_min_extent:
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
