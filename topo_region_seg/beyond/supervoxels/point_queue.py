# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A priority queue of points in buckets of like costs: a point is moved as soon as its cost falls."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.compiled.lanes import trailing_zeros
from topo_region_seg.data import IndexArray

FRACTION_BITS = 4  # of a cost that tell buckets apart beside its exponent: costs in one differ by less than 1/16
SHIFT = 23 - FRACTION_BITS  # a float32 has 23 bits of fraction
WORD = 6  # 1 << WORD buckets, whose bits make a word
WORDS = 1 << WORD  # words, whose bits make one more: the 4096 buckets reach to 2**129, past all of float32


class PointQueue(NamedTuple):
    """Points in doubly linked lists, one list a bucket of costs."""

    head: IndexArray  # (WORDS << WORD,) last point put into the bucket; -1 = empty
    filled: npt.NDArray[np.int64]  # (WORDS + 1,) a bit for each bucket that is not empty, then one for each such word
    before: IndexArray  # (N,) neighbors of each point in its list; -1 = none
    after: IndexArray


@kernel
def new_queue(before: IndexArray, after: IndexArray) -> PointQueue:
    """Return an empty queue with `before` and `after`, (N,), for its links."""
    return PointQueue(np.full(WORDS << WORD, -1, np.int32), np.zeros(WORDS + 1, np.int64), before, after)


@inlined
def bucket_of(cost):  # type: ignore[no-untyped-def]
    """Return the bucket of a cost, 0 or more."""
    return np.int64(np.float32(cost).view(np.int32) >> SHIFT)


@inlined
def put_point(queue, point, bucket):  # type: ignore[no-untyped-def]
    """Put a point that is in no bucket into one."""
    head = queue.head[index(bucket)]
    queue.before[index(point)], queue.after[index(point)] = -1, head
    if head >= 0:
        queue.before[index(head)] = point
    queue.head[index(bucket)] = point
    word = bucket >> WORD
    queue.filled[index(word)] |= np.int64(1) << (bucket & (WORDS - 1))
    queue.filled[WORDS] |= np.int64(1) << word


@inlined
def take_point(queue, point, bucket):  # type: ignore[no-untyped-def]
    """Take a point out of its bucket."""
    before, after = queue.before[index(point)], queue.after[index(point)]
    if after >= 0:
        queue.before[index(after)] = before
    if before >= 0:
        queue.after[index(before)] = after
    else:
        queue.head[index(bucket)] = after
        if after < 0:
            word = bucket >> WORD
            queue.filled[index(word)] &= ~(np.int64(1) << (bucket & (WORDS - 1)))
            if queue.filled[index(word)] == 0:
                queue.filled[WORDS] &= ~(np.int64(1) << word)


@inlined
def least_bucket(queue):  # type: ignore[no-untyped-def]
    """Return the bucket of the least costs; -1 if all are empty."""
    bucket = np.int64(-1)
    if queue.filled[WORDS] != 0:
        word = np.int64(trailing_zeros(queue.filled[WORDS]))
        bucket = (word << WORD) + np.int64(trailing_zeros(queue.filled[index(word)]))
    return bucket
