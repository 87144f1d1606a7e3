# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Points sorted by region, and how far they reach along the axes of their boxes."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray, IntArray

STRAY = 0.002
"""Share of a region's points that may lie outside of its box at either end of each axis."""
BINS = 1024
"""Steps in which the ends are looked for: an end is found within this part of the whole extent."""


@kernel
def sorted_by_row(xyz: FloatArray, row: IntArray, n_rows: int) -> tuple[FloatArray, IntArray]:
    """Return the points (K, 3) whose row is not below 0, row after row, and where each row begins, (M + 1,)."""
    start = np.zeros(n_rows + 1, np.int64)
    for i in range(len(row)):
        if row[i] >= 0:
            start[row[i] + 1] += 1
    for r in range(n_rows):
        start[r + 1] += start[r]
    place = start[:-1].copy()
    points = np.empty((start[-1], 3))
    for i in range(len(row)):
        if row[i] >= 0:
            k = place[row[i]]
            for c in range(3):
                points[k, c] = xyz[i, c]
            place[row[i]] += 1
    return points, start


@kernel
def extents(points: FloatArray, start: IntArray, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the ends of each region along its axes, (M, 3) twice, strays left out.

    `axes` (M, 3, 3) holds the axes of each region's box as rows.
    """
    low, high = np.empty((len(axes), 3)), np.empty((len(axes), 3))
    count = np.empty(BINS, np.int64)
    for r in range(len(axes)):
        first, last = start[r], start[r + 1]
        along = np.empty(last - first)
        strays = int(STRAY * (last - first))
        for a in range(3):
            x, y, z = axes[r, a, 0], axes[r, a, 1], axes[r, a, 2]
            least, most = np.inf, -np.inf
            for i in range(first, last):
                value = x * points[i, 0] + y * points[i, 1] + z * points[i, 2]
                along[i - first] = value
                least, most = min(least, value), max(most, value)
            if strays > 0 and most > least:
                width = (most - least) / BINS
                count[:] = 0
                for i in range(last - first):
                    count[min(BINS - 1, int((along[i] - least) / width))] += 1
                left, right, below, above = 0, BINS, count[0], count[BINS - 1]
                while below <= strays:
                    left += 1
                    below += count[left]
                while above <= strays:
                    right -= 1
                    above += count[right - 1]
                least, most = least + left * width, least + right * width
            low[r, a], high[r, a] = least, most
    return low, high
