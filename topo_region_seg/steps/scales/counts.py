# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How many regions each scale of a filtration has."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import IntArray


@kernel
def region_counts(parent: IntArray, order: IntArray, weight: IntArray, min_size: int) -> tuple[IntArray, IntArray]:
    """Return the number of components of at least `min_size`, and the weight of all others, after each death.

    `order` (D,) is the points that die, first to die first, and `parent` (N,) their parents in the merge tree. Both
    results are (D + 1,), before any death first; between deaths at the same scale they mean nothing.
    """
    size = weight.copy()
    large, rest = np.empty(len(order) + 1, np.int64), np.empty(len(order) + 1, np.int64)
    n_large, rest_now = 0, 0
    for point in range(len(size)):
        if size[point] >= min_size:
            n_large += 1
        else:
            rest_now += size[point]
    large[0], rest[0] = n_large, rest_now
    for place in range(len(order)):
        young = order[place]
        old = parent[young]
        for one in (young, old):
            if size[one] >= min_size:
                n_large -= 1
            else:
                rest_now -= size[one]
        size[old] += size[young]
        if size[old] >= min_size:
            n_large += 1
        else:
            rest_now += size[old]
        large[place + 1], rest[place + 1] = n_large, rest_now
    return large, rest
