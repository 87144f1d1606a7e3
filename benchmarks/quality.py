# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How well regions fit the true objects."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from benchmarks.recordings import FIRST_OBJECT


def weighted_overlap(truth: npt.NDArray[np.uint32], labels: npt.NDArray[np.uint32]) -> float:
    """Return the mean overlap of each true segment with the region that covers most of it, weighted by size.

    Parameters
    ----------
    truth : (N,) uint32
        Segments from 20 on are objects; 0 are points without a depth, which do not count.
    labels : (N,) uint32
        Regions; 0 = none.

    Returns
    -------
    float
        sum |G| |G ∩ S| / |G ∪ S| / sum |G|, 0 to 1; 1 is perfect.
    """
    known = truth > 0
    truth, labels = truth[known], labels[known]
    shared = np.zeros((int(np.max(truth, initial=0)) + 1, int(np.max(labels, initial=0)) + 1), np.int64)
    np.add.at(shared, (truth, labels), 1)
    segments = np.flatnonzero(shared.sum(axis=1)[FIRST_OBJECT:]) + FIRST_OBJECT
    region_sizes = shared.sum(axis=0)
    weighted = total = 0.0
    for segment in segments:
        size = shared[segment].sum()
        total += size
        if shared.shape[1] > 1:
            region = 1 + int(np.argmax(shared[segment, 1:]))
            common = shared[segment, region]
            weighted += size * common / (size + region_sizes[region] - common)
    return weighted / total if total else float("nan")
