# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What lies beyond the outline of each segment, seen along rows and columns of the image, across gaps without depth."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.steps.view.grid import Single
from topo_region_seg.steps.view.label_image import Labels
from topo_region_seg.steps.view.table import DepthTable, at_depth

NONE = -1
OCCLUDED, TOUCHING, OWN = 0, 1, 2
"""What an outline pixel may do to what lies beyond it: it is hidden by it, touches it, or hides it."""
AT_EDGE = 4
"""Pixels from the image's edge up to which an outline is cut by it: cameras have no depth along their edges."""
STEP, STEPS = 0.008, 4.0
"""Least depth step, metres and times the noise, that parts what is before from what is behind."""
SLOPE = 3.0
"""Slope of a surface, depth over width, up to which a step across a gap may be one surface."""


class Relations(NamedTuple):
    """What lies beyond the outlines of labels.

    `pixels` (B, 3) is how many outline pixels of label `first` (B,) are hidden by label `second` (B,), touch it, or
    hide it; the pairs are in order. `frame` and `void` (L,) are how many pixels of each label the image's edge cuts,
    and beyond how many there is no depth up to that edge.
    """

    first: IntArray
    second: IntArray
    pixels: FloatArray
    frame: FloatArray
    void: FloatArray

    def totals(self, n_labels: int) -> FloatArray:
        """Return the outline pixels of the labels, (`n_labels`,), at least 1."""
        among = np.bincount(self.first, self.pixels.sum(axis=1), len(self.frame))
        totals: FloatArray = np.maximum(among + self.frame + self.void, 1.0)[:n_labels]
        return totals


def relations(
    label: Labels, depth: Single, height: int, width: int, n_labels: int, noise: DepthTable, pixel: float
) -> Relations:
    """Return what lies beyond the outlines of labels, along the rows and columns of the image.

    Parameters
    ----------
    label : (P,) int32
        Labels of the pixels, below `n_labels`; 0 is looked across.
    depth : (P,) float32
        Their depths, metres.
    height, width : int
        Size of the image.
    n_labels : int
        Number of labels, 0 included.
    noise : DepthTable
        Standard deviation of the depth, metres.
    pixel : float
        Angle between pixels, radians.
    """
    key, frame, void = transitions(label, depth, height, width, n_labels, noise, pixel)
    if 3 * n_labels**2 <= len(label):
        counts = np.bincount(key)
        key = np.flatnonzero(counts)
        number = counts[key]
    else:
        key, number = np.unique(key, return_counts=True)
    pairs, place = np.unique(key // 3, return_inverse=True)
    count = np.zeros((len(pairs), 3))
    count[place, key % 3] = number
    return Relations(pairs // n_labels, pairs % n_labels, count, frame, void)


@kernel
def transitions(
    label: Labels, depth: Single, height: int, width: int, n_labels: int, noise: DepthTable, pixel: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return a number for each pair of pixels at which one label follows another, both ways, and `frame` and `void`.

    The number is that of the two labels and of what the first does to the second, ``(first * L + second) * 3 + kind``.
    """
    key, count = np.empty(4096, np.int64), 0
    frame, void = np.zeros(n_labels), np.zeros(n_labels)
    # The last labelled pixel of the row so far, and of each column, so that the image is read once, in order.
    above, above_label = np.full(width, NONE), np.zeros(width, np.int64)
    for y in range(height):
        left, left_label = NONE, 0
        for x in range(width):
            q = y * width + x
            b = np.int64(label[q])
            if b == 0:
                continue
            if b == left_label and b == above_label[x]:
                left = above[x] = q
                continue
            for down in range(2):
                p, place, stride = (above[x], y, width) if down else (left, x, 1)
                if p == NONE:
                    if place <= AT_EDGE:
                        frame[b] += 1.0
                    else:
                        void[b] += 1.0
                    continue
                a = np.int64(label[p])
                if a == b:
                    continue
                z = np.float64(depth[p])
                further = np.float64(depth[q]) - z
                far = max(STEP, STEPS * at_depth(noise, z)) + SLOPE * ((q - p) // stride) * pixel * z
                kind = OWN if further > far else (OCCLUDED if further < -far else TOUCHING)
                if count + 2 > len(key):
                    longer = np.empty(2 * len(key), np.int64)
                    longer[:count] = key[:count]
                    key = longer
                key[count] = (a * n_labels + b) * 3 + kind
                key[count + 1] = (b * n_labels + a) * 3 + 2 - kind
                count += 2
            left, left_label, above[x], above_label[x] = q, b, q, b
        if left != NONE:
            if (y + 1) * width - 1 - left <= AT_EDGE:
                frame[label[left]] += 1.0
            else:
                void[label[left]] += 1.0
    for x in range(width):
        if above[x] != NONE:
            if height - 1 - above[x] // width <= AT_EDGE:
                frame[label[above[x]]] += 1.0
            else:
                void[label[above[x]]] += 1.0
    return key[:count].copy(), frame, void
