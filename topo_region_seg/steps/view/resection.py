# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the camera of an organized cloud was, told by its image grid, whatever frame the positions are in.

A pinhole camera maps positions to pixels by a matrix of 3 by 4. An organized cloud has both for thousands of points,
which gives the matrix (direct linear transform; Hartley and Zisserman, Multiple View Geometry, 7.1) and with it the
camera's center. Noise of the depth does no harm: it moves points along the rays through that center.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import Cloud, FloatArray

SAMPLE = 1_500
"""About how many pixels are looked at."""
FEWEST = 100
"""Valid points that tell a camera."""
SHARP = 0.5
"""Distance, pixels, up to which three in four points must be from where the camera has them: lenses that distort and
clouds that were filtered give more, and then the center is not trusted."""
SHARPER = 4.0
"""How many times nearer, in the median, a camera that is not at the origin must bring the points to their pixels: what
lenses and filters leave is nearly the same for both."""
ROUNDED = 0.01
"""What rounded positions may be off, pixels."""
AGREED = 0.01
"""Largest distance of the centers that two halves of the points give, as a share of their middle distance from it."""
FARTHEST = 100.0
"""How far a camera may be, as a multiple of how far its points are from their middle: from there on rays are as good as
parallel, as in maps of heights, and rounding alone says where they meet."""


class CameraPose(NamedTuple):
    """A camera in the frame of a cloud.

    Parameters
    ----------
    center : (3,) float64
        Its place, metres.
    axes : (3, 3) float64
        Rows: the image's right and down, and the middle of the view.
    """

    center: FloatArray
    axes: FloatArray


class Resected(NamedTuple):
    """The camera that fits points best.

    Parameters
    ----------
    matrix : (3, 4) or (3, 3) float64
        From positions, metres, to homogeneous pixels; without the last column, of a camera at the origin.
    off : (N,) float64
        How far each pixel is from where the camera has its position, pixels.
    side : int
        1 or -1 where the depths of all positions have this sign; else 0.
    """

    matrix: FloatArray
    off: FloatArray
    side: int

    @property
    def center(self) -> FloatArray:
        """Place of the camera, (3,), metres; NaN where it is infinitely far, as of a map of heights."""
        try:
            place: FloatArray = np.linalg.solve(self.matrix[:, :3], -self.matrix[:, 3])
        except np.linalg.LinAlgError:
            return np.full(3, np.nan)
        return place

    @property
    def axes(self) -> FloatArray:
        """Rows (3, 3): right, down and the middle of the view."""
        middle = self.side * self.matrix[2, :3]
        middle /= np.linalg.norm(middle)
        right = self.side * self.matrix[0, :3]
        right -= np.dot(right, middle) * middle
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(middle, right), middle])


def projection(cloud: Cloud) -> FloatArray | None:
    """Return the matrix (3, 4) from positions, metres, to homogeneous pixels (column, row) of an organized cloud.

    None if it shows no pinhole camera, neither one at the origin nor another.
    """
    sample = _sample(cloud)
    if sample is None:
        return None
    xyz, pixels = sample
    here = _resected(xyz, pixels)
    if here.side and np.percentile(here.off, 75.0) <= SHARP:
        return np.column_stack([here.matrix, np.zeros(3)])
    middle = xyz.mean(axis=0)
    found = _resected(np.column_stack([xyz - middle, np.ones(len(xyz))]), pixels)
    if not found.side or np.percentile(found.off, 75.0) > SHARP:
        return None
    turn = found.matrix[:, :3]
    return np.column_stack([turn, found.matrix[:, 3] - turn @ middle])


def camera_pose(cloud: Cloud) -> CameraPose | None:
    """Return where the camera of an organized cloud was, in the frame of the cloud.

    None if that is the origin, or if it does not show: the cloud has no image grid, is not from a pinhole camera, has
    hardly any relief, or was seen along parallel rays.
    """
    sample = _sample(cloud)
    if sample is None:
        return None
    xyz, pixels = sample
    at_origin = np.median(_resected(xyz, pixels).off)
    if at_origin <= ROUNDED:
        return None
    middle = xyz.mean(axis=0)
    points = np.column_stack([xyz - middle, np.ones(len(xyz))])
    found = _resected(points, pixels)
    if not found.side or np.percentile(found.off, 75.0) > SHARP:
        return None
    if at_origin <= SHARPER * np.median(found.off) + ROUNDED:
        return None
    center, halves = found.center, [_resected(points[half::2], pixels[half::2]).center for half in (0, 1)]
    if not np.linalg.norm(center) <= FARTHEST * np.median(np.linalg.norm(points[:, :3], axis=1)):
        return None
    reach = AGREED * float(np.median(np.linalg.norm(points[:, :3] - center, axis=1)))
    if not all(float(np.linalg.norm(half - center)) <= reach for half in halves):
        return None
    return CameraPose(center + middle, found.axes)


