# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps of a lazy Kruskal over the homogeneous Vietoris-Rips filtration, by pairs of tree nodes.

Pairs of nodes wait in buckets by the smallest distance between their boxes, so that each is opened at the
first scale where it can matter. A pair falls away when its boxes are out of reach in position, color or
normal, or when both nodes lie in one component. Edges are thus only ever looked at between points that
nothing shorter joins, and no list of all pairs within the radius exists.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.kernels.compile import inlined, kernel
from topo_region_seg.kernels.leaf_pairs import FAR, Criterion, Edges, meet_leaves
from topo_region_seg.kernels.pair_queue import (
    BUCKET_SHIFT,
    SPACE,
    SPARE,
    PairQueue,
    bucket_end,
    bucket_of,
    pop,
    push,
)
from topo_region_seg.kernels.tree import LEAF, Tree, box_gap
from topo_region_seg.kernels.union_find import find, unite


class Forest(NamedTuple):
    """Components so far, by row of the tree's order; `death` is by point id."""

    parent: IntArray  # (N,) union-find
    size: IntArray  # (N,)
    elder: IntArray  # (N,) smallest point id, valid at roots
    death: FloatArray  # (N,) scale at which the component of the point died, metres; inf = alive
    roots: IntArray  # (N + LEAF,) component when last refreshed; padded to whole leaves
    same: IntArray  # (K,) a row of the node, if all its rows are one component; -1 = not known to be


@kernel
def new_forest(tree: Tree) -> Forest:
    """Return the forest of single points."""
    n = len(tree.order)
    roots = np.arange(n + LEAF)
    same = np.full(len(tree.start), -1)
    return Forest(np.arange(n), np.ones(n, np.int64), tree.order.copy(), np.full(n, np.inf), roots, same)


@kernel
def drain_bucket(
    tree: Tree,
    limits: Criterion,
    forest: Forest,
    queue: PairQueue,
    edges: Edges,
    n_edges: int,
    bucket: int,
    first: bool,
    sweep: bool,
) -> int:
    """Open the pairs of a bucket until it is empty, or until edges or queue need room; return the number of edges.

    In the `first` bucket points may coincide. They are united at once, so that heaps of them stay cheap; nodes
    are then looked at again, since their own pairs come before pairs across. A `sweep` leaves out what belongs
    to later buckets.
    """
    end = bucket_end(bucket)
    parent, same = forest.parent, forest.same
    while queue.head[bucket] >= 0 and n_edges + LEAF * LEAF <= len(edges.d2) and queue.head[SPACE] >= SPARE:
        a, b = pop(queue, bucket)
        if first:
            for node in (a, b):
                note_uniform(tree, parent, same, node)
        if joined(parent, same, a, b):
            continue
        if tree.right[a] or tree.right[b]:
            open_pair(tree, limits, queue, parent, same, a, b, bucket, sweep)
            continue
        shortest_only = a != b and same[a] >= 0 and same[b] >= 0
        found, later = meet_leaves(
            tree.blocks, forest.roots, limits, tree.start[a], tree.start[b], end, shortest_only, edges, n_edges
        )
        if later < FAR and not sweep:
            push(queue, a, b, later >> BUCKET_SHIFT)
        n_edges = unite_coinciding(forest, edges, n_edges, found) if first else found
    return n_edges


@kernel
def unite_edges(forest: Forest, edges: Edges, order: IntArray) -> int:
    """Unite along edges in the given `order`, shortest first; return the number of unions."""
    unions = 0
    for e in order:
        unions += unite(
            forest.parent, forest.size, forest.elder, forest.death, edges.a[e], edges.b[e], np.sqrt(edges.d2[e])
        )
    return unions


@kernel
def unite_coinciding(forest, edges, first, n_edges):  # type: ignore[no-untyped-def]
    """Unite along the edges of length zero and keep the others; return the number of edges."""
    kept = first
    for e in range(first, n_edges):
        if edges.d2[e] == 0.0:
            unite(forest.parent, forest.size, forest.elder, forest.death, edges.a[e], edges.b[e], 0.0)
        else:
            edges.d2[kept], edges.a[kept], edges.b[kept] = edges.d2[e], edges.a[e], edges.b[e]
            kept += 1
    return kept


