# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How convex the borders between regions are, judged by the pairs of points across them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.walks import PAIR_LEVELS, next_pair
from topo_region_seg.data import FloatArray, IntArray

FREE = -1
TOLERANCE = 0.1  # sine of the angle by which noise may close a pair of normals that is taken for convex


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
    `tree` is over positions, `blocks` (L, 6, LEAF) hold those and the normals; `region` (N,) of each point
    counts from 0, in the order of the tree; below 0 for points that judge nothing, as must be those without a normal.
    `uniform` (K,) is what `uniform_regions` returns.
    """
    slot, key, figures, count = np.full(1024, FREE), np.empty(256, np.int64), np.empty((256, 3)), 0
    reach2 = reach * reach
    stack = np.empty((PAIR_LEVELS, 2), np.int64)
    stack[0, 0], stack[0, 1] = node, other_node
    top = 1 if len(tree.start) else 0
    while True:
        p, q, top = next_pair(tree, uniform, reach2, stack, top)
        if p < 0:
            break
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
    last, border = np.int64(FREE), index(0)
    leaf, leaf_q = index(tree.start[p] // LEAF), index(tree.start[q] // LEAF)
    for a in range(tree.stop[p] - tree.start[p]):
        own, i = region[index(tree.start[p] + a)], index(a)
        if own < 0:
            continue
        for b in range(a + 1 if p == q else 0, tree.stop[q] - tree.start[q]):
            theirs, j = region[index(tree.start[q] + b)], index(b)
            dx = blocks[leaf, 0, i] - blocks[leaf_q, 0, j]
            dy = blocks[leaf, 1, i] - blocks[leaf_q, 1, j]
            dz = blocks[leaf, 2, i] - blocks[leaf_q, 2, j]
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
                (blocks[leaf, 3, i] - blocks[leaf_q, 3, j]) * dx
                + (blocks[leaf, 4, i] - blocks[leaf_q, 4, j]) * dy
                + (blocks[leaf, 5, i] - blocks[leaf_q, 5, j]) * dz
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
