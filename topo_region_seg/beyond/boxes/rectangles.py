# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The smallest rectangle around points in a plane: one of its sides lies along the convex hull."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import inlined, kernel
from topo_region_seg.data import FloatArray

ALIKE = 1.02
"""How many times as large as the smallest a rectangle may be to be taken all the same, if the points fill its rim."""


@kernel
def convex_hull(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of a few points (K, 2), counterclockwise; fewer than 3 if it is no area."""
    n = len(points)
    order = np.arange(n)
    for i in range(1, n):
        row, k = order[i], i
        while k > 0 and _after(points, order[k - 1], row):
            order[k] = order[k - 1]
            k -= 1
        order[k] = row
    hull = np.empty((2 * n, 2))
    count = 0
    for i in range(n):
        while count >= 2 and _turn(hull, count, points, order[i]) <= 0.0:
            count -= 1
        hull[count, 0], hull[count, 1] = points[order[i], 0], points[order[i], 1]
        count += 1
    lower = count
    for i in range(n - 2, -1, -1):
        while count > lower and _turn(hull, count, points, order[i]) <= 0.0:
            count -= 1
        hull[count, 0], hull[count, 1] = points[order[i], 0], points[order[i], 1]
        count += 1
    found: FloatArray = hull[: max(count - 1, min(n, 1))].copy()  # the last one is the first again
    return found


@inlined
def _after(points, a, b):  # type: ignore[no-untyped-def]
    return points[a, 0] > points[b, 0] or (points[a, 0] == points[b, 0] and points[a, 1] > points[b, 1])


@inlined
def _turn(hull, count, points, p):  # type: ignore[no-untyped-def]
    """Return how far a point lies to the left of the line through the last two corners, times their distance."""
    x, y = hull[count - 2, 0], hull[count - 2, 1]
    return (hull[count - 1, 0] - x) * (points[p, 1] - y) - (hull[count - 1, 1] - y) * (points[p, 0] - x)


@inlined
def _bounds(hull, x, y):  # type: ignore[no-untyped-def]
    """Return the bounds of a hull along the direction (x, y), and along the one a quarter turn further."""
    low_a, high_a, low_b, high_b = np.inf, -np.inf, np.inf, -np.inf
    for k in range(len(hull)):
        a, b = x * hull[k, 0] + y * hull[k, 1], x * hull[k, 1] - y * hull[k, 0]
        low_a, high_a, low_b, high_b = min(low_a, a), max(high_a, a), min(low_b, b), max(high_b, b)
    return low_a, high_a, low_b, high_b


@kernel
def sides_of(hull: FloatArray, pad: float) -> tuple[FloatArray, FloatArray]:
    """Return the directions of a hull's sides (S, 2), and the size of the rectangle along each (S,).

    The size is the area of the rectangle with `pad` (m) added to either side, so that of two without width the shorter
    is the smaller one. There is at least one side.
    """
    n = len(hull)
    direction, size = np.empty((max(n, 1), 2)), np.empty(max(n, 1))
    count = 0
    for i in range(n):
        x, y = hull[(i + 1) % n, 0] - hull[i, 0], hull[(i + 1) % n, 1] - hull[i, 1]
        length = np.sqrt(x * x + y * y)
        if length == 0.0:
            continue
        x, y = x / length, y / length
        low_a, high_a, low_b, high_b = _bounds(hull, x, y)
        direction[count, 0], direction[count, 1] = x, y
        size[count] = (high_a - low_a + pad) * (high_b - low_b + pad)
        count += 1
    if count == 0:
        direction[0, 0], direction[0, 1], size[0] = 1.0, 0.0, pad * pad
        count = 1
    return direction[:count].copy(), size[:count].copy()


@kernel
def smallest_rectangle(points: FloatArray, pad: float) -> tuple[float, float, float]:
    """Return the direction (x, y) of a side of the smallest rectangle around a few points (K, 2), and its size."""
    direction, size = sides_of(convex_hull(points), pad)
    best = np.argmin(size)
    return direction[best, 0], direction[best, 1], size[best]


@kernel
def fitting_rectangle(corners: FloatArray, points: FloatArray, pad: float) -> tuple[float, float]:
    """Return the direction (x, y) of a side of the rectangle that fits points (N, 2) with outermost `corners` (K, 2).

    Two sides of a box alone, seen from above, have two smallest rectangles: along the sides, and along the line that
    joins their ends. Of rectangles alike in size that one is taken whose rim the points are nearest to.
    """
    hull = convex_hull(corners)
    direction, size = sides_of(hull, pad)
    limit, best, least = ALIKE * size[np.argmin(size)], 0, np.inf
    for k in range(len(size)):
        if size[k] > limit:
            continue
        x, y = direction[k, 0], direction[k, 1]
        low_a, high_a, low_b, high_b = _bounds(hull, x, y)
        apart = 0.0
        for i in range(len(points)):
            a, b = x * points[i, 0] + y * points[i, 1], x * points[i, 1] - y * points[i, 0]
            apart += min(min(a - low_a, high_a - a), min(b - low_b, high_b - b))
        apart = apart / len(points) + 1e-9 * size[k]  # of those as near, the smaller one
        if apart < least:
            least, best = apart, k
    return direction[best, 0], direction[best, 1]
