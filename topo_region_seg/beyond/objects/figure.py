# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Figure and ground: how sure it is that a segment is a thing, told along its outline."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from topo_region_seg.steps.view.label_image import Labels
from topo_region_seg.steps.view.outlines import OCCLUDED, OWN, TOUCHING, Relations
from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray


class Evidence(NamedTuple):
    """Shares of the outline of each segment, (L,); entry 0 is not used."""

    own: FloatArray
    occluded: FloatArray
    stands: FloatArray
    touches: FloatArray
    behind: FloatArray
    walls: FloatArray
    frame: FloatArray
    void: FloatArray
    flanked: FloatArray


def evidence(found: Relations, n: int, flanked) -> Evidence:
    """`n` segments (0 included), then support `n` and behind `n + 1`."""
    total = np.maximum(np.bincount(found.first, found.count.sum(axis=1), n + 3) + found.frame + found.void, 1.0)[:n]

    def share(kind, chosen):
        return np.bincount(found.first[chosen], found.count[chosen, kind], n + 3)[:n] / total

    every, support, behind = np.ones(len(found.first), np.bool_), found.second == n, found.second == n + 1
    wall = found.second == n + 2
    return Evidence(
        own=share(OWN, every),
        occluded=share(OCCLUDED, every),
        stands=share(TOUCHING, support),
        touches=share(TOUCHING, ~support & ~behind & ~wall),
        behind=share(TOUCHING, behind),
        walls=share(TOUCHING, wall),
        frame=found.frame[:n] / total,
        void=found.void[:n] / total,
        flanked=flanked / total,
    )


@kernel
def flanked_pixels(both: Labels, height: int, width: int, n: int, near: int) -> FloatArray:
    """Return how many pixels at the image's edge each segment (n,) has with the support on both sides along that edge."""
    flanked = np.zeros(n)
    for side in range(4):
        if side == near:
            continue
        length = width if side < 2 else height
        stride = 1 if side < 2 else width
        inner = width if side < 2 else 1
        start = 0
        if side == 1:
            start = (height - 1) * width
        if side == 3:
            start = width - 1
        inward = inner if side == 0 or side == 2 else -inner
        before, run, count = np.int64(-1), np.int64(0), 0
        for i in range(length):
            # The first label within four pixels of the edge.
            label = np.int64(0)
            for k in range(5):
                label = np.int64(both[start + i * stride + k * inward])
                if label != 0:
                    break
            if label == 0 or label == run:
                count += 1 if label != 0 else 0
                continue
            if 0 < run < n and (label == n and (before == n or near == 1 and side > 1)):
                flanked[run] += count
            if run != 0:
                before = run
            run, count = label, 1
    return flanked
