# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How boxes are turned: upright ones about the vertical, free ones until their volume is small.

Neither needs more of a region than its outermost points in a few directions: among these are the corners of a box,
however it is turned.
"""

from __future__ import annotations

import numpy as np

from topo_region_seg.beyond.boxes.rectangles import fitting_rectangle, smallest_rectangle
from topo_region_seg.compiled.dialect import index, kernel
from topo_region_seg.data import FloatArray, IntArray

AROUND = 8
"""Directions in which the outermost points of an upright box are looked for, over half a turn."""
RIM = 256
"""About how many points tell which of several rectangles fits."""
TURNS = 96
"""Rotations that a free box is tried in."""
STARTS = 2
"""How many of these are made better."""
ROUNDS = 6
"""How often all three axes are turned at the most."""
PAD = 0.01
"""Share of the largest extent that is added to each size, so that a thin box is not turned for its thickness alone."""
FLAT = 0.1
"""Ratio of the standard deviations across and along a surface below which its points tell how it lies."""
NEAR, REFINEMENTS = 1.5, 4
"""Deviations from a flat surface up to which points count for its normal, and how often that is taken again: what
stands off from it, such as the rim of a board, must not turn it."""
THIN = 0.01
"""Part of the deviation along a surface that is always near enough."""

_EVERY = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)], np.float64)[14:]
OUTWARD: FloatArray = _EVERY / np.linalg.norm(_EVERY, axis=1)[:, None]
"""Half of the directions to the faces, edges and corners of a cube, (13, 3): one is in each octant of every box."""


def _rotations(count: int) -> FloatArray:
    """Return rotations (count, 3, 3) that are spread over all there are; rows are axes."""
    w, x, y, z = (q := np.random.default_rng(0).normal(size=(4, count))) / np.linalg.norm(q, axis=0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.ascontiguousarray(np.array(rows).transpose(2, 0, 1))


ROTATIONS = _rotations(TURNS)


def upright_frames(points: FloatArray, start: IntArray, up: FloatArray) -> FloatArray:
    """Return the axes of upright boxes around regions, (M, 3, 3): rows are two horizontal axes and `up`.

    Parameters
    ----------
    points : (N, 3) float64
        Points, region after region.
    start : (M + 1,) int64
        Those of region i are the rows ``start[i]:start[i + 1]``, at least one.
    up : (3,) float64
        Unit vector.
    """
    u = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    u /= np.linalg.norm(u)
    basis = np.stack([u, np.cross(up, u), up])
    angle = np.arange(AROUND) * np.pi / AROUND
    directions = np.column_stack([np.cos(angle), np.sin(angle)]) @ basis[:2]
    return turned_upright(points, start, basis, np.ascontiguousarray(basis[:2].T), directions)


def free_frames(points: FloatArray, start: IntArray) -> FloatArray:
    """Return the axes of boxes of small volume around regions, (M, 3, 3): rows are axes.

    Parameters are those of `upright_frames`.
    """
    if len(start) == 1:
        return np.empty((0, 3, 3))
    everywhere = np.full(len(start) - 1, np.inf)
    axes, deviations = _principal(points, start, np.zeros((len(start) - 1, 2, 3)), everywhere)
    flat = deviations[:, 0] <= FLAT * deviations[:, 1]
    for _ in range(REFINEMENTS if flat.any() else 0):
        near = np.where(flat, NEAR * deviations[:, 0] + THIN * deviations[:, 1], np.inf)
        axes, deviations = _principal(points, start, axes[:, [0, 3]], near)
    return turned_freely(points, start, axes[:, :3].copy(), flat, ROTATIONS, OUTWARD)


def _principal(
    points: FloatArray, start: IntArray, plane: FloatArray, near: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the principal axes and the mean of each region, rows of (M, 4, 3), and the deviations along them (M, 3).

    They are those of the points at most `near` (M,), metres, from a plane: rows of `plane` (M, 2, 3) are its normal and
    a point on it. The least deviation comes first.
    """
    mean, scatter = scatters(points, start, np.ascontiguousarray(plane), near)
    squares, vectors = np.linalg.eigh(scatter)
    axes = np.concatenate([vectors.transpose(0, 2, 1), mean[:, None]], axis=1)
    return axes, np.sqrt(np.maximum(squares, 0.0))


