# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Spacing, depth noise and range of the points of one cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from topo_region_seg.data import BoolArray, Cloud, FloatArray, IntArray

SAMPLE = 4_000
"""Points of a cloud whose neighbors are measured."""
PLANE_POINTS = 24
"""Points of each plane fit for the noise: more would include the curvature of surfaces, fewer would fit the noise."""


@dataclass(frozen=True)
class PointFigures:
    """A sample of the valid points of one cloud; lengths in metres.

    Parameters
    ----------
    points, valid, zeros : int
        Number of points, of those with a position, and of those at exactly (0, 0, 0), which count as invalid.
    distance : (M,) float64
        Distance of the sampled points from the sensor.
    spacing : (M,) float64
        Distance to the nearest other point, ignoring exact duplicates; NaN without one.
    noise : (M,) float64
        Root mean square distance of a point's nearest neighbors from the plane fitted to them, corrected for the
        three degrees of freedom of the plane; NaN with too few neighbors. Edges and curvature increase it, so only
        its median describes the sensor.
    """

    points: int
    valid: int
    zeros: int
    distance: FloatArray
    spacing: FloatArray
    noise: FloatArray


def point_figures(cloud: Cloud, seed: int = 0) -> PointFigures:
    """Measure one cloud on a sample of its points."""
    good, zeros = valid_rows(cloud)
    xyz = cloud.xyz[good].astype(np.float64)
    if len(xyz) == 0:
        none = np.empty(0)
        return PointFigures(len(cloud), 0, zeros, none, none, none)
    rows = sample_rows(len(xyz), SAMPLE, seed)
    tree = cKDTree(xyz)
    distances, neighbors = tree.query(xyz[rows], k=min(PLANE_POINTS + 1, max(2, len(xyz))))
    enough = np.isfinite(distances).all(axis=1) & (distances.shape[1] > PLANE_POINTS)
    noise = np.full(len(rows), np.nan)
    if enough.any():
        noise[enough] = _plane_noise(xyz[neighbors[enough]])
    return PointFigures(
        points=len(cloud),
        valid=len(xyz),
        zeros=zeros,
        distance=np.linalg.norm(xyz[rows], axis=1),
        spacing=_nearest(distances),
        noise=noise,
    )


def valid_rows(cloud: Cloud) -> tuple[BoolArray, int]:
    """Return which points have a position, (N,), and the number of those at exactly (0, 0, 0)."""
    finite = np.isfinite(cloud.xyz).all(axis=1)
    zero = finite & (cloud.xyz == 0.0).all(axis=1)
    return finite & ~zero, int(zero.sum())


def known_median(values: FloatArray) -> float:
    """Return the median of the finite values, NaN without any."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")


def nearest_distance(tree: cKDTree, xyz: FloatArray) -> FloatArray:
    """Return the distance from each point (M, 3) of the tree to its nearest other, (M,); NaN without one.

    Exact duplicates are ignored.
    """
    distances, _ = tree.query(xyz, k=min(8, max(2, tree.n)))
    return _nearest(distances)


def sample_rows(n: int, size: int, seed: int) -> IntArray:
    """Return `size` different rows of `n`, ascending, or all rows if there are no more."""
    if n <= size:
        return np.arange(n)
    return np.sort(np.random.default_rng(seed).choice(n, size, replace=False))


def _nearest(distances: FloatArray) -> FloatArray:
    found = np.where(np.isfinite(distances) & (distances > 0.0), distances, np.inf).min(axis=1)
    nearest: FloatArray = np.where(np.isfinite(found), found, np.nan)
    return nearest


def _plane_noise(groups: FloatArray) -> FloatArray:
    """Return the scatter around the plane fitted to each group of points (M, K, 3), metres."""
    centered = groups - groups.mean(axis=1, keepdims=True)
    smallest = np.linalg.svd(centered, compute_uv=False)[:, -1]
    noise: FloatArray = smallest / np.sqrt(groups.shape[1] - 3)
    return noise
