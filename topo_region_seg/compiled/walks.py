# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Walks through the tree: the leaves near a box, and the pairs of leaves that are near each other.

A walk keeps the nodes that it has still to visit on a stack that its caller owns, and returns the next leaf, or pair of
leaves. So the loop over them is the caller's, whose arrays need not be handed on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.boxes import box_gap
from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.data import FloatArray, IntArray

LEVELS = 32
"""More levels than a tree has whose rows are numbered by int32. Of each, one node waits at most, with that visited."""
PAIR_LEVELS = 4 * LEVELS
"""Pairs that wait at most: of each level two where a node meets itself, and one where each of two nodes is opened."""
MIXED, NOBODY = -2, -1
"""Of the points of a node: that they are in several regions, that none is in a region."""


class Walk(NamedTuple):
    """Nodes that a walk has still to visit, and their squared distances, m²."""

    node: IntArray
    gap: FloatArray


@kernel
def new_walk() -> Walk:
    """Return a walk that begins at the root."""
    return Walk(np.zeros(LEVELS, np.int64), np.zeros(LEVELS))


@inlined
def next_leaf(tree, boxes, box, reach2, nearest_first, walk, top):  # type: ignore[no-untyped-def]
    """Return the next leaf whose box is up to `reach2` (m², squared) from one of `boxes`, and how many nodes wait.

    The walk begins with the root alone, at no distance, and is over when the leaf is -1. `reach2` may shrink meanwhile,
    which is worth most if the nearer one of two children comes first.
    """
    leaf = -1
    while top > 0 and leaf < 0:
        top -= 1
        node = walk.node[index(top)]
        if walk.gap[index(top)] > reach2:
            continue
        right = np.int64(tree.right[index(node)])
        if right:
            first, second = node + 1, right
            near, far = box_gap(tree.boxes, first, boxes, box, 0), box_gap(tree.boxes, second, boxes, box, 0)
            if nearest_first and far < near:
                first, second, near, far = second, first, far, near
            if far <= reach2:
                walk.node[index(top)], walk.gap[index(top)] = second, far
                top += 1
            if near <= reach2:
                walk.node[index(top)], walk.gap[index(top)] = first, near
                top += 1
        else:
            leaf = node
    return leaf, top


@inlined
def next_pair(tree, uniform, reach2, stack, top):  # type: ignore[no-untyped-def]
    """Return the next pair of leaves up to `reach2` (m², squared) apart, and the height of the stack.

    The walk begins with a pair of nodes on the `stack` (PAIR_LEVELS, 2), and is over when the leaves are -1. `uniform`
    (K,) is what `uniform_regions` returns: pairs within one region, and those with a node in none, are left out.
    """
    leaf, other = -1, -1
    while top > 0 and leaf < 0:
        top -= 1
        p, q = stack[index(top), 0], stack[index(top), 1]
        region, theirs = uniform[index(p)], uniform[index(q)]
        if region == NOBODY or theirs == NOBODY or (region == theirs and region != MIXED):
            continue
        if p != q and box_gap(tree.boxes, p, tree.boxes, q, 0) > reach2:
            continue
        right_p, right_q = tree.right[index(p)], tree.right[index(q)]
        if p == q and right_p:
            stack[index(top), 0], stack[index(top), 1] = p + 1, p + 1
            stack[index(top + 1), 0], stack[index(top + 1), 1] = right_p, right_p
            stack[index(top + 2), 0], stack[index(top + 2), 1] = p + 1, right_p
            top += 3
        elif right_p or right_q:
            # The larger one is opened.
            if not right_q or (
                right_p and tree.stop[index(p)] - tree.start[index(p)] >= tree.stop[index(q)] - tree.start[index(q)]
            ):
                stack[index(top), 0], stack[index(top), 1] = p + 1, q
                stack[index(top + 1), 0], stack[index(top + 1), 1] = right_p, q
            else:
                stack[index(top), 0], stack[index(top), 1] = p, q + 1
                stack[index(top + 1), 0], stack[index(top + 1), 1] = p, right_q
            top += 2
        else:
            leaf, other = p, q
    return leaf, other, top
