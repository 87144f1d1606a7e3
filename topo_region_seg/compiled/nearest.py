# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Nearest points, found in the tree."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.boxes import bound_channel
from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.compiled.kd_tree import LEAF
from topo_region_seg.compiled.walks import LEVELS
from topo_region_seg.data import FloatArray, IntArray


class Near(NamedTuple):
    """The k points found so far that are nearest to one, and room for the search."""

    d2: FloatArray  # (k,) their squared distances, m², the shortest first
    point: IntArray  # (k,) their ids
    leaf_d2: FloatArray  # (LEAF,) squared distances of the points of one leaf
    box: npt.NDArray[np.float32]  # (1, 1, 2, 4) the box around the point
    stack: IntArray  # (LEVELS,) nodes that the walk has still to visit


@kernel
def room_for_near(k: int) -> Near:
    """Return room for the `k` nearest points."""
    box = np.zeros((1, 1, 2, 4), np.float32)
    return Near(np.empty(k), np.empty(k, np.int64), np.empty(LEAF), box, np.empty(LEVELS, np.int64))


@inlined
def begin_near(near, channels, point):  # type: ignore[no-untyped-def]
    """Begin the walk around a point at the root of the tree."""
    for c in range(3):
        bound_channel(near.box, 0, c, channels[index(point), index(c)], channels[index(point), index(c)])
    near.stack[0] = 0


@inlined
def leaf_distances(blocks, leaf, channels, point, leaf_d2):  # type: ignore[no-untyped-def]
    """Fill `leaf_d2` (LEAF,) with the squared distances of a leaf's points from a point."""
    b, p = index(leaf), index(point)
    x, y, z = channels[p, 0], channels[p, 1], channels[p, 2]
    for i in range(LEAF):
        dx, dy, dz = blocks[b, 0, index(i)] - x, blocks[b, 1, index(i)] - y, blocks[b, 2, index(i)] - z
        leaf_d2[index(i)] = dx * dx + dy * dy + dz * dz


@inlined
def insert_near(channels, other, d2, near, found):  # type: ignore[no-untyped-def]
    """Insert `other` in the list of the nearest points, equal distances in the order of the channels."""
    place = found
    while place > 0 and (
        d2 < near.d2[index(place - 1)]
        or (d2 == near.d2[index(place - 1)] and comes_before(channels, other, near.point[index(place - 1)]))
    ):
        place -= 1
    if place < len(near.d2):
        found = min(found + 1, len(near.d2))
        for slot in range(found - 1, place, -1):
            near.d2[index(slot)] = near.d2[index(slot - 1)]
            near.point[index(slot)] = near.point[index(slot - 1)]
        near.d2[index(place)], near.point[index(place)] = d2, other
    return found


@kernel
def comes_before(channels, p, q):  # type: ignore[no-untyped-def]
    """Whether point `p` precedes point `q` in the order of the channels."""
    for c in range(channels.shape[1]):
        if channels[p, c] != channels[q, c]:
            return channels[p, c] < channels[q, c]
    return False
