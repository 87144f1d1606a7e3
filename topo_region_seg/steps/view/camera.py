# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Points as a camera sees them: depths, the pixel's angle and the noise, and coordinates in which lengths grow.

Kernels, as numpy's products of matrices keep threads of their own, which then wait busily where ours want to run.
"""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import BoolArray, FloatArray, IntArray

WIDEST = 60.0
"""Angle from the middle of the view, degrees, up to which a cloud is taken for a camera's."""
NEAREST = 0.05
"""Least distance of a camera's point, metres."""
STRAY = 0.02
"""Share of the points that may be nearer, or farther off the middle of the view, than a camera's points are."""


def strays_of(sample: FloatArray, axes: FloatArray | None = None) -> tuple[FloatArray, BoolArray]:
    """Return the axes (3, 3) of the camera that saw a sample of points (N, 3), metres, and which of these it could not.

    The rows of the axes are the image's right, down, and the middle of the view; where they are not given, those of the
    sensor if it looks along z.
    """
    distance = np.maximum(np.linalg.norm(sample, axis=1), 1e-12)
    if axes is None:
        axes = _axes(sample / distance[:, None])
    depth = seen_from(sample, axes)[:, 2]
    strays: BoolArray = (distance < NEAREST) | (depth < distance * math.cos(math.radians(WIDEST)))
    return axes, strays


def camera_axes(sample: FloatArray) -> FloatArray | None:
    """Return the axes (3, 3) of the camera that saw a sample of points (N, 3), metres; None if no camera did."""
    if len(sample) < 2:
        return None
    axes, strays = strays_of(sample)
    return None if np.mean(strays) > STRAY else axes


def _axes(directions: FloatArray) -> FloatArray:
    """Return the axes whose third is the middle of the view; those of the sensor where that looks along z."""
    middle = directions.mean(axis=0)
    middle /= max(float(np.linalg.norm(middle)), 1e-12)
    if middle[2] > math.cos(math.radians(WIDEST / 2.0)):
        return np.eye(3)
    side = np.cross(middle, np.eye(3)[int(np.argmin(np.abs(middle)))])
    side /= np.linalg.norm(side)
    return np.array([side, np.cross(middle, side), middle])


@kernel
def seen_from(xyz: FloatArray, axes: FloatArray) -> FloatArray:
    """Return positions (N, 3) in the frame whose axes are the rows of `axes` (3, 3)."""
    seen = np.empty((len(xyz), 3))
    for i in range(len(xyz)):
        for a in range(3):
            seen[i, a] = axes[a, 0] * xyz[i, 0] + axes[a, 1] * xyz[i, 1] + axes[a, 2] * xyz[i, 2]
    return seen


@kernel
def growths(xyz: FloatArray, axis: FloatArray, depth: float, least: float) -> FloatArray:
    """Return the depth of points (N, 3) along `axis` (3,) as a multiple of `depth`, (N,); at least `least`."""
    growth = np.empty(len(xyz))
    for i in range(len(xyz)):
        z = axis[0] * xyz[i, 0] + axis[1] * xyz[i, 1] + axis[2] * xyz[i, 2]
        growth[i] = max(z / depth, least)
    return growth


@kernel
def evened(xyz: FloatArray, axes: FloatArray, depth: float) -> FloatArray:
    """Return positions (N, 3) in a camera's frame, but beyond `depth` in (x/z, y/z, ln z) times `depth`.

    The one goes over into the other without a step.
    """
    even = seen_from(xyz, axes)
    for i in range(len(even)):
        growth = even[i, 2] / depth
        if growth > 1.0:
            even[i, 0] /= growth
            even[i, 1] /= growth
            even[i, 2] = depth * (1.0 + math.log(growth))
    return even


@kernel
def grid_figures(
    xyz: FloatArray, rows: IntArray, width: int, axes: FloatArray, apart: int, step: int
) -> tuple[FloatArray, FloatArray]:
    """Return angles (A,) between pixels beside each other, and bends (B,), 1/m, of lines in the image.

    A bend is how far the inverse depths of three points, each `apart` pixels from the next in a row of the image, are
    from equal steps, as on a plane they are. Of the points (N, 3), at pixels `rows` (N,), every `step`-th is looked at.
    """
    n = len(xyz)
    angles, bends = np.empty(n // step + 1), np.empty(n // step + 1)
    n_angles, n_bends = 0, 0
    for i in range(0, n - 1, step):
        column = rows[i] % width
        u, v, inverse = pictured(xyz, i, axes)
        if rows[i + 1] == rows[i] + 1 and column + 1 < width:
            u_next, v_next, _ = pictured(xyz, i + 1, axes)
            angles[n_angles] = math.hypot(u_next - u, v_next - v)
            n_angles += 1
        middle, far = i + apart, i + 2 * apart
        if far < n and rows[far] == rows[i] + 2 * apart and column + 2 * apart < width:
            _, _, inverse_middle = pictured(xyz, middle, axes)
            _, _, inverse_far = pictured(xyz, far, axes)
            bends[n_bends] = abs(inverse - 2.0 * inverse_middle + inverse_far)
            n_bends += 1
    return angles[:n_angles].copy(), bends[:n_bends].copy()


@kernel
def pictured(xyz, i, axes):  # type: ignore[no-untyped-def]
    """Return where a point is in the image at depth 1, and its inverse depth."""
    x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
    inverse = 1.0 / (axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z)
    u = (axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z) * inverse
    v = (axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z) * inverse
    return u, v, inverse
