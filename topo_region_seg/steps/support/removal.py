# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What is left of a cloud without its support plane and what lies behind it."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray, IntArray, Plane


def above(xyz: FloatArray, plane: Plane, distance: float) -> IntArray:
    """Return the rows of `xyz` that lie more than `distance` (m) in front of the plane, on the sensor's side."""
    return rows_above(np.asfortranarray(xyz), np.array(plane.normal), plane.offset, distance)


@kernel
def rows_above(xyz: FloatArray, normal: FloatArray, offset: float, distance: float) -> IntArray:
    """Return the rows (M,) more than `distance` (m) in front of the plane ``normal · x + offset = 0``."""
    rows = np.empty(len(xyz), np.int64)
    count = 0
    u, v, w = normal[0], normal[1], normal[2]
    for i in range(len(xyz)):
        rows[count] = i
        height = u * xyz[i, 0] + v * xyz[i, 1] + w * xyz[i, 2] + offset
        count += 1 if height > distance else 0
    kept: IntArray = rows[:count].copy()
    return kept
