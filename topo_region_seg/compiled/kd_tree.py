# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A balanced kd-tree over points with any number of channels, in leaves of eight points.

Nodes are numbered in preorder: the left child of node ``k`` is ``k + 1``, the right one ``right[k]``, and
``right[k] == 0`` marks a leaf. Children come after their parents, so a descending loop is bottom-up. Every
leaf but the last holds exactly `LEAF` points: the points of leaf ``k`` are rows ``start[k]:stop[k]`` of
`order`, and it is leaf number ``start[k] // LEAF``. The nodes and their rows depend on the number of points
alone; only the order of the points depends on where they are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.boxes import bound_channel, join_boxes
from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.compiled.threads import side_by_side, threads
from topo_region_seg.data import FloatArray, IndexArray

LEAF = 8  # so that the pairs of points of two leaves are the bits of a word, and a leaf in float32 is one vector
FEWEST = 4096  # points of a run of nodes from which on it is worth a thread of its own
SAMPLE = 16  # points that tell along which channel a node is widest; `python -m benchmarks.tricks constants`


class Tree(NamedTuple):
    """Arrays of a tree over N points with D = 3 T channels and K nodes."""

    order: IndexArray  # (N,) point ids in tree order
    start: IndexArray  # (K,) first row of the node in `order`
    stop: IndexArray  # (K,) end of the node's rows
    right: IndexArray  # (K,) right child; 0 in leaves
    boxes: npt.NDArray[np.float32]  # (T, K, 2, 4) lower and upper bounds, as `compiled.boxes` has them


def position_tree(xyz: FloatArray) -> Tree:
    """Build the tree of positions (N, 3), metres."""
    return build_tree(xyz, np.ones(3))


def moved_tree(tree: Tree, xyz: FloatArray) -> Tree:
    """Return the tree of positions (N, 3) that are others now, though what was near each other still is."""
    moved = tree._replace(boxes=np.zeros_like(tree.boxes))
    fill_boxes(moved, np.ascontiguousarray(xyz.T), 0, len(tree.start))
    return moved


def ordered_tree(order: IndexArray, xyz: FloatArray) -> Tree:
    """Return the tree of positions (N, 3) whose points are in a given order, in which neighbors are near each other."""
    n_nodes = nodes_of(len(order))
    rows = np.zeros((3, n_nodes), np.int32)
    tree = Tree(order, rows[0], rows[1], rows[2], np.zeros((1, n_nodes, 2, 4), np.float32))
    if n_nodes:
        tree.stop[0] = len(order)
        halve_nodes(tree)
        fill_boxes(tree, np.ascontiguousarray(xyz.T), 0, n_nodes)
    return tree


