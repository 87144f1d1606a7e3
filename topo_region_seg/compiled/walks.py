# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Walks through the tree: the leaves near a box, and the pairs of leaves that are near each other.

A walk keeps the nodes that it has still to visit on a stack that its caller owns, and returns the next leaf, or pair of
leaves. So the loop over them is the caller's, whose arrays need not be handed on.
"""

from __future__ import annotations

from topo_region_seg.compiled.boxes import box_gap
from topo_region_seg.compiled.dialect import index, inlined

LEVELS = 32
"""More levels than a tree has whose rows are numbered by int32. Of each, one node waits at most, with that visited."""
PAIR_LEVELS = 4 * LEVELS
"""Pairs that wait at most: of each level two where a node meets itself, and one where each of two nodes is opened."""
MIXED, NOBODY = -2, -1
"""Of the points of a node: that they are in several regions, that none is in a region."""


@inlined
def next_leaf(tree, boxes, box, reach2, nearest_first, stack, top):  # type: ignore[no-untyped-def]
    """Return the next leaf whose box is up to `reach2` (m², squared) from one of `boxes`, and the height of the stack.

    The walk begins with the root alone on the `stack` (LEVELS,), and is over when the leaf is -1. `reach2` may shrink
    meanwhile, which is worth most if the nearer one of two children comes first.
    """
    leaf = -1
    while top > 0 and leaf < 0:
        top -= 1
        node = stack[index(top)]
        if box_gap(tree.boxes, node, boxes, box, 0) > reach2:
            continue
        right = tree.right[index(node)]
        if right:
            left_first = not nearest_first or (
                box_gap(tree.boxes, node + 1, boxes, box, 0) <= box_gap(tree.boxes, right, boxes, box, 0)
            )
            stack[index(top)] = right if left_first else node + 1
            stack[index(top + 1)] = node + 1 if left_first else right
            top += 2
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
