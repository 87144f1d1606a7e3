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

from topo_region_seg.compiled.boxes import box_gap
from topo_region_seg.compiled.dialect import borrowed, index, inlined, kernel
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.predicate import Criterion
from topo_region_seg.compiled.union_find import find, unite
from topo_region_seg.data import FloatArray, IndexArray, IntArray
from topo_region_seg.steps.filtration.leaf_pairs import FAR, Edges, Leaves, meet_leaves, new_edges
from topo_region_seg.steps.filtration.pair_queue import (
    BUCKET_SHIFT,
    SPACE,
    SPARE,
    PairQueue,
    bucket_end,
    bucket_of,
    pop,
    push,
)
from topo_region_seg.steps.filtration.shortest import Shortest, note_shortest, shortest_between


class Forest(NamedTuple):
    """Components so far, by row of the tree's order; `death` and `into` are by point id."""

    parent: IndexArray  # (N,) union-find
    size: IndexArray  # (N,)
    elder: IndexArray  # (N,) smallest point id, valid at roots
    death: FloatArray  # (N,) scale at which the component of the point died, metres; inf = alive
    into: IndexArray  # (N,) smallest point id of the component that it went into, by point id; the point itself = alive
    roots: IndexArray  # (N + LEAF,) component when last refreshed; padded to whole leaves
    same: IndexArray  # (K,) a row of the node, if all its rows are one component; -1 = not known to be


@kernel
def new_forest(tree: Tree) -> Forest:
    """Return the forest of single points."""
    n = len(tree.order)
    roots = np.arange(n + LEAF).astype(np.int32)
    same = np.full(len(tree.start), -1, np.int32)
    points = roots[:n]
    return Forest(
        points.copy(), np.ones(n, np.int32), tree.order.copy(), np.full(n, np.inf), points.copy(), roots, same
    )


@kernel
def drain_bucket(
    tree: Tree,
    leaves: Leaves,
    limits: Criterion,
    forest: Forest,
    queue: PairQueue,
    shortest: Shortest,
    edges: Edges,
    n_edges: int,
    bucket: int,
    first: bool,
    sweep: bool,
) -> int:
    """Open the pairs of a bucket until it is empty, or until edges or queue need room; return the number of edges.

    In the `first` bucket points may coincide. They are united at once, so that many duplicates stay cheap; nodes are
    then looked at again, since their own pairs come before pairs across. A `sweep` leaves out what belongs to later
    buckets.
    """
    tree, leaves, forest = borrowed(tree), borrowed(leaves), borrowed(forest)
    queue, shortest, edges = borrowed(queue), borrowed(shortest), borrowed(edges)
    end = bucket_end(bucket)
    parent, same = forest.parent, forest.same
    while queue.head[index(bucket)] >= 0 and n_edges + LEAF * LEAF <= len(edges.d2) and queue.head[SPACE] >= SPARE:
        a, b = pop(queue, bucket)
        if first:
            for node in (a, b):
                note_uniform(tree, parent, same, node)
        # Between two nodes that are one component each only the shortest edge counts.
        shortest_only = a != b and same[index(a)] >= 0 and same[index(b)] >= 0
        root_a, root_b = 0, 0
        if shortest_only:
            root_a, root_b = find(parent, same[index(a)]), find(parent, same[index(b)])
            known = shortest_between(shortest, root_a, root_b)
            if root_a == root_b or (known < np.inf and box_gap(tree.boxes, a, tree.boxes, b, 0) >= known):
                continue
        elif joined(parent, same, a, b):
            continue
        if tree.right[index(a)] or tree.right[index(b)]:
            open_pair(tree, limits, queue, parent, same, a, b, bucket, sweep)
            continue
        start_a, start_b = np.int64(tree.start[index(a)]), np.int64(tree.start[index(b)])
        found, later = meet_leaves(leaves, forest.roots, limits, start_a, start_b, end, shortest_only, edges, n_edges)
        if later < FAR and not sweep:
            push(queue, a, b, later >> BUCKET_SHIFT)
        if shortest_only and found > n_edges:
            note_shortest(shortest, root_a, root_b, edges.d2[index(n_edges)])
        n_edges = unite_coinciding(forest, edges, n_edges, found) if first else found
    return n_edges


@kernel
def unite_edges(forest: Forest, edges: Edges, order: IntArray) -> int:
    """Unite along edges in the given `order`, shortest first; return the number of unions."""
    forest, edges = borrowed(forest), borrowed(edges)
    unions = 0
    for item in order:
        e = index(item)
        unions += unite(
            forest.parent,
            forest.size,
            forest.elder,
            forest.death,
            forest.into,
            edges.a[e],
            edges.b[e],
            np.sqrt(edges.d2[e]),
        )
    return unions


@kernel
def spanning_edges(forest: Forest, edges: Edges, order: IntArray) -> int:
    """Keep only what can become part of the forest, of edges in the given `order`, shortest first; return how many.

    An edge between points that shorter ones join is in no spanning forest, whatever other edges there are.
    """
    forest, edges = borrowed(forest), borrowed(edges)
    parent = forest.parent.copy()
    kept = new_edges(len(order))
    count = 0
    for item in order:
        e = index(item)
        a, b = find(parent, edges.a[e]), find(parent, edges.b[e])
        if a != b:
            parent[index(a)] = b
            kept.d2[count], kept.a[count], kept.b[count] = edges.d2[e], edges.a[e], edges.b[e]
            count += 1
    edges.d2[:count], edges.a[:count], edges.b[:count] = kept.d2[:count], kept.a[:count], kept.b[:count]
    return count


