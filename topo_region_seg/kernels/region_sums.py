# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Sums over the points of each region."""

from __future__ import annotations

import numpy as np

from topo_region_seg.data import FloatArray, IntArray, LabelArray
from topo_region_seg.kernels.compile import index, kernel


@kernel
def region_sums(
    labels: LabelArray,
    weight: IntArray,
    xyz: FloatArray,
    lab: FloatArray,
    normals: FloatArray,
    death: FloatArray,
    n_regions: int,
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return size (R,), weighted sums (R, 9), box corners (R, 3) twice, and the last scale of growth (R,).

    Sums are of position, color and normal; normals that are NaN are left out.
    """
    size = np.zeros(n_regions, np.int64)
    sums = np.zeros((n_regions, 9))
    low = np.full((n_regions, 3), np.inf)
    high = np.full((n_regions, 3), -np.inf)
    growth = np.zeros(n_regions)
    for i in range(len(labels)):
        if labels[i] == 0:
            continue
        r = index(np.int64(labels[i]) - 1)
        size[r] += weight[i]
        for c in range(3):
            sums[r, c] += weight[i] * xyz[i, c]
            sums[r, 3 + c] += weight[i] * lab[i, c]
            if not np.isnan(normals[i, c]):
                sums[r, 6 + c] += weight[i] * normals[i, c]
            low[r, c] = min(low[r, c], xyz[i, c])
            high[r, c] = max(high[r, c], xyz[i, c])
        if death[i] < np.inf:
            growth[r] = max(growth[r], death[i])
    return size, sums, low, high, growth
