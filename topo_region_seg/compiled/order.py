# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The order of many numbers, by counting: they go into even intervals, in which few are left to be sorted."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.data import FloatArray, IntArray

PER_INTERVAL = 4
"""Numbers in an interval, if they were spread evenly."""
CROWDED = 48
"""Numbers in an interval from which on they are sorted otherwise."""


@kernel
def order_of(values: FloatArray) -> IntArray:
    """Return the rows of numbers (N,) in rising order, those of equal ones as they are; numbers that are NaN last."""
    n = len(values)
    low, high = np.inf, -np.inf
    for i in range(n):
        low, high = min(low, values[index(i)]), max(high, values[index(i)])
        if not abs(values[index(i)]) < np.inf:
            return np.argsort(values, kind="mergesort")
    intervals = n // PER_INTERVAL + 1
    scale = (intervals - 1) / (high - low) if high > low else 0.0
    if not scale < np.inf:
        return np.argsort(values, kind="mergesort")
    start, order, sorted_values = np.zeros(intervals + 1, np.int64), np.empty(n, np.int64), np.empty(n)
    for i in range(n):
        start[index(np.int64((values[index(i)] - low) * scale) + 1)] += 1
    for k in range(intervals):
        start[index(k + 1)] += start[index(k)]
    end = start[1:].copy()
    end[1:] = start[1:-1]
    end[0] = 0
    for i in range(n):
        value = values[index(i)]
        k = index(np.int64((value - low) * scale))
        order[index(end[k])], sorted_values[index(end[k])] = i, value
        end[k] += 1
    for k in range(intervals):
        first, stop = start[index(k)], start[index(k + 1)]
        if stop - first > CROWDED:
            order[first:stop] = order[first:stop][np.argsort(sorted_values[first:stop], kind="mergesort")]
        else:
            sort_few(order, sorted_values, first, stop)
    return order


@inlined
def sort_few(order, values, first, stop):  # type: ignore[no-untyped-def]
    """Sort a part of the values, and of the order with them, by insertion."""
    for i in range(first + 1, stop):
        value, row, place = values[index(i)], order[index(i)], i
        while place > first and values[index(place - 1)] > value:
            values[index(place)], order[index(place)] = values[index(place - 1)], order[index(place - 1)]
            place -= 1
        values[index(place)], order[index(place)] = value, row
