# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels of pixels: which are kept, and which are wide."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.data import BoolArray, IntArray

Labels = npt.NDArray[np.int32]
"""Labels of pixels, (P,); 0 where there is none."""


def kept_labels(label: Labels, keep: BoolArray) -> Labels:
    """Return labels (P,) counted from 1 again, 0 where `keep` (L,) is not; label 0 stays 0."""
    number = np.where(keep, np.cumsum(keep) - int(keep[0]), 0).astype(np.int32)
    number[0] = 0
    return renumbered(label, number)


def united_labels(label: Labels, group: IntArray) -> Labels:
    """Return labels (P,), counted from 1 again, of which those are one that have the same group (L,), one of them."""
    used = np.zeros(len(group), np.bool_)
    used[group[1:]] = True
    used[0] = False
    number = np.where(used, np.cumsum(used), 0).astype(np.int32)
    return renumbered(label, number[group])


@kernel
def renumbered(label: Labels, number: Labels) -> Labels:
    """Return the `number` (L,) of each of the labels (P,)."""
    found = np.empty_like(label)
    for p in range(len(label)):
        found[p] = number[index(label[p])]
    return found


@kernel
def sizes_of(label: Labels, n_labels: int) -> IntArray:
    """Return how many pixels each label (L,) has."""
    size = np.zeros(n_labels, np.int64)
    for p in range(len(label)):
        size[index(label[p])] += 1
    return size


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
def wide_labels(label: Labels, height: int, width: int, n_labels: int, least: float) -> BoolArray:
    """Return which labels (L,) are at least twice `least`, which is above 1, wide, pixels.

    Half the width of a label is 1 and the largest chessboard distance of one of its pixels from one at a border: a
    pixel that has another label beside it, above or below. The image's edge is no border.
    """
    wide = np.zeros(n_labels, np.bool_)
    # So far around a pixel no other may lie at a border: as many are counted in a row, and rows that have as many.
    around = max(math.ceil(least - 2.0), 0)
    enough = 2 * around + 1
    border, clear = np.zeros(width, np.bool_), np.zeros(width, np.bool_)
    rows = np.full(width, enough, np.int32)
    for y in range(height + around):
        if y < height:
            mark_borders(label, y, height, width, border)
            run = enough
            for x in range(width + around):
                run = 0 if x < width and border[index(x)] else run + 1
                if x >= around:
                    clear[index(x - around)] = run >= enough
        else:
            clear[:] = True
        first = (y - around) * width
        for x in range(width):
            rows[index(x)] = rows[index(x)] + 1 if clear[index(x)] else 0
            if first >= 0 and rows[index(x)] >= enough:
                wide[index(label[index(first + x)])] = True
    return wide


@inlined
def mark_borders(label, y, height, width, border):  # type: ignore[no-untyped-def]
    """Mark the pixels of a row that have another label beside them, above or below."""
    first = y * width
    up, down = first - width if y > 0 else first, first + width if y + 1 < height else first
    for x in range(width):
        own = label[index(first + x)]
        border[index(x)] = (label[index(up + x)] != own) | (label[index(down + x)] != own)
    for x in range(1, width):
        if label[index(first + x)] != label[index(first + x - 1)]:
            border[index(x - 1)] = border[index(x)] = True
