# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions united across convex borders, the surest first; what is united is judged again."""

from __future__ import annotations

import heapq
import math

import numpy as np

from topo_region_seg.beyond.objects.convexity import Borders
from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.compiled.union_find import find
from topo_region_seg.data import IntArray

ENOUGH = 20.0  # pairs of points that a border needs to be judged
INDEPENDENT = 20.0  # pairs of points that tell about as much as one that shares no point with others
NOT_SURE = -1.0
NONE = -1


@kernel
def surety(pairs, convex, share):  # type: ignore[no-untyped-def]
    """Return the lower bound of the convex share of a border, a standard error below it; -1 if it is not convex."""
    if pairs < ENOUGH or convex <= share * pairs:
        return NOT_SURE
    found, independent = convex / pairs, pairs / INDEPENDENT
    return found - math.sqrt(found * (1.0 - found) / independent + 0.25 / independent**2)


@kernel
def unite_convex(borders: Borders, n_regions: int, share: float) -> IntArray:
    """Return the group (R,) of each region, the number of one of its regions.

    A region's borders are a list; when two regions become one, so do their lists, and borders with the same neighbor
    add up.
    """
    n = len(borders.first)
    group = np.arange(n_regions)
    pairs, convex = borders.pairs.copy(), borders.convex.copy()
    a, b = borders.first.copy(), borders.second.copy()
    head, after = np.full(n_regions, NONE), np.full(2 * n, NONE)
    heap = [(0.0, np.int64(0), np.int64(0), np.int64(0)) for _ in range(0)]
    for e in range(n):
        after[2 * e], head[a[e]] = head[a[e]], 2 * e
        after[2 * e + 1], head[b[e]] = head[b[e]], 2 * e + 1
        sure = surety(pairs[e], convex[e], share)
        if sure != NOT_SURE:
            heapq.heappush(heap, (-sure, -a[e], -b[e], np.int64(e)))
    alive = np.ones(n, np.bool_)
    border_with = np.full(n_regions, NONE)
    while len(heap):
        sure, p, q, e = heapq.heappop(heap)
        p, q = -p, -q
        if not alive[e] or a[e] != p or b[e] != q or surety(pairs[e], convex[e], share) != -sure:
            continue
        alive[e] = False
        group[q] = p
        # What is left of the list of p, and what is on that of q, becomes the list of p.
        entry, left = head[p], NONE
        while entry >= 0:
            following, f = after[entry], entry // 2
            if alive[f]:
                after[entry], left = left, entry
                border_with[a[f] + b[f] - p] = f
            entry = following
        entry = head[q]
        while entry >= 0:
            following, f = after[entry], entry // 2
            if alive[f]:
                other = a[f] + b[f] - q
                same = border_with[other]
                if same >= 0:
                    pairs[same] += pairs[f]
                    convex[same] += convex[f]
                    alive[f] = False
                    f = same
                else:
                    a[f], b[f] = min(p, other), max(p, other)
                    after[entry], left = left, entry
                now = surety(pairs[f], convex[f], share)
                if now != NOT_SURE:
                    heapq.heappush(heap, (-now, -a[f], -b[f], np.int64(f)))
            entry = following
        head[p], head[q] = left, NONE
        entry = left
        while entry >= 0:
            f = entry // 2
            border_with[a[f] + b[f] - p] = NONE
            entry = after[entry]
    for r in range(n_regions):
        group[r] = find(group, r)
    return group
