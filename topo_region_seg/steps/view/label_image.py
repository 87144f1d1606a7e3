# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels of pixels: which are kept, and how wide each label is."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import BoolArray, FloatArray, IntArray

Labels = npt.NDArray[np.int32]
"""Labels of pixels, (P,); 0 where there is none."""


def kept_labels(label: Labels, keep: BoolArray) -> Labels:
    """Return labels (P,) counted from 1 again, 0 where `keep` (L,) is not; label 0 stays 0."""
    number = np.where(keep, np.cumsum(keep) - int(keep[0]), 0).astype(np.int32)
    number[0] = 0
    return number[label]


def united_labels(label: Labels, group: IntArray) -> Labels:
    """Return labels (P,), counted from 1 again, of which those are one that have the same group (L,), one of them."""
    used = np.zeros(len(group), np.bool_)
    used[group[1:]] = True
    used[0] = False
    number = np.where(used, np.cumsum(used), 0).astype(np.int32)
    return number[group][label]


@kernel
def bridged(label: Labels, classes: npt.NDArray[np.uint8], height: int, width: int, most: int) -> Labels:
    """Return labels (P,) that go on across up to `most` pixels of class 0 in a row, with one label on both sides."""
    whole: Labels = label.copy()
    for y in range(height):
        last = y * width
        for p in range(y * width, (y + 1) * width):
            if classes[p] == 0:
                continue
            if 1 < p - last <= most + 1 and label[last] == label[p] and classes[last] != 0:
                whole[last + 1 : p] = label[p]
            last = p
    return whole


@kernel
def half_widths(label: Labels, height: int, width: int, n_labels: int) -> FloatArray:
    """Return half the width of each label (L,), pixels: the largest distance of one of its pixels from another label.

    It is the chessboard distance, in two passes over the image.
    """
    distance = np.empty(len(label), np.int32)
    for y in range(height):
        for x in range(width):
            p = y * width + x
            own = label[p]
            near = np.int32(height + width)
            if (
                (x > 0 and label[p - 1] != own)
                or (x + 1 < width and label[p + 1] != own)
                or (y > 0 and label[p - width] != own)
                or (y + 1 < height and label[p + width] != own)
            ):
                near = np.int32(0)
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
