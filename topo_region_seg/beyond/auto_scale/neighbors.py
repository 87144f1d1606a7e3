# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Nearest points in the image of a camera where there is no image grid, by cells.

A tree over all points would take longer than all that is asked of it, as only some points are asked about.
"""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.compiled.dialect import inlined, kernel
from topo_region_seg.compiled.nearest import comes_before
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.steps.view.camera import pictured

PER_CELL = 6  # points of a cell, if they were spread evenly
OUTLYING = 0.01
"""Share of the points at each side of the image that go to the cells at the edge, however far out they are."""
ROUNDING = 1e-9
"""Distance in the image, radians, below which points are at one place."""
MOST = 4_096
"""Points per query, on average, that may be looked at."""


def window_of(image: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the corners (2,) of the part of the image that is divided into cells, from some of its points (S, 2)."""
    low, high = np.quantile(image, (OUTLYING, 1.0 - OUTLYING), axis=0)
    return low, high


@kernel
def image_neighbors(
    xyz: FloatArray, axes: FloatArray, some: IntArray, low: FloatArray, high: FloatArray, k: int
) -> tuple[FloatArray, FloatArray, int]:
    """Return how far the nearest other point is in the image, (S,), and how far k points around are from a plane, (S,).

    Both are of each of `some` (S,) of the points (N, 3), N at least k. The second is the sum of the squares that are
    left of the inverse depths of the k nearest points, the point among them, fitted by a linear function of the place
    in the image. The third result is how many points were looked at. Beyond MOST for each of `some` the search is given
    up, and the others are empty.
    """
    n = len(xyz)
    width, height = high[0] - low[0], high[1] - low[1]
    edge = max(math.sqrt(width * height * PER_CELL / n), max(width, height) / n, 1e-12)
    columns, rows = int(min(width / edge, n)) + 1, int(min(height / edge, n)) + 1
    picture = np.empty((n, 3))
    cell = np.empty(n, np.int64)
    begins = np.zeros(columns * rows + 1, np.int64)
    for i in range(n):
        picture[i, 0], picture[i, 1], picture[i, 2] = pictured(xyz, i, axes)
        cell[i] = slot(picture[i, 1], low[1], edge, rows) * columns + slot(picture[i, 0], low[0], edge, columns)
        begins[cell[i] + 1] += 1
    for c in range(columns * rows):
        begins[c + 1] += begins[c]
    filled, points = begins[:-1].copy(), np.empty((n, 3))
    for i in range(n):
        points[filled[cell[i]]] = picture[i]
        filled[cell[i]] += 1
    nearest, bends = np.empty(len(some)), np.empty(len(some))
    near_d2, near, looked = np.empty(k), np.empty(k, np.int64), 0
    for s in range(len(some)):
        u, v = picture[some[s], 0], picture[some[s], 1]
        found, ring = 0, 0
        column, row = slot(u, low[0], edge, columns), slot(v, low[1], edge, rows)
        # What lies outside of `ring` rings of cells is at least as far away as these are wide, also where it was put
        # into the cells at the edge.
        while found < k or near_d2[k - 1] > (max(ring - 1, 0) * edge) ** 2:
            for r in range(max(row - ring, 0), min(row + ring, rows - 1) + 1):
                step = 1 if abs(r - row) == ring else max(2 * ring, 1)
                for c in range(column - ring, column + ring + 1, step):
                    if not 0 <= c < columns:
                        continue
                    here = r * columns + c
                    looked += begins[here + 1] - begins[here]
                    if looked > MOST * len(some):
                        return nearest[:0], bends[:0], looked
                    for other in range(begins[here], begins[here + 1]):
                        d2 = (points[other, 0] - u) ** 2 + (points[other, 1] - v) ** 2
                        if found < k or d2 <= near_d2[k - 1]:
                            found = insert(points, near_d2, near, d2, other, found)
            ring += 1
            if ring > columns and ring > rows:
                break
        nearest[s] = math.sqrt(near_d2[1])
        bends[s] = off_plane(points, near, u, v, max(math.sqrt(near_d2[k - 1]), ROUNDING))
    return nearest, bends, looked


@inlined
def slot(value, low, edge, count):  # type: ignore[no-untyped-def]
    """Return in which of `count` intervals of width `edge` from `low` on a value lies; the nearest, if in none."""
    return int(min(max((value - low) / edge, 0.0), count - 1.0))


@inlined
def insert(points, near_d2, near, d2, other, found):  # type: ignore[no-untyped-def]
    """Insert a point among the nearest ones, of which the last drops out if there are enough; return how many.

    Points equally far come in the order of their coordinates, so that the order of the points does not matter.
    """
    place = found
    while place > 0 and (
        d2 < near_d2[place - 1] or (d2 == near_d2[place - 1] and comes_before(points, other, near[place - 1]))
    ):
        place -= 1
        if place + 1 < len(near):
            near_d2[place + 1], near[place + 1] = near_d2[place], near[place]
    if place < len(near):
        near_d2[place], near[place] = d2, other
    return min(found + 1, len(near))


@kernel
def off_plane(points, near, u, v, unit):  # type: ignore[no-untyped-def]
    """Return the sum of squares that is left of the third column of some points, fitted linearly by the first two.

    Places are taken from (u, v) in a `unit`.
    """
    a = np.zeros((3, 3))
    b = np.zeros(3)
    x = np.ones(3)
    scale = 1.0 / unit
    for place in near:
        x[0], x[1] = (points[place, 0] - u) * scale, (points[place, 1] - v) * scale
        for i in range(3):
            b[i] += x[i] * points[place, 2]
            for j in range(3):
                a[i, j] += x[i] * x[j]
    # Rows whose pivot is rounding, as of points on a line, say nothing, and count as zero.
    for p in range(3):
        i = 2 - p
        for j in range(i):
            factor = a[j, i] / a[i, i] if a[i, i] > 1e-9 * len(near) else 0.0
            for c in range(3):
                a[j, c] -= factor * a[i, c]
            b[j] -= factor * b[i]
    for i in range(3):
        for j in range(i):
            b[i] -= a[i, j] * b[j]
        b[i] = b[i] / a[i, i] if a[i, i] > 1e-9 * len(near) else 0.0
    rest = 0.0
    for place in near:
        fitted = (points[place, 0] - u) * scale * b[0] + (points[place, 1] - v) * scale * b[1] + b[2]
        rest += (points[place, 2] - fitted) ** 2
    return rest
