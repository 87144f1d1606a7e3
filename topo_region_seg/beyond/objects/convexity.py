# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How convex the borders between regions are, judged by the pairs of points across them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from topo_region_seg.beyond.objects.turns import CHANNELS
from topo_region_seg.compiled.dialect import borrowed, index, inlined, kernel
from topo_region_seg.compiled.kd_tree import DEEP, LEAF, Tree, node_gap
from topo_region_seg.data import FloatArray, IntArray

FREE = -1


class Borders(NamedTuple):
    """The borders (B,) between regions; `first` < `second` are the regions."""

    first: IntArray
    second: IntArray
    pairs: FloatArray  # pairs of points across it
    convex: FloatArray  # how many of them are convex
    nearest: FloatArray  # distance of the nearest pair, metres


@kernel
def find_borders(
    tree: Tree,
    blocks: FloatArray,
    region: IntArray,
    uniform: IntArray,
    reach: float,
    tolerance: float,
    node: int,
    other_node: int,
) -> Borders:
    """Judge all pairs of points of different regions up to `reach` (m) apart, one below each of two nodes.

    A pair is convex where the normals open to the outside: ``(n_i - n_j) · (x_i - x_j) > -tolerance |x_i - x_j|``.
    `tree` is over positions, `blocks` are its points as `oriented_blocks` returns them; `region` (N,) of each point
    counts from 0, in the order of the tree; below 0 for points that judge nothing, as must be those without a normal.
    `uniform` (K,) is the region that all points of a node are in, or -1.
    """
    tree, blocks, region, uniform = borrowed(tree), borrowed(blocks), borrowed(region), borrowed(uniform)
    slot, key, figures, count = np.full(1024, FREE), np.empty(256, np.int64), np.empty((256, 3)), 0
    reach2 = reach * reach
    stack = np.empty((DEEP, 2), np.int64)
    stack[0, 0], stack[0, 1] = node, other_node
    top = 1 if len(tree.start) else 0
    while top:
        top -= 1
        p, q = stack[top, 0], stack[top, 1]
        if (uniform[p] == uniform[q] and uniform[p] >= 0) or (p != q and node_gap(tree.boxes, p, q) > reach2):
            continue
        right_p, right_q = tree.right[p], tree.right[q]
        if p == q and right_p:
            stack[top, 0], stack[top, 1] = p + 1, p + 1
            stack[top + 1, 0], stack[top + 1, 1] = right_p, right_p
            stack[top + 2, 0], stack[top + 2, 1] = p + 1, right_p
            top += 3
            continue
        if right_p or right_q:
            # The larger one is opened.
            if not right_q or (right_p and tree.stop[p] - tree.start[p] >= tree.stop[q] - tree.start[q]):
                stack[top, 0], stack[top, 1] = p + 1, q
                stack[top + 1, 0], stack[top + 1, 1] = right_p, q
            else:
                stack[top, 0], stack[top, 1] = p, q + 1
                stack[top + 1, 0], stack[top + 1, 1] = p, right_q
            top += 2
            continue
        if count + LEAF * LEAF > len(key):
            key, figures = longer(key, figures)
            slot = np.full(4 * len(key), FREE)
            for known in range(count):
                slot[place_of(slot, key, key[known])] = known
        count = judge_leaves(tree, blocks, region, reach2, tolerance, p, q, slot, key, figures, count)
    order = np.argsort(key[:count])
    found, figures = key[order], figures[order]
    return Borders(found >> 32, found & 0xFFFFFFFF, figures[:, 0].copy(), figures[:, 1].copy(), figures[:, 2].copy())


@kernel
def judge_leaves(  # type: ignore[no-untyped-def]
    tree, blocks, region, reach2, tolerance, p, q, slot, key, figures, count
):
    """Add the pairs of points of two leaves to the `figures` (M, 3) of their borders; return how many these are now.

    A border's `key` (M,) holds its regions; `slot` is the table of the keys. Here, and not in the loop over the
    leaves, as the three are not borrowed there.
    """
    tree, blocks, region = borrowed(tree), borrowed(blocks), borrowed(region)
    slot, key, figures = borrowed(slot), borrowed(key), borrowed(figures)
    last, border = np.int64(FREE), index(0)
    first, begin = np.int64(tree.start[p]) * CHANNELS, np.int64(tree.start[q]) * CHANNELS
    for i in range(tree.stop[p] - tree.start[p]):
        own, at = region[index(tree.start[p] + i)], index(first + i)
        if own < 0:
            continue
        for j in range(i + 1 if p == q else 0, tree.stop[q] - tree.start[q]):
            theirs, other = region[index(tree.start[q] + j)], index(begin + j)
            dx = blocks[at] - blocks[other]
            dy = blocks[at + index(LEAF)] - blocks[other + index(LEAF)]
            dz = blocks[at + index(2 * LEAF)] - blocks[other + index(2 * LEAF)]
            apart2 = dx * dx + dy * dy + dz * dz
            if (apart2 > reach2) | (theirs == own) | (theirs < 0):
                continue
            wanted = (min(own, theirs) << 32) | max(own, theirs)
            if wanted != last:  # mostly it is the same as before
                last = wanted
                free = place_of(slot, key, wanted)
                if slot[free] == FREE:
                    slot[free] = count
                    key[index(count)] = wanted
                    figures[index(count), 0], figures[index(count), 1], figures[index(count), 2] = 0.0, 0.0, np.inf
                    count += 1
                border = index(slot[free])
            distance = math.sqrt(apart2)
            figures[border, 2] = min(figures[border, 2], distance)
            opening = (
                (blocks[at + index(3 * LEAF)] - blocks[other + index(3 * LEAF)]) * dx
                + (blocks[at + index(4 * LEAF)] - blocks[other + index(4 * LEAF)]) * dy
                + (blocks[at + index(5 * LEAF)] - blocks[other + index(5 * LEAF)]) * dz
            )
            figures[border, 0] += 1.0
            figures[border, 1] += 1.0 if opening > -tolerance * distance else 0.0
    return count


@inlined
def place_of(slot, key, wanted):  # type: ignore[no-untyped-def]
    """Return the place of a key in the table of `slot`, whose size is a power of two, or the free one for it."""
    mask = np.uint64(len(slot) - 1)
    place = ((np.uint64(wanted) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(20)) & mask
    while slot[place] != FREE and key[slot[place]] != wanted:
        place = (place + np.uint64(1)) & mask
    return place


@kernel
def longer(key, figures):  # type: ignore[no-untyped-def]
    """Return copies with room for as much again."""
    room, rows = np.empty(2 * len(key), np.int64), np.empty((2 * len(key), 3))
    room[: len(key)], rows[: len(key)] = key, figures
    return room, rows
