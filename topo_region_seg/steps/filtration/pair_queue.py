# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Pairs of tree nodes that wait for the scale at which they can first matter."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.data import IndexArray

BUCKET_SHIFT = 52  # a bucket is the exponent of a squared distance (float64): each reaches 1.41 times as far
BUCKETS = 1 << (63 - BUCKET_SHIFT)  # of all numbers without a sign
FREE, SPACE = BUCKETS, BUCKETS + 1  # cells of `head` that hold the list of free cells and their number
SPARE = 4  # cells that opening one pair may take: its nodes have two children each


class PairQueue(NamedTuple):
    """Pairs of nodes in linked lists, one list a bucket."""

    head: IndexArray  # (BUCKETS + 2,) first cell of the bucket; -1 = empty
    a: IndexArray
    b: IndexArray
    after: IndexArray  # next cell of the list; -1 = end


@kernel
def new_queue(capacity: int) -> PairQueue:
    """Return an empty queue."""
    head = np.full(BUCKETS + 2, -1, np.int32)
    after = np.arange(1, capacity + 1).astype(np.int32)
    after[-1] = -1
    head[FREE] = 0
    head[SPACE] = capacity
    return PairQueue(head, np.empty(capacity, np.int32), np.empty(capacity, np.int32), after)


@kernel
def grown_queue(queue: PairQueue) -> PairQueue:
    """Return a queue of twice the capacity with the same pairs."""
    old = len(queue.after)
    grown = new_queue(2 * old)
    grown.a[:old] = queue.a
    grown.b[:old] = queue.b
    grown.after[:old] = queue.after
    grown.after[-1] = queue.head[FREE]
    grown.head[:] = queue.head
    grown.head[FREE] = old
    grown.head[SPACE] += old
    return grown


@inlined
def push(queue, a, b, bucket):  # type: ignore[no-untyped-def]
    """Put a pair in front of a bucket; the queue must have space."""
    cell = queue.head[FREE]
    place = index(cell)
    queue.head[FREE] = queue.after[place]
    queue.head[SPACE] -= 1
    queue.a[place] = a
    queue.b[place] = b
    queue.after[place] = queue.head[index(bucket)]
    queue.head[index(bucket)] = cell


@kernel
def put(queue: PairQueue, a: int, b: int, bucket: int) -> None:
    """Put a pair in front of a bucket."""
    push(queue, a, b, bucket)


@inlined
def pop(queue, bucket):  # type: ignore[no-untyped-def]
    """Take the first pair of a bucket that is not empty."""
    cell = queue.head[index(bucket)]
    place = index(cell)
    queue.head[index(bucket)] = queue.after[place]
    queue.after[place] = queue.head[FREE]
    queue.head[FREE] = cell
    queue.head[SPACE] += 1
    return queue.a[place], queue.b[place]


@kernel
def pairs_in(queue: PairQueue, bucket: int) -> int:
    """Return how many pairs a bucket holds."""
    count, cell = 0, queue.head[bucket]
    while cell >= 0:
        count += 1
        cell = queue.after[cell]
    return count


@kernel
def move_pairs(source: PairQueue, target: PairQueue, bucket: int, wanted: int) -> int:
    """Move pairs of a bucket, as many as are wanted and there is space for; return how many."""
    moved: int = min(wanted, np.int64(target.head[SPACE]))
    for _ in range(moved):
        a, b = pop(source, bucket)
        push(target, a, b, bucket)
    return moved


@inlined
def bits_of(d2):  # type: ignore[no-untyped-def]
    """Return the bits of a non-negative float64 as an integer: they rise with the number."""
    return np.float64(d2).view(np.int64)


@inlined
def bucket_of(d2):  # type: ignore[no-untyped-def]
    """Return the bucket of a squared distance."""
    return bits_of(d2) >> BUCKET_SHIFT


@inlined
def bucket_end(bucket):  # type: ignore[no-untyped-def]
    """Return the bits of the first squared distance past `bucket`."""
    return np.int64(bucket + 1) << BUCKET_SHIFT
