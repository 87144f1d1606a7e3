# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How convex the borders between regions are, judged by the pairs of points across them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.kernels.borders import DEEP, node_gap
from topo_region_seg.kernels.borrow import borrowed
from topo_region_seg.kernels.compile import index, inlined, kernel
from topo_region_seg.kernels.merging import uniform_regions
from topo_region_seg.kernels.tree import Tree

FREE = -1


class Borders(NamedTuple):
    """The borders (B,) between regions; `first` < `second` are the regions."""

    first: IntArray
    second: IntArray
    pairs: FloatArray  # pairs of points across it that both have a normal
    convex: FloatArray  # how many of them are convex
    nearest: FloatArray  # distance of the nearest pair, metres


@kernel
def find_borders(
    tree: Tree,
    xyz: FloatArray,
    normals: FloatArray,
    region: IntArray,
    reach: float,
    tolerance: float,
    node: int,
    other_node: int,
) -> Borders:
    """Judge all pairs of points of different regions up to `reach` (m) apart, one below each of two nodes.

    A pair is convex where the normals open to the outside: ``(n_i - n_j) · (x_i - x_j) > -tolerance |x_i - x_j|``.
    `tree` is over the positions `xyz` (N, 3); `normals` (N, 3) may be NaN; `region` (N,) counts from 0.
    """
    tree, xyz, normals, region = borrowed(tree), borrowed(xyz), borrowed(normals), borrowed(region)
    slot = np.full(1024, FREE)
    key = np.empty(256, np.int64)
    figures = np.empty((256, 3))
    count, last, border, reach2 = 0, np.int64(FREE), index(0), reach * reach
    uniform = uniform_regions(tree, region)
    # In the order of the tree, so that the points of a leaf lie side by side.
    at, of = np.empty((3, len(xyz))), np.empty(len(xyz), np.int64)
    for row in range(len(xyz)):
        i = index(tree.order[index(row)])
        at[0, row], at[1, row], at[2, row], of[row] = xyz[i, 0], xyz[i, 1], xyz[i, 2], region[i]
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
        for row in range(tree.start[p], tree.stop[p]):
            x, y, z, own = at[0, index(row)], at[1, index(row)], at[2, index(row)], of[index(row)]
            for other in range(row + 1 if p == q else tree.start[q], tree.stop[q]):
                dx, dy, dz = x - at[0, index(other)], y - at[1, index(other)], z - at[2, index(other)]
                d2 = dx * dx + dy * dy + dz * dz
                if (d2 > reach2) | (of[index(other)] == own):
                    continue
                distance = math.sqrt(d2)
                i, j = index(tree.order[index(row)]), index(tree.order[index(other)])
                low, high = min(own, of[index(other)]), max(own, of[index(other)])
                wanted = (low << 32) | high
                if wanted != last:  # mostly it is the same as before
                    last = wanted
                    place = place_of(slot, key, wanted)
                    if slot[place] == FREE:
                        if count == len(key):
                            key, figures = longer(key, figures)
                            slot = np.full(4 * len(key), FREE)
                            for known in range(count):
                                slot[place_of(slot, key, key[known])] = known
                            place = place_of(slot, key, wanted)
                        slot[place] = count
                        key[count] = wanted
                        figures[count, 0], figures[count, 1], figures[count, 2] = 0.0, 0.0, np.inf
                        count += 1
                    border = index(slot[place])
                figures[border, 2] = min(figures[border, 2], distance)
                opening = (
                    (normals[i, 0] - normals[j, 0]) * dx
                    + (normals[i, 1] - normals[j, 1]) * dy
                    + (normals[i, 2] - normals[j, 2]) * dz
                )
                if opening == opening:
                    figures[border, 0] += 1.0
                    figures[border, 1] += 1.0 if opening > -tolerance * distance else 0.0
    order = np.argsort(key[:count])
    found, figures = key[order], figures[order]
    return Borders(found >> 32, found & 0xFFFFFFFF, figures[:, 0].copy(), figures[:, 1].copy(), figures[:, 2].copy())


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
