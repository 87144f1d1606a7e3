# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Some rows of a cloud's positions, gathered in one pass."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray, IntArray


@kernel
def gather_columns(xyz: npt.NDArray[np.floating], rows: IntArray, origin: FloatArray) -> FloatArray:
    """Return some rows of positions (N, 3) from `origin` (3,), in double precision, column by column in memory."""
    columns = np.empty((3, len(rows)))
    for i in range(len(rows)):
        row = rows[i]
        for c in range(3):
            columns[c, i] = xyz[row, c] - origin[c]
    points: FloatArray = columns.T
    return points


@kernel
def gather(xyz: FloatArray, rows: IntArray) -> FloatArray:
    """Return some rows of positions (N, 3), row by row in memory."""
    points = np.empty((len(rows), 3))
    for i in range(len(rows)):
        row = rows[i]
        for c in range(3):
            points[i, c] = xyz[row, c]
    return points
