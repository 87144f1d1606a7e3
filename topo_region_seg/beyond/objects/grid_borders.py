# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How convex the borders between regions are, judged between pixels of the image grid, so also across gaps."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.beyond.objects.convexity import FREE, TOLERANCE, Borders, longer, place_of
from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import BoolArray, IntArray
from topo_region_seg.steps.view.grid import ImageGrid, Single
from topo_region_seg.steps.view.label_image import Labels
from topo_region_seg.steps.view.lengths import Lengths, scale_at

PARTS = (0.15, 0.3, 0.5, 0.8)
"""Shares of the reach at which pixels are looked at."""
TILE = 8
"""Side, pixels, of the squares of the image in which pixels are left out where no other label is in reach."""
MIXED = -1


@kernel
def grid_borders(
    grid: ImageGrid, normals: Single, label: Labels, wanted: BoolArray, lengths: Lengths, reach: float, pixel: float
) -> Borders:
    """Judge pairs of pixels of different labels, up to `reach` (m, times the scale at their depth) apart.

    A pair is convex as in `find_borders`. `label` (P,) is 0 for pixels that judge nothing; one of two labels must be
    `wanted` (L,). `pixel` is the angle between pixels, radians.
    """
    slot, key, figures, count = np.full(1024, FREE), np.empty(256, np.int64), np.empty((256, 3)), 0
    width, height = grid.width, grid.height
    last, border = np.int64(FREE), 0
    tiles = tiles_to_judge(grid, label, lengths, reach, pixel)
    across = (width + TILE - 1) // TILE
    for tile in tiles:
        y1, x1 = tile // across * TILE, tile % across * TILE
        for place in range(TILE * TILE):
            y0, x0 = y1 + place // TILE, x1 + place % TILE
            if y0 >= height or x0 >= width:
                continue
            p = y0 * width + x0
            own = np.int64(label[p])
            if own == 0:
                continue
            z = np.float64(grid.depth[p])
            own_reach = scale_at(lengths, z) * reach
            for part in PARTS:
                px = part * own_reach / (pixel * z)
                straight, slanted = max(1, round(px)), max(1, round(0.71 * px))
                for direction in range(4):
                    right, left = straight if direction == 0 else slanted, -slanted
                    dx = left if direction == 3 else (0 if direction == 1 else right)
                    dy = 0 if direction == 0 else (straight if direction == 1 else slanted)
                    x, y = x0 + dx, y0 + dy
                    if x < 0 or x >= width or y >= height:
                        continue
                    q = y * width + x
                    theirs = np.int64(label[q])
                    if theirs == 0 or theirs == own or not (wanted[own] or wanted[theirs]):
                        continue
                    d2, opening = 0.0, 0.0
                    for c in range(3):
                        e = np.float64(grid.xyz[p, c]) - np.float64(grid.xyz[q, c])
                        d2 += e * e
                        opening += (np.float64(normals[p, c]) - np.float64(normals[q, c])) * e
                    distance = math.sqrt(d2)
                    if not distance <= own_reach:
                        continue
                    both = (min(own, theirs) << 32) | max(own, theirs)
                    if both != last:
                        last = both
                        if count + 1 > len(key):
                            key, figures = longer(key, figures)
                            slot = np.full(4 * len(key), FREE)
                            for known in range(count):
                                slot[place_of(slot, key, key[known])] = known
                        free = place_of(slot, key, both)
                        if slot[free] == FREE:
                            slot[free] = count
                            key[count] = both
                            figures[count, 0], figures[count, 1], figures[count, 2] = 0.0, 0.0, np.inf
                            count += 1
                        border = slot[free]
                    figures[border, 0] += 1.0
                    figures[border, 1] += 1.0 if opening > -TOLERANCE * distance else 0.0
                    figures[border, 2] = min(figures[border, 2], distance)
    order = np.argsort(key[:count])
    found, figures = key[order], figures[order]
    return Borders(found >> 32, found & 0xFFFFFFFF, figures[:, 0].copy(), figures[:, 1].copy(), figures[:, 2].copy())


@kernel
def tiles_to_judge(grid: ImageGrid, label: Labels, lengths: Lengths, reach: float, pixel: float) -> IntArray:
    """Return the tiles of the image, row by row, within whose reach more than one label is."""
    width, height = grid.width, grid.height
    down, across = (height + TILE - 1) // TILE, (width + TILE - 1) // TILE
    only, nearest = np.zeros((down, across), np.int32), np.full((down, across), np.float32(np.inf), np.float32)
    for y in range(height):
        for x in range(width):
            own = label[y * width + x]
            if own == 0:
                continue
            if only[y // TILE, x // TILE] != own:
                only[y // TILE, x // TILE] = own if only[y // TILE, x // TILE] == 0 else MIXED
            nearest[y // TILE, x // TILE] = min(nearest[y // TILE, x // TILE], grid.depth[y * width + x])
    found, count = np.empty(down * across, np.int64), 0
    for ty in range(down):
        for tx in range(across):
            own, z = only[ty, tx], np.float64(nearest[ty, tx])
            if own == 0:
                continue
            alone = own != MIXED and z > 0.0
            if alone:
                # Nowhere in the tile is the reach more pixels than at its nearest point.
                px = np.int64(min(PARTS[-1] * scale_at(lengths, z) * reach / (pixel * z), width + height)) + 1
                for y in range(ty, min((ty * TILE + TILE - 1 + px) // TILE + 1, down)):
                    for x in range(
                        max(tx * TILE - px, 0) // TILE, min((tx * TILE + TILE - 1 + px) // TILE + 1, across)
                    ):
                        alone = alone and (only[y, x] == own or only[y, x] == 0)
            if not alone:
                found[count] = ty * across + tx
                count += 1
    tiles: IntArray = found[:count].copy()
    return tiles
