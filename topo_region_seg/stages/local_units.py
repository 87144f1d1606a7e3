# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Positions in units of the spacing that the sensor leaves between points, which grows with the distance.

A camera's points are as far apart as the pixel's angle times the depth. In the coordinates (x/z, y/z, ln z) that
spacing is the same everywhere, so one radius serves near and far things alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.params import REFERENCE_SPACING

WIDEST = 60.0
"""Angle from the middle of the view, degrees, up to which a cloud is taken for a camera's."""
NEAREST = 0.05
"""Least depth of a camera's point, metres."""
STRIDE = 16
"""Of so many points one is looked at for the middle of the view."""
SAMPLES = 20_000
"""Points whose nearest neighbors tell the spacing where there is no image grid."""


@dataclass(frozen=True)
class LocalUnits:
    """The change of coordinates; both ways and for normals.

    Parameters
    ----------
    axes : (3, 3) float64
        Orthonormal; rows are the image's right, down, and the middle of the view, in the sensor frame.
    depth : float
        Depth at which lengths stay what they are, metres; inf: they are `scale` times as long everywhere.
    scale : float
        Factor of all lengths where `depth` is inf.
    """

    axes: FloatArray
    depth: float
    scale: float = 1.0

    def growth(self, xyz: FloatArray) -> float:
        """Return how many times longer than at the reference lengths are in the middle of a cloud; at least 1."""
        if math.isinf(self.depth) or len(xyz) == 0:
            return max(1.0, 1.0 / self.scale)
        return max(1.0, float(np.median(xyz @ self.axes[2])) / self.depth)

    def at(self, xyz: FloatArray) -> FloatArray:
        """Return positions (N, 3), metres, in local units."""
        if math.isinf(self.depth):
            return xyz * self.scale
        x, y, z = (xyz @ self.axes.T).T
        return self.depth * np.column_stack([x / z, y / z, np.log(z / self.depth)])

    def back(self, local: FloatArray) -> FloatArray:
        """Return positions (N, 3), metres, from those in local units."""
        if math.isinf(self.depth):
            return local / self.scale
        u, v, w = local.T / self.depth
        z = self.depth * np.exp(w)
        return np.column_stack([u * z, v * z, z]) @ self.axes

    def normals_back(self, normals: FloatArray, local: FloatArray) -> FloatArray:
        """Return unit normals (N, 3) in the sensor frame, turned to the sensor, from those in local units."""
        if math.isinf(self.depth):
            return normals
        u, v, _ = local.T / self.depth
        a, b, c = normals.T
        # The transposed Jacobian of `at`, but for a factor.
        found = np.column_stack([a, b, c - u * a - v * b])
        towards = u * found[:, 0] + v * found[:, 1] + found[:, 2] <= 0.0
        found *= np.where(towards, 1.0, -1.0)[:, None] / np.linalg.norm(found, axis=1, keepdims=True)
        return found @ self.axes


def local_units(xyz: FloatArray, rows: IntArray, width: int, height: int) -> LocalUnits:
    """Return the local units of a cloud.

    Parameters
    ----------
    xyz : (N, 3) float
        Valid positions, metres, in the sensor frame.
    rows : (N,) int64
        Their pixels; neighbors in a row are neighbors in the image where `height` is above 1.
    width, height : int
        Size of the image grid.
    """
    straight = LocalUnits(np.eye(3), math.inf)
    if len(xyz) < 2:
        return straight
    distance = np.linalg.norm(xyz, axis=1)
    if np.min(distance) < NEAREST:
        return _everywhere(xyz)
    axes = _axes(xyz[::STRIDE] / distance[::STRIDE, None])
    if np.min((xyz @ axes[2]) / distance) < math.cos(math.radians(WIDEST)):
        return _everywhere(xyz)
    if height > 1:
        beside = np.flatnonzero((np.diff(rows) == 1) & (rows[1:] % width != 0))
        beside = beside[:: max(1, len(beside) // SAMPLES)]
        steps = np.linalg.norm(_image(xyz[beside + 1], axes) - _image(xyz[beside], axes), axis=1)
        angle = float(np.median(steps)) if len(steps) else 0.0
    else:
        angle = _nearest(_image(xyz, axes))
    return LocalUnits(axes, REFERENCE_SPACING / angle) if angle > 0.0 else straight


def _everywhere(xyz: FloatArray) -> LocalUnits:
    """Return units that are the same everywhere, from the spacing of all points."""
    spacing = _nearest(xyz)
    return LocalUnits(np.eye(3), math.inf, REFERENCE_SPACING / spacing if spacing > 0.0 else 1.0)


def _image(xyz: FloatArray, axes: FloatArray) -> FloatArray:
    """Return where points are in the image at depth 1, (N, 2)."""
    seen: FloatArray = xyz @ axes.T
    image: FloatArray = seen[:, :2] / seen[:, 2:]
    return image


def _axes(directions: FloatArray) -> FloatArray:
    """Return the axes whose third is the middle of the view; those of the sensor where that looks along z."""
    middle = directions.mean(axis=0)
    middle /= max(float(np.linalg.norm(middle)), 1e-12)
    if middle[2] > math.cos(math.radians(WIDEST / 2.0)):
        return np.eye(3)
    side = np.cross(middle, np.eye(3)[int(np.argmin(np.abs(middle)))])
    side /= np.linalg.norm(side)
    return np.array([side, np.cross(middle, side), middle])


def _nearest(points: FloatArray) -> float:
    """Return the median distance of points to their nearest other one."""
    some = points[:: max(1, len(points) // SAMPLES)]
    near = cKDTree(points).query(some, k=2)[0][:, 1]
    return float(np.median(near))
