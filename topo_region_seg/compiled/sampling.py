# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A sample of points that does not depend on their order."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray, IntArray


@kernel
def sample_rows(xyz: FloatArray, size: int, seed: int) -> IntArray:
    """Return about `size` rows, those with the smallest hashes of their coordinates, in the order of the hashes.

    The sample depends on the points alone, not on their order.
    """
    limit = np.float64(size) / max(len(xyz), size)
    hashes = np.empty(len(xyz))
    rows = np.empty(len(xyz), np.int64)
    count = 0
    for i in range(len(xyz)):
        value = np.uint64(seed)
        for c in range(3):
            value = (value ^ np.float64(xyz[i, c]).view(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
            value ^= value >> np.uint64(29)
        value = (value * np.uint64(0xBF58476D1CE4E5B9)) ^ (value >> np.uint64(32))
        share = np.float64(value >> np.uint64(11)) * 2.0**-53
        if share <= limit:
            hashes[count], rows[count] = share, i
            count += 1
    return rows[:count][np.argsort(hashes[:count])]
