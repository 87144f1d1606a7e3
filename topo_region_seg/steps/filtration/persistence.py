# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The filtration and its zeroth persistent homology (paper, sections IV.A, IV.B, IV.D)."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.compiled.kd_tree import LEAF, Tree, build_tree, ordered_tree
from topo_region_seg.compiled.order import order_of
from topo_region_seg.compiled.predicate import Criterion
from topo_region_seg.compiled.threads import side_by_side, threads
from topo_region_seg.data import Components, FloatArray, IntArray
from topo_region_seg.steps.filtration.leaf_pairs import Edges, Leaves, gather_leaves, grown_edges, new_edges
from topo_region_seg.steps.filtration.pair_queue import (
    BUCKET_SHIFT,
    FREE,
    SPACE,
    SPARE,
    PairQueue,
    grown_queue,
    move_pairs,
    new_queue,
    pairs_in,
    put,
)
from topo_region_seg.steps.filtration.rips import (
    Forest,
    drain_bucket,
    merge_tree,
    nearest_in_leaves,
    new_forest,
    refresh_components,
    spanning_edges,
    unite_edges,
)
from topo_region_seg.steps.filtration.shortest import new_shortest

# Chosen by time and memory; no result depends on them. `python -m benchmarks.tricks constants` shows the choices.
POSITION_WEIGHT = 4.0  # nodes are split by position until they are this much smaller than the radius
WAITING_LIMIT = 2  # waiting pairs per point above which the points fill a volume: surfaces need half as many
VOLUME_POSITION_WEIGHT = 4.0  # how much more position then weighs in splitting nodes
SWEEPS = 6  # scales that are joined then before pairs are kept again
SPARE_EDGES = 1  # edges per point found at one scale above which those that no forest needs are dropped
PAIRS_FOR_MORE = 4_000  # pairs in a bucket from which on other threads are woken
POINTS_FOR_MORE = 1_000  # points for each thread, at least
STALE_SHARE = 0.01  # share of the points whose components may change before the nodes are marked again
MARKING = 0.1  # pairs in a bucket, per point, that cost more than marking the nodes again does


def filtration(
    channels: FloatArray,
    limits: Criterion,
    max_radius: float,
    by_position: Tree | None = None,
    *,
    needs_normals: bool = False,
) -> Components:
    """Compute H0 of the Vietoris-Rips filtration whose edges satisfy the homogeneity criterion.

    Parameters
    ----------
    channels : (N, 9) float64
        Positions (m), colors and unit normals, as `homogeneity_channels` returns them.
    limits : Criterion
        The criterion, and the largest scale.
    max_radius : float
        The largest scale, metres.
    by_position : Tree, optional
        Tree over the positions; not needed, but it saves building most of another one.
    needs_normals : bool
        Whether a point without a normal has nothing to be compared by, and stays alone.

    Returns
    -------
    Components
        `root`, `parent` and exact `death` of every point.
    """
    n = len(channels)
    if needs_normals:
        rows = np.flatnonzero(~np.isnan(channels[:, 6]))
        root, parent, death = np.arange(n), np.arange(n), np.full(n, np.inf)
        some = np.ascontiguousarray(channels[rows])
        sub_root, sub_parent, sub_death = _grow(some, limits, by_position and _tree_of_some(by_position, some, rows))
        root[rows], parent[rows], death[rows] = rows[sub_root], rows[sub_parent], sub_death
    else:
        root, parent, death = _grow(channels, limits, by_position)
    return Components(root=root, parent=parent, death=death, max_radius=max_radius)


def _tree_of_some(tree: Tree, channels: FloatArray, rows: IntArray) -> Tree:
    """Return the tree over positions of some points, `rows` (M,) of those of a tree, from their `channels` (M, 9)."""
    number = np.full(len(tree.order), -1, np.int32)
    number[rows] = np.arange(len(rows), dtype=np.int32)
    order = number[tree.order]
    return ordered_tree(order[order >= 0], channels[:, :3])


def split_weights(limits: Criterion) -> FloatArray:
    """Weights under which the tree splits: each channel in units of what the criterion tells apart."""

    def weight(square: float) -> float:
        return 1.0 / math.sqrt(square) if square > 0.0 and math.isfinite(square) else 0.0

    return np.repeat([POSITION_WEIGHT * weight(limits.reach), weight(limits.color_high), weight(limits.chord_high)], 3)


def _grow(
    channels: FloatArray, limits: Criterion, by_position: Tree | None = None
) -> tuple[IntArray, IntArray, FloatArray]:
    """Go through the scales from the smallest to the largest; return root, parent and death by point id."""
    weights = split_weights(limits)
    tree, forest, workers, bucket = _begin(channels, weights, limits, by_position)
    _open_root(workers, tree, bucket, first=True, sweep=False)
    if any(worker.crowded for worker in workers):
        # Points fill a volume. Leaves that are narrow in color and normal lie across each other in it, so position
        # must weigh more. Far fewer pairs wait if the points of the smallest scales are joined first, each time from
        # the root and without keeping a pair.
        workers.clear()  # frees the pairs that wait
        weights[:3] *= VOLUME_POSITION_WEIGHT
        tree, forest, workers, first = _begin(channels, weights, limits, by_position)
        for bucket in range(first, first + SWEEPS):
            _open_root(workers, tree, bucket, first=bucket == first, sweep=True)
            unite_edges(forest, *_by_length(workers))
            refresh_components(tree, forest)
        bucket += 1
        _open_root(workers, tree, bucket, first=False, sweep=False)
    stale = 0
    while True:
        stale += unite_edges(forest, *_by_length(workers))
        waiting = [worker.next_bucket(bucket + 1) for worker in workers]
        if all(b is None for b in waiting) or np.max(forest.size) == len(channels):
            return *merge_tree(forest), forest.death
        bucket = min(b for b in waiting if b is not None)
        pairs = _even_out([worker.queue for worker in workers], bucket)
        if stale > STALE_SHARE * len(channels) or (stale and pairs > MARKING * len(channels)):
            refresh_components(tree, forest)
            stale = 0
        if pairs < PAIRS_FOR_MORE:
            for worker in workers:
                worker.drain(bucket)
        else:
            side_by_side(_Worker.drain, [(worker, bucket) for worker in workers])