@kernel
def scatters(points: FloatArray, start: IntArray, plane: FloatArray, near: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean (M, 3) and covariance (M, 3, 3) of the points of each region that are near a plane, as above."""
    means, result = np.zeros((len(near), 3)), np.zeros((len(near), 3, 3))
    for r in range(len(result)):
        first, last = start[r], start[r + 1]
        normal, origin, mean, covariance = plane[r, 0], plane[r, 1], means[r], result[r]
        count = 0
        for turn in range(2):
            for i in range(first, last):
                apart = 0.0
                for c in range(3):
                    apart += (points[i, c] - origin[c]) * normal[c]
                if abs(apart) > near[r]:
                    continue
                if turn == 0:
                    count += 1
                    for c in range(3):
                        mean[c] += points[i, c]
                    continue
                for a in range(3):
                    for b in range(3):
                        covariance[a, b] += (points[i, a] - mean[a]) * (points[i, b] - mean[b])
            if turn == 0:
                for c in range(3):
                    mean[c] /= max(count, 1)
        for a in range(3):
            for b in range(3):
                covariance[a, b] /= max(count, 1)
    return means, result


@kernel
def outermost(points: FloatArray, first: int, last: int, directions: FloatArray) -> FloatArray:
    """Return the points (2 D, 3), of the rows from `first` to `last`, outermost in directions (D, 3), both ways."""
    n = len(directions)
    least, most = np.full(n, np.inf), np.full(n, -np.inf)
    low, high = np.zeros(n, np.int64), np.zeros(n, np.int64)
    for i in range(first, last):
        x, y, z = points[index(i), 0], points[index(i), 1], points[index(i), 2]
        for direction in range(n):
            d = index(direction)
            along = x * directions[d, 0] + y * directions[d, 1] + z * directions[d, 2]
            if along < least[d]:
                least[d], low[d] = along, i
            if along > most[d]:
                most[d], high[d] = along, i
    found = np.empty((2 * n, 3))
    for d in range(n):
        for c in range(3):
            found[2 * d, c], found[2 * d + 1, c] = points[low[d], c], points[high[d], c]
    return found


@kernel
def turned_upright(
    points: FloatArray, start: IntArray, basis: FloatArray, level: FloatArray, directions: FloatArray
) -> FloatArray:
    """Return the axes (M, 3, 3) of upright boxes.

    `basis` has two horizontal axes and the vertical one as rows, `level` (3, 2) the former as columns.
    """
    axes = np.empty((len(start) - 1, 3, 3))
    for r in range(len(axes)):
        corners = outermost(points, start[r], start[r + 1], directions)
        step = max(1, (start[r + 1] - start[r]) // RIM)
        some = projected(points, start[r], start[r + 1], step, level)
        x, y = fitting_rectangle(projected(corners, 0, len(corners), 1, level), some, 0.0)
        for c in range(3):
            axes[r, 0, c] = x * basis[0, c] + y * basis[1, c]
            axes[r, 1, c] = x * basis[1, c] - y * basis[0, c]
            axes[r, 2, c] = basis[2, c]
    return axes


@kernel
def turned_freely(
    points: FloatArray,
    start: IntArray,
    principal: FloatArray,
    flat: np.ndarray,
    rotations: FloatArray,
    directions: FloatArray,
) -> FloatArray:
    """Return the axes (M, 3, 3) of boxes of small volume; `flat` regions (M,) keep their first principal axis."""
    axes = np.empty((len(start) - 1, 3, 3))
    for r in range(len(axes)):
        corners = outermost(points, start[r], start[r + 1], directions)
        pad = 0.0
        for i in range(len(corners)):
            for c in range(3):
                pad = max(pad, PAD * (corners[i, c] - corners[0, c]))
        frame = principal[r].copy()
        size = turned_about(corners, frame, 0, pad)
        if not flat[r]:
            size = improved(corners, frame, size, pad)
            for start_frame in good_starts(corners, rotations, pad):
                other = rotations[start_frame].copy()
                found = improved(corners, other, np.inf, pad)
                if found < size:
                    size, frame = found, other
        for a in range(3):
            for c in range(3):
                axes[r, a, c] = frame[a, c]
    return axes


@kernel
def good_starts(corners: FloatArray, rotations: FloatArray, pad: float) -> IntArray:
    """Return the rotations, rows of `rotations`, in which the box around a few points is smallest."""
    size = np.empty(len(rotations))
    for k in range(len(rotations)):
        size[k] = 1.0
        for a in range(3):
            low, high = np.inf, -np.inf
            x, y, z = rotations[k, a, 0], rotations[k, a, 1], rotations[k, a, 2]
            for i in range(len(corners)):
                along = x * corners[i, 0] + y * corners[i, 1] + z * corners[i, 2]
                low, high = min(low, along), max(high, along)
            size[k] *= high - low + pad
    best = np.empty(STARTS, np.int64)
    for s in range(STARTS):
        best[s] = np.argmin(size)
        size[best[s]] = np.inf
    return best


@kernel
def improved(corners: FloatArray, frame: FloatArray, size: float, pad: float) -> float:
    """Turn the axes, rows of `frame`, about each of them until the box is no longer made smaller; return its size."""
    for _ in range(ROUNDS):
        before = size
        for axis in range(3):
            size = turned_about(corners, frame, axis, pad)
        if size > before * (1.0 - 1e-6):
            break
    return size


@kernel
def turned_about(corners: FloatArray, frame: FloatArray, axis: int, pad: float) -> float:
    """Turn the other two axes, rows of `frame`, about one to the smallest rectangle; return the size of the box."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    flat = np.empty((3, 2))
    for c in range(3):
        flat[c, 0], flat[c, 1] = frame[a, c], frame[b, c]
    x, y, area = smallest_rectangle(projected(corners, 0, len(corners), 1, flat), pad)
    low, high = np.inf, -np.inf
    for i in range(len(corners)):
        along = corners[i, 0] * frame[axis, 0] + corners[i, 1] * frame[axis, 1] + corners[i, 2] * frame[axis, 2]
        low, high = min(low, along), max(high, along)
    for c in range(3):
        p, q = frame[a, c], frame[b, c]
        frame[a, c], frame[b, c] = x * p + y * q, x * q - y * p
    return area * (high - low + pad)


@kernel
def projected(points: FloatArray, first: int, last: int, step: int, flat: FloatArray) -> FloatArray:
    """Return every so manieth point of some rows in the plane of two axes, the columns of `flat` (3, 2)."""
    result = np.empty(((last - first + step - 1) // step, 2))
    for k in range(len(result)):
        i = first + k * step
        for a in range(2):
            result[k, a] = points[i, 0] * flat[0, a] + points[i, 1] * flat[1, a] + points[i, 2] * flat[2, a]
    return result
