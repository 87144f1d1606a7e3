# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Nearest points, found in the tree."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.boxes import box_of_point
from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.compiled.union_find import find
from topo_region_seg.compiled.walks import LEVELS, next_leaf


@kernel
def nearest_outside(tree, channels, region, parent, uniform, point, own, near_d2, near):  # type: ignore[no-untyped-def]
    """Fill `near` with the points nearest to `point` that are not in region `own`, nearest first; return how many.

    `region` (N,) is the region of a point and `parent` the union-find of the regions; `uniform` (K,) is the region
    that all points of a node belong to, or -1.
    """
    box, stack = box_of_point(channels, point), np.empty(LEVELS, np.int64)
    stack[0], top = 0, 1
    found, farthest = 0, np.inf
    while True:
        leaf, top = next_leaf(tree, box, 0, farthest, True, stack, top)
        if leaf < 0:
            return found
        if uniform[leaf] >= 0 and find(parent, uniform[leaf]) == own:
            continue
        for row in range(tree.start[leaf], tree.stop[leaf]):
            other = tree.order[row]
            if find(parent, region[other]) != own:
                found = insert_near(channels, point, other, near_d2, near, found)
        if found == len(near):
            farthest = near_d2[found - 1]


@kernel
def insert_near(channels, point, other, near_d2, near, found):  # type: ignore[no-untyped-def]
    """Insert `other` in the list of the nearest points, equal distances in the order of the channels."""
    d2 = 0.0
    for c in range(3):
        d2 += (channels[other, c] - channels[point, c]) ** 2
    place = found
    while place > 0 and (
        d2 < near_d2[place - 1] or (d2 == near_d2[place - 1] and comes_before(channels, other, near[place - 1]))
    ):
        place -= 1
    if place == len(near):
        return found
    found = min(found + 1, len(near))
    for slot in range(found - 1, place, -1):
        near_d2[slot], near[slot] = near_d2[slot - 1], near[slot - 1]
    near_d2[place], near[place] = d2, other
    return found


@kernel
def comes_before(channels, p, q):  # type: ignore[no-untyped-def]
    """Whether point `p` precedes point `q` in the order of the channels."""
    for c in range(channels.shape[1]):
        if channels[p, c] != channels[q, c]:
            return channels[p, c] < channels[q, c]
    return False
