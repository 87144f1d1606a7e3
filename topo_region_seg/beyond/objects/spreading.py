# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels spread ring by ring to pixels without one, along the surface that they continue."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import BoolArray
from topo_region_seg.steps.view.grid import ImageGrid, Single
from topo_region_seg.steps.view.label_image import Labels
from topo_region_seg.steps.view.table import DepthTable, at_depth


@kernel
def spread_labels(
    grid: ImageGrid, normals: Single, label: Labels, todo: BoolArray, noise: DepthTable, pixel: float, rounds: int
) -> Labels:
    """Return labels (P,) in which pixels `todo` without one have that of a neighbor, `rounds` rings far.

    Of up to eight neighbors with a label, no depth step away, it is the one whose plane the pixel continues best.
    """
    width, height = grid.width, grid.height
    label = label.copy()
    waiting = np.empty(len(label), np.int64)
    count = 0
    for p in range(len(label)):
        if todo[p] and label[p] == 0:
            waiting[count] = p
            count += 1
    chosen = np.empty(count, np.int32)
    for _ in range(rounds):
        moved = False
        for i in range(count):
            p = waiting[i]
            x0, y0 = p % width, p // width
            best, chosen[i] = np.inf, 0
            for dy in range(-1, 2):
                for dx in range(-1, 2):
                    x, y = x0 + dx, y0 + dy
                    if (dx == 0 and dy == 0) or x < 0 or y < 0 or x >= width or y >= height:
                        continue
                    q = y * width + x
                    if label[q] == 0:
                        continue
                    z = np.float64(grid.depth[p])
                    step = abs(z - np.float64(grid.depth[q]))
                    if not step < max(0.01, 5.0 * at_depth(noise, z)) + 3.0 * pixel * z:
                        continue
                    off, apart = 0.0, 0.0
                    for c in range(3):
                        e = np.float64(grid.xyz[p, c]) - np.float64(grid.xyz[q, c])
                        off += e * np.float64(normals[q, c])
                        apart += e * e
                    apart = math.sqrt(apart)
                    cost = apart + 3.0 * abs(off) if abs(off) < np.inf else 2.0 * apart
                    if cost < best:
                        best, chosen[i] = cost, label[q]
        left = 0
        for i in range(count):
            if chosen[i] > 0:
                label[waiting[i]] = chosen[i]
                moved = True
            else:
                waiting[left] = waiting[i]
                left += 1
        count = left
        if not moved or count == 0:
            break
    return label
