# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Patches that grow along the edges of the graph, as Dijkstra's shortest paths do, the least cost first."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.beyond.supervoxels.point_queue import bucket_of, least_bucket, new_queue, put_point, take_point
from topo_region_seg.compiled.dialect import borrowed, index, inlined, kernel
from topo_region_seg.data import BoolArray, FloatArray, IndexArray

LANES = 12
"""Of what points are compared by: position, color and normal, each with a fourth that is zero, as vectors have it."""
FREE = -1
_COUNT = LANES - 1  # lane of the sums that holds how many points there are


class Patches(NamedTuple):
    """N points, the edges between them and the patches that they are in; a patch has the number of its seed."""

    xyz: FloatArray  # (N, 3), metres
    traits: npt.NDArray[np.float32]  # (N, LANES); a missing normal is NaN
    near: IndexArray  # (N, K) points that a point has edges to; N where there are fewer
    alike: BoolArray  # (N, K) whether the criterion holds along the edge
    patch: IndexArray  # (N,), FREE where a point is in none
    sums: FloatArray  # (N, LANES) of the traits of a patch's points
    mean: npt.NDArray[np.float32]  # (N, LANES) of a patch's traits
    cost: npt.NDArray[np.float32]  # (N,) of a free point, in the best patch that has reached it; inf = none
    best_patch: IndexArray  # (N,) that patch
    before: IndexArray  # (N,) links of the queue of points
    after: IndexArray


@kernel
def grow_patches(
    patches: Patches, points: IndexArray, seeds: IndexArray, alike: bool, reseed: bool, bound: float, unit: float
) -> None:
    """Give free points to the patches that are most like them when they reach them, in place.

    The cost of a point is its squared difference in traits from the mean of a patch when that reaches it. The least
    cost comes first, to within a sixteenth.

    Parameters
    ----------
    patches : Patches
        The points; no patch has reached the free ones. All patches there are go on growing.
    points : (M,) int32
        The free points, or all.
    seeds : (S,) int32
        Free points that new patches begin with.
    alike : bool
        Whether only edges count along which the criterion holds.
    reseed : bool
        Whether each point in turn that no patch reaches begins one more.
    bound : float
        Largest distance of a point from the seed of its patch, metres.
    unit : float
        Length of the traits of a normal.
    """
    patches, points, seeds = borrowed(patches), borrowed(points), borrowed(seeds)
    queue = new_queue(patches.before, patches.after)
    bound2 = bound * bound
    n, most = patches.near.shape
    grown = np.any(patches.patch != FREE)
    for s in seeds:
        start_patch(patches, queue, s)
    for q in points:
        for k in range(most if grown else 0):
            p = patches.near[q, k]
            if p < n and patches.patch[q] == FREE and patches.patch[p] != FREE and (patches.alike[q, k] or not alike):
                relax(patches, queue, np.int64(q), np.int64(patches.patch[p]), bound2)
    for place in range(len(points) + 1):
        while True:
            bucket = least_bucket(queue)
            if bucket < 0:
                break
            p = np.int64(queue.head[index(bucket)])
            take_point(queue, p, bucket)
            owner = np.int64(patches.best_patch[index(p)])
            patches.patch[index(p)] = owner
            add_point(patches, p, owner, unit)
            for k in range(most):
                q = np.int64(patches.near[index(p), index(k)])
                if q < n and patches.patch[index(q)] == FREE and (patches.alike[index(p), index(k)] or not alike):
                    relax(patches, queue, q, owner, bound2)
        if reseed and place < len(points) and patches.patch[points[place]] == FREE:
            start_patch(patches, queue, points[place])


@kernel
def start_patch(patches, queue, seed):  # type: ignore[no-untyped-def]
    """Start a patch: its seed joins it at no cost."""
    patches.sums[seed] = 0.0
    patches.cost[seed], patches.best_patch[seed] = 0.0, seed
    put_point(queue, np.int64(seed), bucket_of(0.0))


@inlined
def relax(patches, queue, point, owner, bound2):  # type: ignore[no-untyped-def]
    """Let a patch reach a free point; of two at the same cost, the patch of the smaller number is the better."""
    p, o = index(point), index(owner)
    dx = patches.xyz[p, 0] - patches.xyz[o, 0]
    dy = patches.xyz[p, 1] - patches.xyz[o, 1]
    dz = patches.xyz[p, 2] - patches.xyz[o, 2]
    if dx * dx + dy * dy + dz * dz <= bound2:
        cost = difference(patches.traits, patches.mean, p, o)
        old = patches.cost[p]
        if cost < old:
            patches.cost[p], patches.best_patch[p] = cost, owner
            bucket = bucket_of(cost)
            if old == np.inf:
                put_point(queue, point, bucket)
            elif bucket_of(old) != bucket:
                take_point(queue, point, bucket_of(old))
                put_point(queue, point, bucket)
        elif cost == old and owner < patches.best_patch[p]:
            patches.best_patch[p] = owner


@kernel
def difference(traits, mean, p, o):  # type: ignore[no-untyped-def]
    """Return the squared difference of a point's traits from a mean; a missing normal does not count."""
    difference, turn = np.float32(0.0), np.float32(0.0)
    for c in range(8):
        difference += (traits[p, index(c)] - mean[o, index(c)]) ** 2
    for c in range(8, LANES):
        turn += (traits[p, index(c)] - mean[o, index(c)]) ** 2
    return difference + turn if turn == turn else difference


@kernel
def add_point(patches, point, owner, unit):  # type: ignore[no-untyped-def]
    """Add a point to its patch, whose mean normal has the length of one; a missing normal counts in no direction."""
    p, o = index(point), index(owner)
    traits, sums, mean = patches.traits, patches.sums, patches.mean
    sums[o, _COUNT] += 1.0
    share = 1.0 / sums[o, _COUNT]
    for c in range(8):
        sums[o, index(c)] += traits[p, index(c)]
        mean[o, index(c)] = sums[o, index(c)] * share
    length2 = 0.0
    for c in range(8, 11):
        value = traits[p, index(c)]
        sums[o, index(c)] += value if value == value else 0.0
        length2 += sums[o, index(c)] ** 2
    longer = unit / np.sqrt(length2) if length2 > 0.0 else 0.0
    for c in range(8, 11):
        mean[o, index(c)] = sums[o, index(c)] * longer
