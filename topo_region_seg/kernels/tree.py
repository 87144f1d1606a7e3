# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A balanced kd-tree over points with any number of channels, in blocks of eight points.

Nodes are numbered in preorder: the left child of node ``k`` is ``k + 1``, the right one ``right[k]``, and
``right[k] == 0`` marks a leaf. Children come after their parents, so a descending loop is bottom-up. Every
leaf but the last holds exactly `LEAF` points: the points of leaf ``k`` are rows ``start[k]:stop[k]`` of
`order`, and its block of channel data has the number ``start[k] // LEAF``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.kernels.compile import inlined, kernel
from topo_region_seg.parallel import side_by_side

LEAF = 8
SAMPLE = 16  # points by which a node judges along which channel it is widest
SLACK = 1.0 - 1e-6  # keeps box distances below the true ones in spite of rounding


class Tree(NamedTuple):
    """Arrays of a tree over N points with D channels and K nodes."""

    order: IntArray  # (N,) point ids in tree order
    start: IntArray  # (K,) first row of the node in `order`
    stop: IntArray  # (K,) end of the node's rows
    right: IntArray  # (K,) right child; 0 in leaves
    boxes: npt.NDArray[np.float32]  # (K, 2 D) lower and upper bounds, rounded outwards
    blocks: FloatArray  # (ceil(N / LEAF) * D * LEAF,) leaf after leaf, channel after channel; padding is inf


def position_tree(xyz: FloatArray) -> Tree:
    """Build the tree of positions (N, 3), metres."""
    return build_tree(xyz, np.ones(3))


def build_tree(channels: FloatArray, weights: FloatArray) -> Tree:
    """Build the tree of `channels` (N, D), splitting each node where its points, times `weights` (D,), spread most."""
    n, d = channels.shape
    n_leaves = (n + LEAF - 1) // LEAF
    n_nodes = max(2 * n_leaves - 1, 0)
    start, stop, right = np.zeros((3, n_nodes), np.int64)
    tree = Tree(
        np.arange(n),
        start,
        stop,
        right,
        np.empty((n_nodes, 2 * d), np.float32),
        np.full(n_leaves * d * LEAF, np.inf),
    )
    if n == 0:
        return tree
    stop[0] = n
    columns = np.ascontiguousarray(channels.T)
    keys = np.empty(n)
    split_nodes(tree, columns, weights, keys, 0, 1)
    if right[0]:
        # Each half is a run of nodes of its own.
        halves = [(1, int(right[0])), (int(right[0]), n_nodes)]
        side_by_side(split_nodes, [(tree, columns, weights, keys, first, end) for first, end in halves])
        join_box(tree.boxes, 0, 1, right[0])
    return tree


@kernel
def split_nodes(
    tree: Tree, columns: FloatArray, weights: FloatArray, keys: FloatArray, first_node: int, end_node: int
) -> None:
    """Split the nodes of a subtree, first_node..end_node, then fill blocks and boxes from the leaves up."""
    d = len(columns)
    for k in range(first_node, end_node):
        start, stop = tree.start[k], tree.stop[k]
        leaves = (stop - start + LEAF - 1) // LEAF
        if leaves <= 1:
            continue
        middle = start + (leaves + 1) // 2 * LEAF
        column = columns[_widest(columns, tree.order, start, stop, weights)]
        for row in range(start, stop):
            keys[row] = column[tree.order[row]]
        _select(keys, tree.order, start, stop - 1, middle)
        right = k + 2 * ((leaves + 1) // 2)
        tree.right[k] = right
        tree.start[k + 1], tree.stop[k + 1] = start, middle
        tree.start[right], tree.stop[right] = middle, stop
    if end_node == 1 and tree.right[0]:
        return
    for k in range(end_node - 1, first_node - 1, -1):
        if tree.right[k]:
            join_box(tree.boxes, k, k + 1, tree.right[k])
            continue
        for c in range(d):
            low, high = np.inf, -np.inf
            for row in range(tree.start[k], tree.stop[k]):
                value = columns[c, tree.order[row]]
                tree.blocks[(tree.start[k] // LEAF * d + c) * LEAF + row - tree.start[k]] = value
                # A channel that holds a NaN is unbounded, as a NaN may meet anything.
                low = -np.inf if np.isnan(value) else min(low, value)
                high = np.inf if np.isnan(value) else max(high, value)
            tree.boxes[k, c] = low - abs(low) * 1.2e-7
            tree.boxes[k, d + c] = high + abs(high) * 1.2e-7


@kernel
def join_box(boxes, node, left, right):  # type: ignore[no-untyped-def]
    """Bound a node by the boxes of its children."""
    d = boxes.shape[1] // 2
    for c in range(d):
        boxes[node, c] = min(boxes[left, c], boxes[right, c])
        boxes[node, d + c] = max(boxes[left, d + c], boxes[right, d + c])


@inlined
def box_gap(boxes, a, b, c):  # type: ignore[no-untyped-def]
    """Return a lower bound of the squared distance between two boxes in channels c, c + 1, c + 2."""
    d = boxes.shape[1] // 2
    zero = np.float32(0.0)
    x = max(zero, boxes[b, c] - boxes[a, d + c], boxes[a, c] - boxes[b, d + c])
    y = max(zero, boxes[b, c + 1] - boxes[a, d + c + 1], boxes[a, c + 1] - boxes[b, d + c + 1])
    z = max(zero, boxes[b, c + 2] - boxes[a, d + c + 2], boxes[a, c + 2] - boxes[b, d + c + 2])
    return np.float64(x * x + y * y + z * z) * SLACK


@kernel
def _widest(columns, order, start, stop, weights):  # type: ignore[no-untyped-def]
    """Return the channel along which a sample of the rows, times the weights, spreads most."""
    best, axis = -1.0, 0
    taken = min(SAMPLE, stop - start)
    for c in range(len(weights)):
        low, high = np.inf, -np.inf
        for s in range(taken):
            value = columns[c, order[start + s * (stop - start) // taken]]
            low, high = min(low, value), max(high, value)
        width = (high - low) * weights[c]
        if width > best:  # false for NaN
            best, axis = width, c
    return axis


@kernel
def _select(keys, order, left, right, k):  # type: ignore[no-untyped-def]
    """Partition rows left..right (inclusive) so that rows before k hold the smaller keys (Hoare's selection)."""
    while left < right:
        middle = (left + right) // 2
        a, b, c = keys[left], keys[middle], keys[right]
        pivot = max(min(a, b), min(max(a, b), c))
        i, j = left, right
        while i <= j:
            while keys[i] < pivot:
                i += 1
            while keys[j] > pivot:
                j -= 1
            if i <= j:
                keys[i], keys[j] = keys[j], keys[i]
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if k <= j:
            right = j
        elif k >= i:
            left = i
        else:
            return
