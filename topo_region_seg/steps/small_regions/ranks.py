# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The place of each representative in the order of all: by x, then y, z and the features."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.compiled.order import order_of
from topo_region_seg.data import FloatArray, IntArray


@kernel
def ranks_of(channels: FloatArray, points: IntArray) -> IntArray:
    """Return the place (R,) of each of some points (R,) in the order of their channels, one after the other."""
    n = len(points)
    x = np.empty(n)
    for i in range(n):
        x[i] = channels[points[i], 0]
    order, rank = order_of(x), np.empty(n, np.int64)
    first = 0
    while first < n:
        end = first + 1
        while end < n and x[index(order[end])] == x[index(order[first])]:
            end += 1
        if end - first > 1:
            put_ties_in_order(channels, points, order[first:end])
        first = end
    for i in range(n):
        rank[order[i]] = i
    return rank


@kernel
def put_ties_in_order(channels: FloatArray, points: IntArray, order: IntArray) -> None:
    """Put in order what has the same x: an `order` (T,) of some of the points, channel after channel."""
    n = len(order)
    values = np.empty(n)
    for c in range(1, channels.shape[1]):
        first, tied = 0, False
        while first < n:
            end = first + 1
            while end < n and same_before(channels, points[order[first]], points[order[end]], c):
                end += 1
            if end - first > 1:
                tied = True
                for i in range(first, end):
                    values[i] = channels[points[order[i]], c]
                order[first:end] = order[first:end][order_of(values[first:end])]
            first = end
        if not tied:
            return


@inlined
def same_before(channels, p, q, end):  # type: ignore[no-untyped-def]
    """Whether two points are the same in the channels from the second on that come before one."""
    same = True
    for c in range(1, end):
        same = same and channels[p, c] == channels[q, c]
    return same
