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
    label = label.copy()
    waiting, asked, count = np.empty(len(label), np.int64), np.zeros(len(label), np.int32), 0
    for p in range(len(label)):
        if todo[p] and label[p] == 0:
            waiting[count] = p
            count += 1
    chosen, fresh = np.empty(count, np.int32), np.empty(count, np.int64)
    for ring in range(1, rounds + 1):
        n_fresh = 0
        for i in range(count):
            chosen[i] = label_beside(grid, normals, label, noise, pixel, waiting[i])
        for i in range(count):
            if chosen[i] > 0:
                label[waiting[i]] = chosen[i]
                fresh[n_fresh] = waiting[i]
                n_fresh += 1
        # Only what is beside a pixel that just got a label can get one now.
        count = neighbors_of(fresh[:n_fresh], label, todo, grid.height, grid.width, ring, asked, waiting)
        if count == 0:
            break
    return label


@kernel
def label_beside(grid, normals, label, noise, pixel, p):  # type: ignore[no-untyped-def]
    """Return the label of the neighbor of a pixel whose plane the pixel continues best; 0 if there is none."""
    width, height = grid.width, grid.height
    x0, y0 = p % width, p // width
    best, choice = np.inf, np.int32(0)
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
                best, choice = cost, label[q]
    return choice


@kernel
def neighbors_of(fresh, label, todo, height, width, ring, asked, found):  # type: ignore[no-untyped-def]
    """Write the pixels `todo` without a label that are beside `fresh` ones into `found`, each once; return how many."""
    count = 0
    for p in fresh:
        x0, y0 = p % width, p // width
        for y in range(max(y0 - 1, 0), min(y0 + 2, height)):
            for x in range(max(x0 - 1, 0), min(x0 + 2, width)):
                q = y * width + x
                if todo[q] and label[q] == 0 and asked[q] != ring:
                    asked[q] = ring
                    found[count] = q
                    count += 1
    return count
