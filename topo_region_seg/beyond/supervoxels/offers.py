# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Offers for points, the least first to within a sixteenth; of each point only the best one waits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.compiled.lanes import trailing_zeros
from topo_region_seg.data import IndexArray

SHIFT = 19  # a bucket is the exponent of a cost (float32) and the first four bits after it
WORD = 6  # 1 << WORD buckets, whose bits make a word
WORDS = 1 << WORD


class Offers(NamedTuple):
    """Points in linked lists, one list a bucket of costs."""

    head: IndexArray  # (WORDS << WORD,) last point put into the bucket; -1 = empty
    filled: npt.NDArray[np.int64]  # (WORDS + 1,) a bit for each bucket that is not empty, then one for each such word
    before: IndexArray  # (N,) neighbors of each point in its list; -1 = none
    after: IndexArray


@kernel
def new_offers(before: IndexArray, after: IndexArray) -> Offers:
    """Return an empty queue with `before` and `after`, (N,), for its links."""
    return Offers(np.full(WORDS << WORD, -1, np.int32), np.zeros(WORDS + 1, np.int64), before, after)


@inlined
def bucket_of(cost):  # type: ignore[no-untyped-def]
    """Return the bucket of a cost, 0 or more."""
    return np.int64(np.float32(cost).view(np.int32) >> SHIFT)


@inlined
def put_offer(offers, point, bucket):  # type: ignore[no-untyped-def]
    """Put a point that is in no bucket into one."""
    head = offers.head[index(bucket)]
    offers.before[index(point)], offers.after[index(point)] = -1, head
    if head >= 0:
        offers.before[index(head)] = point
    offers.head[index(bucket)] = point
    word = bucket >> WORD
    offers.filled[index(word)] |= np.int64(1) << (bucket & (WORDS - 1))
    offers.filled[WORDS] |= np.int64(1) << word


@inlined
def drop_offer(offers, point, bucket):  # type: ignore[no-untyped-def]
    """Take a point out of its bucket."""
    before, after = offers.before[index(point)], offers.after[index(point)]
    if after >= 0:
        offers.before[index(after)] = before
    if before >= 0:
        offers.after[index(before)] = after
    else:
        offers.head[index(bucket)] = after
        if after < 0:
            word = bucket >> WORD
            offers.filled[index(word)] &= ~(np.int64(1) << (bucket & (WORDS - 1)))
            if offers.filled[index(word)] == 0:
                offers.filled[WORDS] &= ~(np.int64(1) << word)


@inlined
def least_bucket(offers):  # type: ignore[no-untyped-def]
    """Return the bucket of the least costs; -1 if all are empty."""
    bucket = np.int64(-1)
    if offers.filled[WORDS] != 0:
        word = np.int64(trailing_zeros(offers.filled[WORDS]))
        bucket = (word << WORD) + np.int64(trailing_zeros(offers.filled[index(word)]))
    return bucket
