# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Nearest points, found in the tree."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.compiled.kd_tree import SLACK
from topo_region_seg.compiled.union_find import find


@kernel
def nearest_outside(tree, channels, region, parent, uniform, point, own, near_d2, near):  # type: ignore[no-untyped-def]
    """Fill `near` with the points nearest to `point` that are not in region `own`, nearest first; return how many.

    `region` (N,) is the region of a point and `parent` the union-find of the regions; `uniform` (K,) is the region
    that all points of a node belong to, or -1.
    """
    found = 0
    stack = np.empty(128, np.int64)
    stack[0] = 0
    top = 1
    while top:
        top -= 1
        node = stack[top]
        if found == len(near) and point_gap(tree, node, channels, point) > near_d2[found - 1]:
            continue
        if uniform[node] >= 0 and find(parent, uniform[node]) == own:
            continue
        right = tree.right[node]
        if right:
            left_first = point_gap(tree, node + 1, channels, point) <= point_gap(tree, right, channels, point)
            stack[top] = right if left_first else node + 1
            stack[top + 1] = node + 1 if left_first else right
            top += 2
            continue
        for row in range(tree.start[node], tree.stop[node]):
            other = tree.order[row]
            if find(parent, region[other]) != own:
                found = insert_near(channels, point, other, near_d2, near, found)
    return found


@kernel
def point_gap(tree, node, channels, point):  # type: ignore[no-untyped-def]
    """Squared distance from a point to a node's box."""
    gap = 0.0
    for c in range(3):
        value = channels[point, c]
        outside = max(0.0, tree.boxes[8 * node + c] - value, value - tree.boxes[8 * node + 4 + c])
        gap += outside * outside
    return gap * SLACK


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
