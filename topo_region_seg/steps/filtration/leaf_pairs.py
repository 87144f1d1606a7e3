# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Edges of the homogeneous graph between two leaves of the tree.

Channels of a point are x, y, z, L, a, b, nx, ny, nz; a missing feature is zero in all points, a missing
normal is NaN. Angles are compared as squared chords |n_i - n_j|^2 = 2 - 2 cos(theta).

Pairs are sifted in single precision, eight at a time, by limits that are wider by what rounding may do; what
passes is decided in double precision.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.lanes import trailing_zeros
from topo_region_seg.compiled.leaf_blocks import fill_blocks, leaves_of
from topo_region_seg.compiled.predicate import CHANNELS, edge_length
from topo_region_seg.data import FloatArray, IndexArray
from topo_region_seg.steps.filtration.leaf_sieve import FAR_SINGLE, sift_leaves
from topo_region_seg.steps.filtration.pair_queue import bits_of

FAR = np.int64(0x7FF0000000000000)  # bits of infinity
LEAF_SHIFT = 3  # LEAF = 1 << LEAF_SHIFT
UPPER = np.int64(sum(1 << (LEAF * i + j) for i in range(LEAF) for j in range(i + 1, LEAF)))  # pairs i < j
ROUNDING = 2.0**-22  # of a coordinate: by this much the difference of two may be off in single precision
WIDER = 1.0 + 2.0**-20  # by this factor the square of a length may
TINY = 1e-37  # by this much it may, where single precision has no more digits


class Leaves(NamedTuple):
    """The points of L leaves."""

    points: FloatArray  # (N, 9) by id
    order: IndexArray  # (N,) point ids in tree order
    blocks: npt.NDArray[np.float32]  # (L, 9, LEAF) as `leaf_blocks` has them, positions from the middle of the cloud
    errors: FloatArray  # (L, 3) rounding errors of positions, colors and normals in the blocks


class Edges(NamedTuple):
    """Edges found at the current scale: squared lengths, and rows of the tree's order."""

    d2: FloatArray
    a: IndexArray
    b: IndexArray


@kernel
def new_edges(capacity: int) -> Edges:
    """Return room for `capacity` edges."""
    return Edges(np.empty(capacity), np.empty(capacity, np.int32), np.empty(capacity, np.int32))


@kernel
def grown_edges(edges: Edges) -> Edges:
    """Return room for twice as many edges, with the same edges."""
    old = len(edges.d2)
    grown = new_edges(2 * old)
    grown.d2[:old] = edges.d2
    grown.a[:old] = edges.a
    grown.b[:old] = edges.b
    return grown


def gather_leaves(tree: Tree, channels: FloatArray) -> Leaves:
    """Return the points (N, 9) in the order of the tree and in blocks of single precision."""
    # Positions from their middle, which keeps the numbers small; colors and normals have their own origin.
    middle = np.zeros(CHANNELS)
    if len(channels):
        middle[:3] = channels[:, :3].mean(axis=0)
    blocks = np.empty((leaves_of(len(channels)), CHANNELS, LEAF), np.float32)
    fill_blocks(tree.order, channels, middle, 0, blocks)
    return Leaves(channels, tree.order, blocks, rounding_errors(blocks))


@kernel
def rounding_errors(blocks: npt.NDArray[np.float32]) -> FloatArray:
    """Return by how much a coordinate of position, color and normal may be off in each of the blocks, (L, 3)."""
    errors = np.empty((len(blocks), CHANNELS // 3))
    for leaf in range(len(blocks)):
        for three in range(CHANNELS // 3):
            largest = np.float32(0.0)
            for c in range(3):
                for i in range(LEAF):
                    value = abs(blocks[index(leaf), index(3 * three + c), index(i)])
                    # A missing normal, which is NaN, and padding stay out of it.
                    largest = max(largest, value if value < np.inf else np.float32(0.0))
            errors[index(leaf), index(three)] = largest * ROUNDING
    return errors


@inlined
def meet_leaves(  # type: ignore[no-untyped-def]
    leaves, roots, limits, start_a, start_b, end, shortest_only, edges, n_edges
):
    """Collect the edges between the leaves at two starting rows, or within one, that are shorter than `end` (bits).

    Returns the number of edges and the bits of a lower bound of the squared distances left for later (`FAR` = none).
    Between two leaves that are one component each only the shortest edge counts.
    """
    first = n_edges
    later = FAR
    error = pair_errors(leaves.errors, start_a // LEAF, start_b // LEAF)
    hits, beyond = sift_leaves(
        leaves.blocks,
        roots,
        start_a,
        start_b,
        (
            widened(limits.reach, error[0]),
            narrowed(limits.color_low, error[1]),
            widened(limits.color_high, error[1]),
            narrowed(limits.chord_low, error[2]),
            widened(limits.chord_high, error[2]),
            widened(np.int64(end).view(np.float64), error[0]),
        ),
    )
    if start_a == start_b:
        hits &= UPPER
    while hits:
        place = trailing_zeros(hits)
        hits &= hits - 1
        a, b = start_a + (place >> LEAF_SHIFT), start_b + (place & (LEAF - 1))
        d2 = edge_length(leaves.points, limits, leaves.order[index(a)], leaves.order[index(b)])
        if d2 < 0.0:
            continue
        if bits_of(d2) >= end:
            later = min(later, bits_of(d2))
        elif shortest_only and n_edges > first:
            if d2 < edges.d2[first]:
                edges.d2[first], edges.a[first], edges.b[first] = d2, a, b
        else:
            edge = index(n_edges)
            edges.d2[edge], edges.a[edge], edges.b[edge] = d2, a, b
            n_edges += 1
    if shortest_only and n_edges > first:
        return n_edges, FAR
    if beyond < FAR_SINGLE:
        square = np.float64(np.int32(beyond).view(np.float32))
        later = min(later, max(end, bits_of(narrowed(square, error[0]))))
    return n_edges, later


@inlined
def pair_errors(errors, a, b):  # type: ignore[no-untyped-def]
    """Return by how much a difference of position, color and normal of points of two leaves may be off."""
    p, q = index(a), index(b)
    return errors[p, 0] + errors[q, 0], errors[p, 1] + errors[q, 1], errors[p, 2] + errors[q, 2]


@inlined
def widened(square, error):  # type: ignore[no-untyped-def]
    """Return, in single precision, the square of a length whose three channels may each be off by `error`: at most."""
    length = math.sqrt(square) + 2.0 * error
    return np.float32(length * length * WIDER + TINY)


@inlined
def narrowed(square, error):  # type: ignore[no-untyped-def]
    """Return, in single precision, the square of a length whose three channels may each be off by `error`: at least."""
    length = max(0.0, math.sqrt(max(0.0, square - TINY)) - 2.0 * error)
    return np.float32(length * length / WIDER)
