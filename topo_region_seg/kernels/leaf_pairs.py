# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Edges of the homogeneous graph between two leaves of the tree.

Channels of a point are x, y, z, L, a, b, nx, ny, nz; a missing feature is zero in all points, a missing
normal is NaN. Angles are compared as squared chords |n_i - n_j|^2 = 2 - 2 cos(theta).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.kernels.compile import inlined, kernel
from topo_region_seg.kernels.pair_queue import bits_of
from topo_region_seg.kernels.tree import LEAF

CHANNELS = 9
FAR = np.int64(0x7FF0000000000000)  # bits of infinity


class Criterion(NamedTuple):
    """Squared limits: an edge needs d2 <= reach and its color and chord differences within [low, high]."""

    reach: float
    color_low: float
    color_high: float
    chord_low: float
    chord_high: float


class Edges(NamedTuple):
    """Edges found at the current scale: squared lengths, and rows of the tree's order."""

    d2: FloatArray
    a: IntArray
    b: IntArray


@kernel
def new_edges(capacity: int) -> Edges:
    """Return room for `capacity` edges."""
    return Edges(np.empty(capacity), np.empty(capacity, np.int64), np.empty(capacity, np.int64))


@kernel
def grown_edges(edges: Edges) -> Edges:
    """Return room for twice as many edges, with the same edges."""
    old = len(edges.d2)
    grown = new_edges(2 * old)
    grown.d2[:old] = edges.d2
    grown.a[:old] = edges.a
    grown.b[:old] = edges.b
    return grown


@kernel
def meet_leaves(  # type: ignore[no-untyped-def]
    blocks, roots, limits, start_a, start_b, end, shortest_only, edges, n_edges
):
    """Collect the edges between the leaves at two starting rows, or within one, that are shorter than `end` (bits).

    Returns the number of edges and the bits of the smallest squared distance left for later (`FAR` = none).
    Between two leaves that are one component each only the shortest edge counts.
    """
    first = n_edges
    later = FAR
    for i in range(LEAF):
        hits, beyond = meet_point(blocks, roots, limits, start_a, start_b, i, end)
        later = min(later, beyond)
        while hits:
            j = trailing_zeros(hits)
            hits &= hits - 1
            d2 = squared_distance(blocks, start_a * CHANNELS + i, start_b * CHANNELS + j)
            if shortest_only and n_edges > first:
                if d2 < edges.d2[first]:
                    edges.d2[first], edges.a[first], edges.b[first] = d2, start_a + i, start_b + j
            else:
                edges.d2[n_edges], edges.a[n_edges], edges.b[n_edges] = d2, start_a + i, start_b + j
                n_edges += 1
    if shortest_only and n_edges > first:
        later = FAR
    return n_edges, later


@inlined
def meet_point(blocks, roots, limits, start_a, start_b, i, end):  # type: ignore[no-untyped-def]
    """Meet point i of one leaf with all of another: written without branches, so that it becomes vector code.

    Returns a bit for each point that an edge shorter than `end` leads to, and the bits of the smallest squared
    distance of the edges that are not shorter. Edges within a component do not count, nor do those of a
    leaf with itself that lead back (i >= j).
    """
    p, q = start_a * CHANNELS + i, start_b * CHANNELS
    x, y, z = blocks[at(p, 0)], blocks[at(p, 1)], blocks[at(p, 2)]
    light, a, b = blocks[at(p, 3)], blocks[at(p, 4)], blocks[at(p, 5)]
    u, v, w = blocks[at(p, 6)], blocks[at(p, 7)], blocks[at(p, 8)]
    component = roots[start_a + i]
    back = i if start_a == start_b else -1
    hits, beyond = np.int64(0), FAR
    for j in range(LEAF):
        dx, dy, dz = blocks[at(q + j, 0)] - x, blocks[at(q + j, 1)] - y, blocks[at(q + j, 2)] - z
        dl, da, db = blocks[at(q + j, 3)] - light, blocks[at(q + j, 4)] - a, blocks[at(q + j, 5)] - b
        du, dv, dw = blocks[at(q + j, 6)] - u, blocks[at(q + j, 7)] - v, blocks[at(q + j, 8)] - w
        d2 = dx * dx + dy * dy + dz * dz
        color = dl * dl + da * da + db * db
        chord = du * du + dv * dv + dw * dw
        alike = (d2 <= limits.reach) & (color <= limits.color_high) & (color >= limits.color_low)
        # Negated, so that the NaN of a missing normal passes.
        aligned = not ((chord > limits.chord_high) | (chord < limits.chord_low))
        edge = alike & aligned & (roots[np.uint64(start_b + j)] != component) & (j > back)
        bits = bits_of(d2)
        hits |= np.int64(edge & (bits < end)) << np.int64(j)
        beyond = min(beyond, bits if edge & (bits >= end) else FAR)
    return hits, beyond


@inlined
def at(place, channel):  # type: ignore[no-untyped-def]
    """Return the place of a channel of the point whose first one is at `place`.

    Unsigned: an index that might be negative, and so count from the end, is not loaded as a vector.
    """
    return np.uint64(place + channel * LEAF)


@inlined
def squared_distance(blocks, p, q):  # type: ignore[no-untyped-def]
    """Return the squared distance of the points at two places in `blocks`."""
    dx = blocks[at(q, 0)] - blocks[at(p, 0)]
    dy = blocks[at(q, 1)] - blocks[at(p, 1)]
    dz = blocks[at(q, 2)] - blocks[at(p, 2)]
    return dx * dx + dy * dy + dz * dz


@inlined
def trailing_zeros(bits):  # type: ignore[no-untyped-def]
    """Return the number of the lowest bit that is set."""
    count = 0
    while not bits & 1:
        bits >>= 1
        count += 1
    return count
