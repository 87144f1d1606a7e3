# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The image grid of an organized cloud, pixel after pixel, row after row."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray, IntArray

Single = npt.NDArray[np.float32]


class ImageGrid(NamedTuple):
    """The pixels (P,) of a frame, P = `height` * `width`.

    Parameters
    ----------
    xyz : (P, 3) float32
        Positions seen from the sensor at the origin, metres; NaN where there is none, or where it is cropped.
    depth : (P,) float32
        Their distances from the sensor along the middle of the view, metres; NaN likewise.
    height, width : int
        Size of the image, pixels.
    """

    xyz: Single
    depth: Single
    height: int
    width: int


def image_grid(xyz: FloatArray, rows: IntArray, height: int, width: int, middle: FloatArray) -> ImageGrid:
    """Return the image grid of positions (N, 3) at pixels `rows` (N,); `middle` (3,) is where the camera looks."""
    placed, depth = pixels(xyz, rows, height * width, middle)
    return ImageGrid(placed, depth, height, width)


def normals_of_pixels(normals: FloatArray, rows: IntArray, count: int) -> Single:
    """Return normals (P, 3) of all `count` pixels from those (N, 3) of pixels `rows` (N,); NaN for the others."""
    placed = np.full((count, 3), np.nan, np.float32)
    placed[rows] = normals
    return placed


@kernel
def pixels(xyz: FloatArray, rows: IntArray, count: int, middle: FloatArray) -> tuple[Single, Single]:
    """Return positions (P, 3) and depths (P,) of all `count` pixels."""
    placed = np.full((count, 3), np.float32(np.nan), np.float32)
    depth = np.full(count, np.float32(np.nan), np.float32)
    u, v, w = middle[0], middle[1], middle[2]
    for i in range(len(rows)):
        row = rows[i]
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        placed[row, 0], placed[row, 1], placed[row, 2] = x, y, z
        depth[row] = u * x + v * y + w * z
    return placed, depth
