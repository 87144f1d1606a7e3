# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels of pixels: sizes, numbers, and how wide each label is."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import BoolArray, FloatArray, IntArray

Labels = npt.NDArray[np.int32]


def kept_labels(label: Labels, keep: BoolArray) -> Labels:
    """Return labels (P,) numbered from 1 again, 0 where `keep` (L,) is not; entry 0 of `keep` is not looked at."""
    keep = keep.copy()
    keep[:1] = False
    return np.where(keep, np.cumsum(keep), 0).astype(np.int32)[label]


def sizes_of(label: Labels) -> IntArray:
    """Return how many pixels each label has, (L,), 0 included."""
    return np.bincount(label)


@kernel
def half_widths(label: Labels, height: int, width: int, n_labels: int) -> FloatArray:
    """Return half the width of each label (L,), pixels: how far its inmost pixel is from the next label, right or
    diagonally."""
    far = np.int32(height + width)
    distance = np.empty(len(label), np.int32)
    for y in range(height):
        for x in range(width):
            p = y * width + x
            own = label[p]
            at_edge = (
                (x > 0 and label[p - 1] != own)
                or (x + 1 < width and label[p + 1] != own)
                or (y > 0 and label[p - width] != own)
                or (y + 1 < height and label[p + width] != own)
            )
            near = far
            if at_edge:
                near = np.int32(0)
            else:
                if x > 0:
                    near = min(near, distance[p - 1] + 1)
                if y > 0:
                    near = min(near, distance[p - width] + 1)
                    if x > 0:
                        near = min(near, distance[p - width - 1] + 1)
                    if x + 1 < width:
                        near = min(near, distance[p - width + 1] + 1)
            distance[p] = near
    widest = np.zeros(n_labels)
    for y in range(height - 1, -1, -1):
        for x in range(width - 1, -1, -1):
            p = y * width + x
            near = distance[p]
            if x + 1 < width:
                near = min(near, distance[p + 1] + 1)
            if y + 1 < height:
                near = min(near, distance[p + width] + 1)
                if x > 0:
                    near = min(near, distance[p + width - 1] + 1)
                if x + 1 < width:
                    near = min(near, distance[p + width + 1] + 1)
            distance[p] = near
            widest[label[p]] = max(widest[label[p]], near + 1.0)
    return widest
