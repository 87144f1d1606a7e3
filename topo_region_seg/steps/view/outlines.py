# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What lies beyond the outline of each segment, seen along rows and columns of the image, across gaps without depth."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.steps.view.label_image import Labels
from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.steps.view.table import DepthTable, at_depth

OCCLUDED, TOUCHING, OWN = 0, 1, 2
AT_EDGE = 4


class Relations(NamedTuple):
    first: IntArray
    second: IntArray
    count: FloatArray  # (B, 3) outline pixels of `first` that are occluded by, touch, or hide `second`
    frame: FloatArray  # (L,) outline pixels that the image's edge cuts
    void: FloatArray  # (L,) outline pixels beyond which there is no depth up to the image's edge


def relations(label, depth, height, width, n_labels, noise, pixel) -> Relations:
    key, frame, void = transitions(label, depth, height, width, n_labels, noise, pixel)
    counts = np.bincount(key, minlength=0) if len(key) and n_labels < 600 else None
    if counts is not None:
        codes = np.flatnonzero(counts)
        number = counts[codes]
    else:
        codes, number = np.unique(key, return_counts=True)
    pair, kind = codes // 3, codes % 3
    pairs, place = np.unique(pair, return_inverse=True)
    count = np.zeros((len(pairs), 3))
    count[place, kind] = number
    return Relations(pairs // n_labels, pairs % n_labels, count, frame, void)


@kernel
def transitions(
    label: Labels,
    depth: npt.NDArray[np.float32],
    height: int,
    width: int,
    n_labels: int,
    noise: DepthTable,
    pixel: float,
) -> tuple[IntArray, FloatArray, FloatArray]:
    room = 4096
    key = np.empty(room, np.int64)
    count = 0
    frame, void = np.zeros(n_labels), np.zeros(n_labels)
    for turned in range(2):
        lines, length = (height, width) if turned == 0 else (width, height)
        line_step, step = (width, 1) if turned == 0 else (1, width)
        for line in range(lines):
            last = -1
            start = line * line_step
            for x in range(length):
                q = start + x * step
                b = label[q]
                if b == 0:
                    continue
                if last < 0:
                    if x <= AT_EDGE:
                        frame[b] += 1.0
                    else:
                        void[b] += 1.0
                else:
                    p = start + last * step
                    a = label[p]
                    if a != b:
                        z = np.float64(depth[p])
                        further = np.float64(depth[q]) - z
                        far = max(0.008, 4.0 * at_depth(noise, z)) + 3.0 * (x - last) * pixel * z
                        kind = OWN if further > far else (OCCLUDED if further < -far else TOUCHING)
                        if count + 2 > room:
                            longer = np.empty(2 * room, np.int64)
                            longer[:room] = key
                            key, room = longer, 2 * room
                        key[count] = (a * n_labels + b) * 3 + kind
                        key[count + 1] = (b * n_labels + a) * 3 + 2 - kind
                        count += 2
                last = x
            if last >= 0:
                b = label[start + last * step]
                if length - 1 - last <= AT_EDGE:
                    frame[b] += 1.0
                else:
                    void[b] += 1.0
    return key[:count].copy(), frame, void
