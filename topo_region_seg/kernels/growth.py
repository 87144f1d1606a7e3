# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Patches that grow from seeds along the edges of the graph, the most similar point first."""

from __future__ import annotations

from heapq import heappop, heappush

import numpy as np

from topo_region_seg.data import FloatArray, IndexArray, IntArray
from topo_region_seg.kernels.borrow import borrowed
from topo_region_seg.kernels.compile import kernel
from topo_region_seg.kernels.leaf_pairs import Criterion


@kernel
def grow_patches(
    channels: FloatArray,
    near: IndexArray,
    patch: IntArray,
    seed: IntArray,
    n_old: int,
    n_patches: int,
    limits: Criterion,
    alike: bool,
    bound: float,
    unit: FloatArray,
) -> int:
    """Give the free points to the patches that reach them at the smallest cost, in place; return how many patches.

    `near` (N, K) is the points that a point may have edges to, N where there are fewer, `patch` (N,) the patch of a
    point, -1 where it is free, and `seed` (N,) begins with the seeds of `n_patches` patches, of which the first `n_old`
    go on from the points they have. An edge is no longer than `limits` say and, if `alike`, joins points that the
    criterion holds for; then also each point in turn that no patch reaches becomes the seed of one more. A point joins
    a patch only within `bound` (m) of its seed. Its cost is the squared difference from the patch's mean so far, of
    position, color and normal in units of `unit` (3,).
    """
    channels, near = borrowed(channels), borrowed(near)
    count, sums = np.zeros(len(patch)), np.zeros((len(patch), 9))
    queue = [(0.0, np.int64(0), np.int64(0)) for _ in range(0)]
    for p in range(len(patch)):
        if patch[p] >= 0:
            add_point(channels, p, patch[p], count, sums)
    for p in range(len(patch)):
        if patch[p] >= 0:
            put_neighbors(channels, near, patch, seed, limits, alike, bound, unit, count, sums, queue, p, patch[p])
    for owner in range(n_old, n_patches):
        heappush(queue, (0.0, seed[owner], np.int64(owner)))
    for start in range(len(patch) + 1):
        while len(queue):
            _, p, owner = heappop(queue)
            if patch[p] >= 0:
                continue
            patch[p] = owner
            add_point(channels, p, owner, count, sums)
            put_neighbors(channels, near, patch, seed, limits, alike, bound, unit, count, sums, queue, p, owner)
        if alike and start < len(patch) and patch[start] < 0:
            seed[n_patches] = start
            heappush(queue, (0.0, np.int64(start), np.int64(n_patches)))
            n_patches += 1
    return n_patches


@kernel
def add_point(channels, p, owner, count, sums):  # type: ignore[no-untyped-def]
    """Add a point to the sums of its patch; without a normal it counts in no direction."""
    count[owner] += 1.0
    for c in range(9):
        value = channels[p, c]
        sums[owner, c] += value if value == value else 0.0


@kernel
def put_neighbors(  # type: ignore[no-untyped-def]
    channels, near, patch, seed, limits, alike, bound, unit, count, sums, queue, p, owner
):
    """Put the free neighbors of a point of patch `owner` into the queue."""
    at = seed[owner]
    length2 = sums[owner, 6] ** 2 + sums[owner, 7] ** 2 + sums[owner, 8] ** 2
    shorten = 1.0 / np.sqrt(length2) if length2 > 0.0 else 0.0
    for k in range(near.shape[1]):
        q = np.int64(near[p, k])
        if q >= len(patch) or patch[q] >= 0:
            continue
        edge, color, chord, far = 0.0, 0.0, 0.0, 0.0
        place, shade, turn = 0.0, 0.0, 0.0
        for c in range(3):
            edge += (channels[q, c] - channels[p, c]) ** 2
            color += (channels[q, 3 + c] - channels[p, 3 + c]) ** 2
            chord += (channels[q, 6 + c] - channels[p, 6 + c]) ** 2
            far += (channels[q, c] - channels[at, c]) ** 2
            place += (channels[q, c] - sums[owner, c] / count[owner]) ** 2
            shade += (channels[q, 3 + c] - sums[owner, 3 + c] / count[owner]) ** 2
            turn += (channels[q, 6 + c] - sums[owner, 6 + c] * shorten) ** 2
        if edge > limits.reach or far > bound * bound:
            continue
        if alike and (
            color > limits.color_high
            or color < limits.color_low
            or chord > limits.chord_high  # false for NaN: a point without a normal is judged by color alone
            or chord < limits.chord_low
        ):
            continue
        cost = place / (unit[0] * unit[0]) + shade / (unit[1] * unit[1])
        if turn == turn:
            cost += turn / (unit[2] * unit[2])
        heappush(queue, (cost, q, np.int64(owner)))
