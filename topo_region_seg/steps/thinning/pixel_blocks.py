# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Square blocks of pixels, which take the place of voxels where there is an image grid: their neighbors are known.

A block stands for the pixels of one surface and color: the largest group in it. The others go to the block beside it
that they are most like, so that borders are as fine as the image.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import borrowed, index, inlined, kernel
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.data import BoolArray, FloatArray, IndexArray, IntArray
from topo_region_seg.steps.thinning.voxels import Thinned

STEP = 2.0
"""Widths of a block up to which its pixels are on one surface."""
STRAY = 2.0 * STEP
"""Widths of a block beyond which a pixel belongs to none beside it."""
SHADE = 30.0
"""Difference of two colors, in units of 8-bit sRGB, that is as much as the largest step: about 10 dE."""
NONE = -1


class Blocks(NamedTuple):
    """The points of a cloud by blocks.

    Parameters
    ----------
    points : Thinned
        The mean of each block's pixels, row after row of blocks.
    at : (H, W) int32
        Point of each block; -1 where there is none.
    kept : (N,) bool or None
        Which of the given points belong to a block, those that `points` tells the block of; None if all do.
    """

    points: Thinned
    at: IndexArray
    kept: BoolArray | None


def pixel_blocks(
    xyz: FloatArray,
    rgb: npt.NDArray[np.uint8] | None,
    rows: IntArray,
    size: Sequence[int],
    side: int,
    angle: float,
    noise: float = 0.0,
) -> Blocks:
    """Replace the points of every block of pixels by their mean.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions seen from the sensor at the origin, metres.
    rgb : (N, 3) uint8 or None
        Colors.
    rows : (N,) int64
        Their pixels, in rising order.
    size : two of int
        Height and width of the image, pixels.
    side : int
        Pixels along the side of a block.
    angle : float
        Between neighboring pixels, radians.
    noise : float
        How far noise takes points of a surface from it, as a share of their depth.
    """
    angle = max(angle, noise / (STEP * side))
    height, width = -(-size[0] // side), -(-size[1] // side)
    pixel = np.full(size, NONE, np.int32)
    pixel.ravel()[rows] = np.arange(len(rows), dtype=np.int32)
    colors = np.zeros((len(xyz), 3), np.uint8) if rgb is None else rgb
    means = np.zeros((height * width, 7), np.float32)
    block = np.full(len(xyz), NONE, np.int64)
    given = xyz, colors, pixel, side, angle, means, block
    side_by_side(fill_blocks, [(*given, *part) for part in in_parts(height)])
    chosen = block
    if side > 1:
        chosen = block.copy()
        side_by_side(place_others, [(*given, chosen, *part) for part in in_parts(height)])
    at = np.full(height * width, NONE, np.int32)
    filled = np.flatnonzero(means[:, 6])
    at[filled] = np.arange(len(filled), dtype=np.int32)
    kept = None
    if side > 1 and (chosen < 0).any():
        kept = chosen >= 0
        chosen = chosen[kept]
    voxel = at[chosen].astype(np.int64)
    first = np.empty(len(filled), np.int64)
    first[voxel[::-1]] = np.arange(len(voxel) - 1, -1, -1)
    weight = np.bincount(voxel, minlength=len(filled))
    mean = means[filled]
    mean_rgb = None if rgb is None else np.rint(mean[:, 3:6]).astype(np.uint8)
    positions = mean[:, 0:3].astype(np.float64) if side > 1 else np.ascontiguousarray(xyz)
    return Blocks(Thinned(positions, mean_rgb, first, voxel, weight, 0.0), at.reshape(height, width), kept)


def pixel_angle(xyz: FloatArray, rows: IntArray) -> float:
    """Return the angle between neighboring pixels, radians, from positions (N, 3) at pixels `rows` (N,)."""
    pairs = np.flatnonzero(np.diff(rows) == 1)[::16]
    if not len(pairs):
        return 0.0
    near = xyz[pairs]
    step = np.linalg.norm(xyz[pairs + 1] - near, axis=1) / np.maximum(np.linalg.norm(near, axis=1), 1e-9)
    return float(np.quantile(step, 0.25))


@kernel
def fill_blocks(xyz, rgb, pixel, side, angle, means, block, first, end):  # type: ignore[no-untyped-def]
    """Fill `means` (B, 7) of the blocks in some rows of blocks, and `block` (N,) of the points that these are of.

    Means are of position (m) and color; the last is how many points there are. The points of a block are those near to
    and of like color as one of them, the one with most such points.
    """
    xyz, rgb, pixel, means, block = borrowed(xyz), borrowed(rgb), borrowed(pixel), borrowed(means), borrowed(block)
    height, width = pixel.shape
    across = (width + side - 1) // side
    members, joins = np.empty(side * side, np.int64), np.empty(side * side, np.int64)
    for row in range(first, end):
        for column in range(across):
            count = 0
            for v in range(row * side, min((row + 1) * side, height)):
                for u in range(column * side, min((column + 1) * side, width)):
                    if pixel[v, u] >= 0:
                        members[count] = pixel[v, u]
                        count += 1
            most, best = 0, np.int64(-1)
            for i in range(count):
                p = members[i]
                step2 = (STEP * side * angle) ** 2 * square(xyz, p)
                joins[i] = 0
                for j in range(count):
                    joins[i] += unlike(xyz, rgb, p, members[j], step2) <= 1.0
                if joins[i] > most:
                    most, best = joins[i], p
                if most == count:
                    break
            if best < 0:
                continue
            b = row * across + column
            step2 = (STEP * side * angle) ** 2 * square(xyz, best)
            x = y = z = 0.0
            red = green = blue = 0.0
            for j in range(count):
                q = members[j]
                if most == count or unlike(xyz, rgb, best, q, step2) <= 1.0:
                    block[q] = b
                    x, y, z = x + xyz[q, 0], y + xyz[q, 1], z + xyz[q, 2]
                    red, green, blue = red + rgb[q, 0], green + rgb[q, 1], blue + rgb[q, 2]
            share = 1.0 / most
            means[b, 0], means[b, 1], means[b, 2] = x * share, y * share, z * share
            means[b, 3], means[b, 4], means[b, 5] = red * share, green * share, blue * share
            means[b, 6] = most


@kernel
def place_others(xyz, rgb, pixel, side, angle, means, block, chosen, first, end):  # type: ignore[no-untyped-def]
    """Put the points that the means of their blocks are not of in the most alike one around, in `chosen` (N,)."""
    xyz, rgb, pixel, means, block = borrowed(xyz), borrowed(rgb), borrowed(pixel), borrowed(means), borrowed(block)
    chosen = borrowed(chosen)
    height, width = pixel.shape
    across, down = (width + side - 1) // side, (height + side - 1) // side
    for v in range(first * side, min(end * side, height)):
        for u in range(width):
            p = np.int64(pixel[v, u])
            if p < 0 or block[p] >= 0:
                continue
            step2 = (STEP * side * angle) ** 2 * square(xyz, p)
            least = np.inf
            row, column = v // side, u // side
            for r in range(max(row - 1, 0), min(row + 2, down)):
                for c in range(max(column - 1, 0), min(column + 2, across)):
                    b = r * across + c
                    if means[b, 6] == 0.0:
                        continue
                    dx, dy, dz = xyz[p, 0] - means[b, 0], xyz[p, 1] - means[b, 1], xyz[p, 2] - means[b, 2]
                    d2 = dx * dx + dy * dy + dz * dz
                    dr, dg, db = rgb[p, 0] - means[b, 3], rgb[p, 1] - means[b, 4], rgb[p, 2] - means[b, 5]
                    cost = d2 / step2 + (dr * dr + dg * dg + db * db) / SHADE**2
                    if d2 <= (STRAY / STEP) ** 2 * step2 and cost < least:
                        least, chosen[p] = cost, b


@inlined
def square(xyz, p):  # type: ignore[no-untyped-def]
    """Return the squared distance of a point from the sensor."""
    q = index(p)
    return xyz[q, 0] * xyz[q, 0] + xyz[q, 1] * xyz[q, 1] + xyz[q, 2] * xyz[q, 2]


@inlined
def unlike(xyz, rgb, a, b, step2):  # type: ignore[no-untyped-def]
    """Return by how much two points differ, at most 1 for points of a surface: the larger of distance and shade."""
    p, q = index(a), index(b)
    dx, dy, dz = xyz[p, 0] - xyz[q, 0], xyz[p, 1] - xyz[q, 1], xyz[p, 2] - xyz[q, 2]
    dr = np.float64(rgb[p, 0]) - rgb[q, 0]
    dg = np.float64(rgb[p, 1]) - rgb[q, 1]
    db = np.float64(rgb[p, 2]) - rgb[q, 2]
    return max((dx * dx + dy * dy + dz * dz) / step2, (dr * dr + dg * dg + db * db) / SHADE**2)
