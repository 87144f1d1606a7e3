# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Grooves on the image grid."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.compiled.dialect import index, kernel
from topo_region_seg.data import BoolArray, IntArray
from topo_region_seg.steps.view.grid import ImageGrid, Single
from topo_region_seg.steps.view.lengths import Lengths, scale_at


@kernel
def grooves_of_grid(
    grid: ImageGrid,
    normals: Single,
    pixels: IntArray,
    lengths: Lengths,
    reach: float,
    pixel: float,
    angle: float,
    first: int,
    end: int,
    found: BoolArray,
) -> None:
    """Mark in `found` (N,) which of ``pixels[first:end]`` lie in a groove."""
    for i in range(first, end):
        p = pixels[i]
        x0, y0 = p % grid.width, p // grid.width
        z = np.float64(grid.depth[p])
        own = scale_at(lengths, z) * reach
        px = 0.9 * own / (pixel * z)
        straight, slanted = max(1, round(px)), max(1, round(0.71 * px))
        turn, count = 0.0, 0
        for dy in range(-1, 2):
            for dx in range(-1, 2):
                if dx == 0 and dy == 0:
                    continue
                k = straight if dx == 0 or dy == 0 else slanted
                x, y = x0 + k * dx, y0 + k * dy
                if x < 0 or y < 0 or x >= grid.width or y >= grid.height:
                    continue
                q = index(y * grid.width + x)
                d, n = 0.0, 0.0
                for c in range(3):
                    e = np.float64(grid.xyz[q, c]) - np.float64(grid.xyz[p, c])
                    d += e * e
                    n += (np.float64(normals[q, c]) - np.float64(normals[p, c])) * e
                d = math.sqrt(d)
                if not d < 1.3 * own or not abs(n) < np.inf:
                    continue
                turn += math.asin(min(max(n / d, -1.0), 1.0)) * own / max(d, own / 2.0)
                count += 1
        found[i] = count >= 2 and turn < -angle * count
