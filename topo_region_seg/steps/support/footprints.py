# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The points of a finite plane, those before it and those that are seen through it."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import BoolArray, FloatArray
from topo_region_seg.steps.view.scene import within_footprint

HIGH = 0.5
"""Height above a surface, metres, up to which points are in front of it."""
SEEN_THROUGH = 3.0
"""Tolerances behind a surface from which on it is seen through."""


@kernel
def weighed_scatter(
    points: FloatArray, near: FloatArray, normal: FloatArray, offset: float
) -> tuple[int, FloatArray, FloatArray]:
    """Return how many points (N, 3) are `near` (N,) a plane, m, their mean (3,) and scatter (3, 3).

    Each weighs as much as the inverse square of how near it has to be.
    """
    count, total, center, scatter, apart = 0, 0.0, np.zeros(3), np.zeros((3, 3)), np.empty(3)
    on = np.empty(len(points), np.int64)
    for i in range(len(points)):
        height = points[i, 0] * normal[0] + points[i, 1] * normal[1] + points[i, 2] * normal[2] + offset
        if abs(height) < near[i]:
            on[count] = i
            count += 1
            weight = near[i] ** -2
            total += weight
            for c in range(3):
                center[c] += weight * points[i, c]
    center /= total
    for k in range(count):
        i = on[k]
        for c in range(3):
            apart[c] = (points[i, c] - center[c]) / near[i]
        for a in range(3):
            for b in range(3):
                scatter[a, b] += apart[a] * apart[b]
    return count, center, scatter


@kernel
def seen_around(
    points: FloatArray,
    near: FloatArray,
    normal: FloatArray,
    offset: float,
    center: FloatArray,
    axes: FloatArray,
    hull: FloatArray,
) -> tuple[int, int]:
    """Return how many of the points (N, 3) are in front of a footprint, and how many are seen through it."""
    front, through, place = 0, 0, np.empty((1, 3))
    for i in range(len(points)):
        along = points[i, 0] * normal[0] + points[i, 1] * normal[1] + points[i, 2] * normal[2]
        height = along + offset
        before = height > near[i] and height < HIGH
        ray = -offset / min(along, -1e-9)  # where the line of sight meets the plane
        behind = height < -SEEN_THROUGH * near[i] and 0.0 < ray < 1.0
        if before or behind:
            for c in range(3):
                place[0, c] = points[i, c] * (1.0 if before else ray)
            if within_footprint(place, 0, center, axes, hull, 0.0):
                front += before
                through += behind
    return front, through


@kernel
def outside_polygon(flat: FloatArray, sides: FloatArray, margin: float) -> BoolArray:
    """Return which points (N, 2) are outside a convex polygon, or less than `margin` inside; its `sides` are (K, 3)."""
    outside = np.zeros(len(flat), np.bool_)
    for i in range(len(flat)):
        for k in range(len(sides)):
            if sides[k, 0] * flat[i, 0] + sides[k, 1] * flat[i, 1] + sides[k, 2] > -margin:
                outside[i] = True
                break
    return outside