def _begin(
    channels: FloatArray, weights: FloatArray, limits: Criterion, by_position: Tree | None
) -> tuple[Tree, Forest, list[_Worker], int]:
    """Build the tree; return it with the forest of single points, the workers and the first bucket."""
    tree = build_tree(channels, weights, by_position)
    forest = new_forest(tree)
    leaves = gather_leaves(tree, channels)
    count = max(1, min(threads(), len(channels) // POINTS_FOR_MORE))
    return tree, forest, [_Worker(tree, leaves, limits, forest) for _ in range(count)], _first_bucket(leaves)


def _first_bucket(leaves: Leaves) -> int:
    """Bucket of a scale below which few points have neighbors; all shorter edges are taken in one go."""
    nearest = nearest_in_leaves(leaves, min(256, len(leaves.errors)))
    nearest = nearest[np.isfinite(nearest)]
    if len(nearest) == 0:
        return 0
    # The low quantile guards against clouds of which a part is far denser than the rest.
    low, median = nearest[len(nearest) // 50], nearest[len(nearest) // 2]
    return int(np.float64(min(median, 16.0 * low)).view(np.int64)) >> BUCKET_SHIFT


def _open_root(workers: list[_Worker], tree: Tree, bucket: int, *, first: bool, sweep: bool) -> None:
    """Open a bucket from the root: each subtree by a worker of its own, then the pairs across, from the leaves up."""
    if len(tree.order) == 0:
        return
    below, steps = [0], list[list[tuple[int, int]]]()
    while tree.right[below[0]] and len(below) < max(2, len(workers)):
        halves = [(node + 1, int(tree.right[node])) for node in below]
        below = [node for pair in halves for node in pair]
        steps.append(halves)
    steps.append([(node, node) for node in below])
    for pairs in reversed(steps):
        for place, pair in enumerate(pairs):
            put(workers[place % len(workers)].queue, *pair, bucket)
        side_by_side(_Worker.drain, [(worker, bucket, first, sweep) for worker in workers[: len(pairs)]])
        if any(worker.crowded for worker in workers):
            return


def _even_out(queues: list[PairQueue], bucket: int) -> int:
    """Move pairs of a bucket so that all queues hold about as many; return how many pairs there are."""
    counts = [pairs_in(queue, bucket) for queue in queues]
    total, step = sum(counts), 1
    # Halves of ever larger groups of queues.
    while step < len(queues):
        for i in range(len(queues) - step):
            j = i + step
            if i & step:
                continue
            source, target = (i, j) if counts[i] > counts[j] else (j, i)
            moved = move_pairs(queues[source], queues[target], bucket, (counts[source] - counts[target]) // 2)
            counts[source] -= moved
            counts[target] += moved
        step *= 2
    return total


def _by_length(workers: list[_Worker]) -> tuple[Edges, IntArray]:
    """Gather what the workers found at a scale; return it with the order by length."""
    d2, a, b = zip(*(worker.take() for worker in workers), strict=True)
    edges = Edges(np.concatenate(d2), np.concatenate(a), np.concatenate(b))
    return edges, order_of(edges.d2)


class _Worker:
    """Pairs of nodes that wait, and the edges found at the current scale; one for each thread."""

    def __init__(self, tree: Tree, leaves: Leaves, limits: Criterion, forest: Forest) -> None:
        # Small, so that warming up already makes them grow.
        self.queue = new_queue(64)
        self._edges = new_edges(64)
        self._shortest = new_shortest()
        self._n_edges = 0
        self.crowded = False
        self._tree, self._leaves, self._limits, self._forest = tree, leaves, limits, forest

    def drain(self, bucket: int, first: bool = False, sweep: bool = False) -> None:
        """Open all pairs of a bucket; the first one only until too many pairs wait: the worker is `crowded` then."""
        n = len(self._forest.parent)
        while self.queue.head[bucket] >= 0:
            if self._n_edges + LEAF * LEAF > len(self._edges.d2):
                if len(self._edges.d2) >= SPARE_EDGES * n:
                    order = order_of(self._edges.d2[: self._n_edges])
                    self._n_edges = spanning_edges(self._forest, self._edges, order)
                if self._n_edges + LEAF * LEAF > len(self._edges.d2) // 2:
                    self._edges = grown_edges(self._edges)
            if self.queue.head[SPACE] < SPARE:
                if first and not sweep and len(self.queue.after) >= WAITING_LIMIT * n:
                    self.crowded = True
                    return
                self.queue = grown_queue(self.queue)
            self._n_edges = drain_bucket(
                self._tree,
                self._leaves,
                self._limits,
                self._forest,
                self.queue,
                self._shortest,
                self._edges,
                self._n_edges,
                bucket,
                first,
                sweep,
            )

    def next_bucket(self, start: int) -> int | None:
        """Return the first bucket from `start` on that holds a pair."""
        filled = np.flatnonzero(self.queue.head[start:FREE] >= 0)
        return start + int(filled[0]) if len(filled) else None

    def take(self) -> Edges:
        """Return the edges found, and forget them."""
        n, self._n_edges = self._n_edges, 0
        d2, a, b = self._edges
        return Edges(d2[:n], a[:n], b[:n])