def nodes_of(n_points: int) -> int:
    """Return how many nodes the tree of so many points has."""
    return max(2 * ((n_points + LEAF - 1) // LEAF) - 1, 0)


def build_tree(channels: FloatArray, weights: FloatArray, by_position: Tree | None = None) -> Tree:
    """Build the tree of `channels` (N, D), splitting each node where its points, times `weights` (D,), spread most.

    Channels from the fourth on are features. With the tree `by_position` of the first three, which must weigh the
    same, only nodes that are widest in a feature, and those below, are split again.
    """
    n, d = channels.shape
    n_nodes = nodes_of(n)
    boxes = np.zeros((d // 3, n_nodes, 2, 4), np.float32)
    if by_position is None:
        start, stop, right = np.zeros((3, n_nodes), np.int32)
        tree = Tree(np.arange(n, dtype=np.int32), start, stop, right, boxes)
    else:
        tree = by_position._replace(order=by_position.order.copy(), boxes=boxes)
    if n == 0:
        return tree
    tree.stop[0] = n
    columns = np.ascontiguousarray(channels.T)
    keys = np.empty(n)
    # Nodes that are halved one by one, until each thread has some of the runs of nodes below them.
    above: list[tuple[int, int]] = []
    runs = [(0, n_nodes, by_position is not None)]
    while len(runs) < 2 * threads() and n >= FEWEST * len(runs):
        some = [(tree, columns, weights, keys, first, first + 1, given) for first, _, given in runs]
        halved = zip(runs, side_by_side(split_nodes, some), strict=True)
        runs = []
        for (first, end, _), given in halved:
            other = int(tree.right[first])
            above.append((first, other))
            runs += [(first + 1, other, given), (other, end, given)]
    side_by_side(split_nodes, [(tree, columns, weights, keys, *run) for run in runs])
    for first, other in reversed(above):
        join_boxes(tree.boxes, first, first + 1, other)
    return tree


@kernel
def split_nodes(
    tree: Tree, columns: FloatArray, weights: FloatArray, keys: FloatArray, first_node: int, end_node: int, given: bool
) -> bool:
    """Split the nodes of a subtree, first_node..end_node, then fill the boxes from the leaves up.

    Where the nodes are `given` already split by position, those that are widest in position are left as they are.
    Of a single node that is no leaf the box is not filled. Returns whether it was left as it was.
    """
    split_until = 0 if given else end_node
    for k in range(first_node, end_node):
        start, stop = tree.start[index(k)], tree.stop[index(k)]
        leaves = (stop - start + LEAF - 1) // LEAF
        if leaves <= 1:
            continue
        widest = _widest(columns, tree.order, start, stop, weights)
        if k >= split_until:
            if widest < 3:
                continue
            split_until = k + 2 * leaves - 1
        middle = halve(tree, k)
        column = columns[widest]
        for row in range(start, stop):
            keys[index(row)] = column[index(tree.order[index(row)])]
        _select(keys, tree.order, start, stop - 1, middle)
    if end_node == first_node + 1 and tree.right[first_node]:
        return split_until == 0
    fill_boxes(tree, columns, first_node, end_node)
    return False


@kernel
def halve_nodes(tree: Tree) -> None:
    """Give the nodes below the root their rows."""
    for k in range(len(tree.start)):
        if tree.stop[k] - tree.start[k] > LEAF:
            halve(tree, k)


@inlined
def halve(tree, k):  # type: ignore[no-untyped-def]
    """Give the children of a node their rows; return the first row of the right one."""
    start, stop = tree.start[index(k)], tree.stop[index(k)]
    half = ((stop - start + LEAF - 1) // LEAF + 1) // 2
    middle, right = start + half * LEAF, k + 2 * half
    tree.right[k] = right
    tree.start[k + 1], tree.stop[k + 1] = start, middle
    tree.start[right], tree.stop[right] = middle, stop
    return middle


@kernel
def fill_boxes(tree: Tree, columns: FloatArray, first_node: int, end_node: int) -> None:
    """Fill the boxes of a subtree, first_node..end_node, from the leaves up."""
    for k in range(end_node - 1, first_node - 1, -1):
        if tree.right[k]:
            join_boxes(tree.boxes, k, k + 1, tree.right[k])
            continue
        for c in range(len(columns)):
            low, high = np.inf, -np.inf
            for row in range(tree.start[k], tree.stop[k]):
                value = columns[c, index(tree.order[index(row)])]
                # A channel that holds a NaN is unbounded, as a NaN may meet anything.
                low = -np.inf if np.isnan(value) else min(low, value)
                high = np.inf if np.isnan(value) else max(high, value)
            bound_channel(tree.boxes, k, c, low, high)


@kernel
def _widest(columns, order, start, stop, weights):  # type: ignore[no-untyped-def]
    """Return the channel along which a sample of the rows, times the weights, spreads most."""
    best, axis = -1.0, 0
    taken = min(SAMPLE, stop - start)
    step = (stop - start) // taken
    sample = np.empty(SAMPLE, np.int64)
    for s in range(taken):
        sample[s] = order[index(start + s * step)]
    for c in range(len(weights)):
        low, high = np.inf, -np.inf
        for s in range(taken):
            value = columns[c, index(sample[s])]
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
            while keys[index(i)] < pivot:
                i += 1
            while keys[index(j)] > pivot:
                j -= 1
            if i <= j:
                p, q = index(i), index(j)
                keys[p], keys[q] = keys[q], keys[p]
                order[p], order[q] = order[q], order[p]
                i += 1
                j -= 1
        if k <= j:
            right = j
        elif k >= i:
            left = i
        else:
            return
