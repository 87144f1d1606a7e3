# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The shortest edge found so far between two components: of nodes in them that are farther apart none is needed.

At large scales two components may face each other across a gap with most of their points, and all of these pairs have
about the same length. One edge unites them, the shortest; so what is not shorter than one already found is left out.

A table of fixed size, in which a pair of components may displace another one: what is forgotten costs time alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.data import FloatArray, IntArray

SLOTS = 1 << 12


class Shortest(NamedTuple):
    """Pairs of components, as ``root << 32 | other root`` with the smaller row first, and their squared distances."""

    pair: IntArray  # (SLOTS,) -1 = none
    d2: FloatArray  # (SLOTS,)


@kernel
def new_shortest() -> Shortest:
    """Return an empty table."""
    return Shortest(np.full(SLOTS, -1, np.int64), np.empty(SLOTS))


@inlined
def shortest_between(shortest, a, b):  # type: ignore[no-untyped-def]
    """Return the squared length of the shortest edge known between the components with roots `a` and `b`, or inf."""
    pair = (np.int64(min(a, b)) << 32) | np.int64(max(a, b))
    slot = index((pair ^ (pair >> 29)) & (SLOTS - 1))
    return shortest.d2[slot] if shortest.pair[slot] == pair else np.inf


@inlined
def note_shortest(shortest, a, b, d2):  # type: ignore[no-untyped-def]
    """Note an edge between two components, unless a shorter one is known."""
    pair = (np.int64(min(a, b)) << 32) | np.int64(max(a, b))
    slot = index((pair ^ (pair >> 29)) & (SLOTS - 1))
    if shortest.pair[slot] != pair or d2 < shortest.d2[slot]:
        shortest.pair[slot], shortest.d2[slot] = pair, d2
