# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A cloud as a picture: the point that each pixel shows."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import cKDTree

from topo_region_seg.data import BoolArray, Cloud, FloatArray, IntArray

_LONGER_SIDE = 640  # pixels of the picture of an unorganized cloud
_MARGIN = 8
_LARGEST_SQUARE = 15  # pixels


def picture_of(cloud: Cloud) -> IntArray:
    """Return the row of the point that each pixel shows, -1 for none, shape (height, width).

    An organized cloud is its own image. An unorganized one is projected as seen from the sensor at the origin, nearer
    points in front; if the points surround the sensor, as those of a lidar do, it is seen from outside.
    """
    seen = valid_points(cloud)
    if cloud.organized:
        return np.where(seen, np.arange(len(cloud)), -1).reshape(cloud.height, cloud.width)
    rows = np.flatnonzero(seen)
    if not len(rows):
        return np.full((_LONGER_SIDE // 2, _LONGER_SIDE), -1)
    across, down, depth = _perspective(np.asarray(cloud.xyz[rows], dtype=np.float64))
    return _splat(rows, across, down, depth)


def valid_points(cloud: Cloud) -> BoolArray:
    """Return which points have a position, (N,): finite and not exactly zero."""
    valid: BoolArray = np.isfinite(cloud.xyz).all(axis=1) & cloud.xyz.any(axis=1)
    return valid


def view_axes(forward: FloatArray) -> FloatArray:
    """Return the directions right, down and forward of a view along a unit vector, as columns, (3, 3)."""
    # Optical frames look along z with y down; in other frames z is up.
    down_hint = np.array([0.0, 1.0, 0.0]) if abs(forward[2]) > 0.8 else np.array([0.0, 0.0, -1.0])
    right = np.cross(down_hint, forward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward], axis=1)


def _perspective(xyz: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return where the points are on an image plane at distance 1 (right, down) and their depth."""
    center = np.median(xyz, axis=0)
    extent = float(np.percentile(np.linalg.norm(xyz - center, axis=1), 99)) + 1e-9
    eye = np.zeros(3)
    forward = center / max(float(np.linalg.norm(center)), 1e-9)
    off_axis = (xyz @ forward) < 0.4 * np.linalg.norm(xyz, axis=1)
    if off_axis.mean() > 0.02:
        forward = np.array([1.0, 0.0, -0.6]) / math.hypot(1.0, 0.6)
        eye = center - 2.5 * extent * forward
    local = (xyz - eye) @ view_axes(forward)
    depth = np.maximum(local[:, 2], 1e-3 * extent)
    return local[:, 0] / depth, local[:, 1] / depth, depth


def _splat(rows: IntArray, across: FloatArray, down: FloatArray, depth: FloatArray) -> IntArray:
    """Draw every point as a square, far ones first; the squares are so large that those of a surface touch."""
    low = np.array([np.percentile(across, 0.1), np.percentile(down, 0.1)])
    high = np.array([np.percentile(across, 99.9), np.percentile(down, 99.9)])
    scale = (_LONGER_SIDE - 2 * _MARGIN) / max(float((high - low).max()), 1e-9)
    width, height = (np.ceil((high - low) * scale).astype(int) + 2 * _MARGIN).tolist()
    height, width = max(height, _LONGER_SIDE // 4), max(width, _LONGER_SIDE // 4)
    middle = (low + high) / 2
    place = np.stack([(across - middle[0]) * scale + width / 2, (down - middle[1]) * scale + height / 2], axis=1)
    u, v = np.round(place).astype(np.int64).T
    side = int(np.clip(np.ceil(1.5 * _spacing(place)), 1, _LARGEST_SQUARE))
    order = np.argsort(-depth, kind="stable")
    offset = np.arange(side) - side // 2
    uu = (u[order, None, None] + offset[None, None, :]) + np.zeros((1, side, 1), dtype=np.int64)
    vv = (v[order, None, None] + offset[None, :, None]) + np.zeros((1, 1, side), dtype=np.int64)
    inside = (uu >= 0) & (uu < width) & (vv >= 0) & (vv < height)
    picture = np.full((height, width), -1)
    point = np.broadcast_to(rows[order, None, None], inside.shape)
    picture[vv[inside], uu[inside]] = point[inside]  # of several points the last one, which is the nearest, stays
    return picture


def _spacing(place: FloatArray) -> float:
    """Return the median distance of points to their fourth neighbor: on a grid, its spacing."""
    if len(place) < 5:
        return float(_LARGEST_SQUARE)
    sample = place[:: -(-len(place) // 2000)]
    distance, _ = cKDTree(place).query(sample, k=5)
    return float(np.median(distance[:, 4]))