def _sample(cloud: Cloud) -> tuple[FloatArray, FloatArray] | None:
    """Return positions (N, 3) and pixels (N, 2) of some valid points of an organized cloud; None if there are few."""
    if not cloud.organized or cloud.width == 1:
        return None
    step = max(1, int(np.sqrt(len(cloud) / SAMPLE)))
    rows = (np.arange(0, cloud.height, step)[:, None] * cloud.width + np.arange(0, cloud.width, step)).ravel()
    xyz = cloud.xyz[rows].astype(np.float64)
    valid = np.isfinite(xyz).all(axis=1) & (xyz != 0.0).any(axis=1)
    rows, xyz = rows[valid], np.ascontiguousarray(xyz[valid])
    if len(rows) < FEWEST:
        return None
    pixels = np.column_stack([rows % cloud.width, rows // cloud.width]).astype(np.float64)
    return xyz, pixels


def _resected(points: FloatArray, pixels: FloatArray) -> Resected:
    """Return the camera that maps points (N, 3 or 4), metres, to pixels (N, 2) with the least algebraic error.

    Twice: the second time points count by the inverse of the depth that the first time gave them, so that errors of
    near and far pixels weigh alike.
    """
    middle = pixels.mean(axis=0)
    unit = float(np.sqrt(np.mean((pixels - middle) ** 2)))
    small = np.ascontiguousarray((pixels - middle) / max(unit, 1e-12))
    length = max(float(np.sqrt(np.mean(points[:, :3] ** 2))), 1e-12)
    scale = np.array([1.0 / length] * 3 + [1.0] * (points.shape[1] - 3))
    scaled = np.ascontiguousarray(points * scale)
    depth = np.ones(len(points))
    for _ in range(2):
        solution = np.linalg.eigh(equations(scaled, small, depth))[1][:, 0].reshape(3, -1)
        depth, off = mapped(scaled, small, solution)
    to_pixels = np.array([[unit, 0.0, middle[0]], [0.0, unit, middle[1]], [0.0, 0.0, 1.0]])
    side = int((depth > 0.0).all()) - int((depth < 0.0).all())
    return Resected(to_pixels @ solution * scale, unit * off, side)


@kernel
def equations(points: FloatArray, pixels: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the sums of products (3K, 3K) of the two linear equations that each of the points (N, K) gives.

    Points count by the inverse of their `depth` (N,).
    """
    n, k = points.shape
    sums = np.zeros((3 * k, 3 * k))
    for i in range(n):
        u, v = pixels[i]
        weight = 1.0 / max(depth[i] * depth[i], 1e-12)
        for a in range(k):
            for b in range(a + 1):
                product = weight * points[i, a] * points[i, b]
                sums[a, b] += product
                sums[2 * k + a, b] -= u * product
                sums[2 * k + a, k + b] -= v * product
                sums[2 * k + a, 2 * k + b] += (u * u + v * v) * product
    for a in range(k):
        for b in range(a + 1):
            sums[b, a] = sums[a, b]
            for block in range(3):
                sums[2 * k + b, block * k + a] = sums[2 * k + a, block * k + b]
    sums[k : 2 * k, k : 2 * k] = sums[:k, :k]
    sums[: 2 * k, 2 * k :] = sums[2 * k :, : 2 * k].T
    return sums


@kernel
def mapped(points: FloatArray, pixels: FloatArray, matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the depths of points (N, K) that a matrix (3, K) maps, and their distances from `pixels` (N, 2)."""
    n, k = points.shape
    depth, off = np.empty(n), np.empty(n)
    for i in range(n):
        u, v, w = 0.0, 0.0, 0.0
        for a in range(k):
            u += matrix[0, a] * points[i, a]
            v += matrix[1, a] * points[i, a]
            w += matrix[2, a] * points[i, a]
        depth[i] = w
        off[i] = np.hypot(u / w - pixels[i, 0], v / w - pixels[i, 1])
    return depth, off