@kernel
def unite_coinciding(forest, edges, first, n_edges):  # type: ignore[no-untyped-def]
    """Unite along the edges of length zero and keep the others; return the number of edges."""
    kept = first
    for e in range(first, n_edges):
        if edges.d2[e] == 0.0:
            unite(forest.parent, forest.size, forest.elder, forest.death, forest.into, edges.a[e], edges.b[e], 0.0)
        else:
            edges.d2[kept], edges.a[kept], edges.b[kept] = edges.d2[e], edges.a[e], edges.b[e]
            kept += 1
    return kept


@kernel
def refresh_components(tree: Tree, forest: Forest) -> None:
    """Bring `roots` and `same` up to date with the unions so far."""
    tree, forest = borrowed(tree), borrowed(forest)
    for row in range(len(forest.parent)):
        forest.roots[row] = find(forest.parent, row)
    for node in range(len(forest.same) - 1, -1, -1):
        note_uniform(tree, forest.parent, forest.same, node)


@kernel
def merge_tree(forest: Forest) -> tuple[IntArray, IntArray]:
    """Return the smallest id of each point's component, now and at the scale at which the point died, by point id.

    The latter is the point's parent in the merge tree. Unions at one scale come in any order; it does not depend on it.
    """
    n = len(forest.death)
    root, parent = np.empty(n, np.int64), np.empty(n, np.int64)
    for point in range(n):
        # An older point has a smaller id, so what is looked up is there already.
        old = forest.into[index(point)]
        if old == point:
            root[index(point)] = parent[index(point)] = point
            continue
        at_once = forest.death[index(old)] == forest.death[index(point)]
        parent[index(point)] = parent[index(old)] if at_once else old
        root[index(point)] = root[index(old)]
    return root, parent


@inlined
def note_uniform(tree, parent, same, node):  # type: ignore[no-untyped-def]
    """Mark `node` if its children (of a leaf: its rows) are known to be one component."""
    if same[index(node)] >= 0:
        return
    right = tree.right[index(node)]
    if right:
        if joined(parent, same, node + 1, right):
            same[index(node)] = same[index(right)]
        return
    first = tree.start[index(node)]
    root = find(parent, first)
    for row in range(first + 1, tree.stop[index(node)]):
        if find(parent, row) != root:
            return
    same[index(node)] = first


@inlined
def joined(parent, same, a, b):  # type: ignore[no-untyped-def]
    """Whether all points of both nodes are known to be one component."""
    row_a, row_b = same[index(a)], same[index(b)]
    return row_a >= 0 and row_b >= 0 and find(parent, row_a) == find(parent, row_b)


@inlined
def open_pair(tree, limits, queue, parent, same, a, b, bucket, sweep):  # type: ignore[no-untyped-def]
    """Replace a pair by those of the children of both nodes that matter."""
    right_a, right_b = tree.right[index(a)], tree.right[index(b)]
    for c in (a + 1, right_a) if right_a else (a, 0):
        for d in (b + 1, right_b) if right_b else (b, 0):
            if c and d and (a != b or c < d):
                wait(tree, limits, queue, parent, same, c, d, bucket, sweep)
    if a == b:
        # Last in, first out: a node's own pairs come before the pair across, which then often falls away.
        push(queue, a + 1, a + 1, bucket)
        push(queue, right_a, right_a, bucket)


@inlined
def wait(tree, limits, queue, parent, same, a, b, bucket, sweep):  # type: ignore[no-untyped-def]
    """Let a pair of two nodes wait for its scale, if it matters."""
    if joined(parent, same, a, b):
        return
    gap = box_gap(tree.boxes, a, tree.boxes, b, 0)
    # False for NaN, so that a pair is only dropped for a reason.
    if (
        gap > limits.reach
        or box_gap(tree.boxes, a, tree.boxes, b, 1) > limits.color_high
        or box_gap(tree.boxes, a, tree.boxes, b, 2) > limits.chord_high
    ):
        return
    place = max(bucket, bucket_of(gap))
    if place == bucket or not sweep:
        push(queue, a, b, place)


@kernel
def nearest_in_leaves(leaves: Leaves, n_leaves: int) -> FloatArray:
    """Return, sorted, the squared distances to the nearest point of the same leaf, for the points of some leaves."""
    points, order, total = leaves.points, leaves.order, len(leaves.errors)
    nearest = np.full(n_leaves * LEAF, np.inf)
    for sample in range(n_leaves):
        start = sample * total // n_leaves * LEAF
        stop = min(start + LEAF, len(order))
        for i in range(start, stop):
            for j in range(start, stop):
                p, q = order[i], order[j]
                dx, dy, dz = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1], points[q, 2] - points[p, 2]
                d2 = dx * dx + dy * dy + dz * dz
                if i != j and d2 < nearest[sample * LEAF + i - start]:
                    nearest[sample * LEAF + i - start] = d2
    return np.sort(nearest)