@kernel
def refresh_components(tree: Tree, forest: Forest) -> None:
    """Bring `roots` and `same` up to date with the unions so far."""
    for row in range(len(forest.parent)):
        forest.roots[row] = find(forest.parent, row)
    for node in range(len(forest.same) - 1, -1, -1):
        note_uniform(tree, forest.parent, forest.same, node)


@kernel
def smallest_ids(tree: Tree, forest: Forest) -> IntArray:
    """Return the smallest point id of each point's component, by point id."""
    root = np.empty(len(tree.order), np.int64)
    for row in range(len(tree.order)):
        root[tree.order[row]] = forest.elder[find(forest.parent, row)]
    return root


@inlined
def note_uniform(tree, parent, same, node):  # type: ignore[no-untyped-def]
    """Mark `node` if its children (of a leaf: its rows) are known to be one component."""
    if same[node] >= 0:
        return
    right = tree.right[node]
    if right:
        if joined(parent, same, node + 1, right):
            same[node] = same[right]
        return
    first = tree.start[node]
    root = find(parent, first)
    for row in range(first + 1, tree.stop[node]):
        if find(parent, row) != root:
            return
    same[node] = first


@inlined
def joined(parent, same, a, b):  # type: ignore[no-untyped-def]
    """Whether all points of both nodes are known to be one component."""
    return same[a] >= 0 and same[b] >= 0 and find(parent, same[a]) == find(parent, same[b])


@inlined
def open_pair(tree, limits, queue, parent, same, a, b, bucket, sweep):  # type: ignore[no-untyped-def]
    """Replace a pair by those of the children of both nodes that matter."""
    if a == b:
        # Last in, first out: a node's own pairs come before the pair across, which then often falls away.
        children = ((a + 1, tree.right[a]), (a + 1, a + 1), (tree.right[a], tree.right[a]), (-1, -1))
    else:
        left_a = a + 1 if tree.right[a] else a
        left_b = b + 1 if tree.right[b] else b
        right_a = tree.right[a] if tree.right[a] else -1
        right_b = tree.right[b] if tree.right[b] else -1
        children = ((left_a, left_b), (right_a, left_b), (left_a, right_b), (right_a, right_b))
    for c, d in children:
        if c < 0 or d < 0:
            continue
        gap = 0.0
        if c != d:
            if joined(parent, same, c, d):
                continue
            gap = box_gap(tree.boxes, c, d, 0)
            # False for NaN, so that a pair is only dropped for a reason.
            if (
                gap > limits.reach
                or box_gap(tree.boxes, c, d, 3) > limits.color_high
                or box_gap(tree.boxes, c, d, 6) > limits.chord_high
            ):
                continue
        place = max(bucket, bucket_of(gap))
        if place == bucket or not sweep:
            push(queue, c, d, place)


@kernel
def nearest_in_leaves(tree: Tree, n_leaves: int) -> FloatArray:
    """Return the squared distance to the nearest other point of the leaf for the points of some leaves, sorted."""
    total = (len(tree.order) + LEAF - 1) // LEAF
    channels = len(tree.blocks) // (LEAF * total)
    nearest = np.full(n_leaves * LEAF, np.inf)
    for sample in range(n_leaves):
        base = sample * total // n_leaves * channels * LEAF
        for i in range(LEAF):
            for j in range(LEAF):
                dx = tree.blocks[base + j] - tree.blocks[base + i]
                dy = tree.blocks[base + LEAF + j] - tree.blocks[base + LEAF + i]
                dz = tree.blocks[base + 2 * LEAF + j] - tree.blocks[base + 2 * LEAF + i]
                if i != j:
                    d2 = dx * dx + dy * dy + dz * dz
                    if d2 < nearest[sample * LEAF + i]:
                        nearest[sample * LEAF + i] = d2
    return np.sort(nearest)
