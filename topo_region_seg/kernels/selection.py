# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Selections of points by distance from the sensor and from a plane."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.kernels.borrow import borrowed
from topo_region_seg.kernels.compile import index, kernel


@kernel
def rows_in_range(xyz: npt.NDArray[np.floating], near: float, far: float, drop_zeros: bool) -> IntArray:
    """Return the rows (M,) at a distance within [near, far], metres; what is not finite is not in range."""
    xyz = borrowed(xyz)
    rows = np.empty(len(xyz), np.int64)
    count = 0
    for i in range(len(xyz)):
        x, y, z = np.float64(xyz[i, 0]), np.float64(xyz[i, 1]), np.float64(xyz[i, 2])
        range2 = x * x + y * y + z * z
        rows[index(count)] = i
        # False for NaN.
        keep = (range2 <= far * far) & (range2 >= near * near) & ((range2 > 0.0) | (not drop_zeros))
        count += 1 if keep else 0
    kept: IntArray = rows[:count].copy()
    return kept


@kernel
def gather_columns(xyz: npt.NDArray[np.floating], rows: IntArray) -> FloatArray:
    """Return some rows of positions (N, 3) in double precision, column by column in memory."""
    xyz, rows = borrowed(xyz), borrowed(rows)
    columns = np.empty((3, len(rows)))
    for i in range(len(rows)):
        row = index(rows[i])
        for c in range(3):
            columns[c, i] = xyz[row, c]
    points: FloatArray = columns.T
    return points


@kernel
def gather(xyz: FloatArray, rows: IntArray) -> FloatArray:
    """Return some rows of positions (N, 3), row by row in memory."""
    xyz, rows = borrowed(xyz), borrowed(rows)
    points = np.empty((len(rows), 3))
    for i in range(len(rows)):
        row = index(rows[i])
        for c in range(3):
            points[i, c] = xyz[row, c]
    return points


@kernel
def rows_above(xyz: FloatArray, normal: FloatArray, offset: float, distance: float) -> IntArray:
    """Return the rows (M,) more than `distance` (m) in front of the plane ``normal · x + offset = 0``."""
    xyz = borrowed(xyz)
    rows = np.empty(len(xyz), np.int64)
    count = 0
    u, v, w = normal[0], normal[1], normal[2]
    for i in range(len(xyz)):
        rows[index(count)] = i
        height = u * xyz[i, 0] + v * xyz[i, 1] + w * xyz[i, 2] + offset
        count += 1 if height > distance else 0
    kept: IntArray = rows[:count].copy()
    return kept
