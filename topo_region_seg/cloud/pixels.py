# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""From the pixels of images to points and colors, in one pass; each call takes some rows, so that threads share them.

The arithmetic is that of `depth_image_proc`, in its order and in single precision, so that points are the same to the
last bit.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import index, inlined, kernel


@kernel
def points_on_columns(
    depth: npt.NDArray[Any],
    first: int,
    end: int,
    stride: int,
    columns: npt.NDArray[np.float32],
    rows: npt.NDArray[np.float32],
    constants: tuple[np.float32, np.float32, np.float32],
    xyz: npt.NDArray[np.float32],
) -> None:
    """Fill `xyz` (N, 3) with the points of a pinhole camera, for the rows from `first` to `end`.

    `depth` holds a row of pixels every `stride` values; `columns` (W,) and `rows` (H,) are distances from the principal
    point, pixels; `constants` are metres a unit of depth over either focal length, and metres a unit. Depth that is not
    positive and finite gives NaN.
    """
    width = len(columns)
    for row in range(first, end):
        y = rows[row]
        for column in range(width):
            value = np.float32(depth[index(row * stride + column)])
            i = index(row * width + column)
            known = is_depth(value)
            xyz[i, 0] = columns[column] * value * constants[0] if known else np.float32(np.nan)
            xyz[i, 1] = y * value * constants[1] if known else np.float32(np.nan)
            xyz[i, 2] = value * constants[2] if known else np.float32(np.nan)


@kernel
def points_on_rays(
    depth: npt.NDArray[Any],
    first: int,
    end: int,
    stride: int,
    width: int,
    rays: npt.NDArray[np.float32],
    metres: np.float32,
    xyz: npt.NDArray[np.float32],
) -> None:
    """Fill `xyz` (N, 3) as :func:`points_on_columns` does, with a ray (x, y) at z = 1 of each pixel, `rays` (N, 2)."""
    for row in range(first, end):
        for column in range(width):
            value = np.float32(depth[index(row * stride + column)])
            i = index(row * width + column)
            known = is_depth(value) & (rays[i, 0] == rays[i, 0])
            z = value * metres if known else np.float32(np.nan)
            xyz[i, 0] = rays[i, 0] * z
            xyz[i, 1] = rays[i, 1] * z
            xyz[i, 2] = z


@inlined
def is_depth(value):  # type: ignore[no-untyped-def]
    """Whether a depth is positive and finite."""
    return (value > np.float32(0.0)) & (value < np.float32(np.inf))


@kernel
def read_colors(
    data: npt.NDArray[np.uint8],
    first: int,
    end: int,
    width: int,
    step: int,
    pixel: int,
    places: tuple[int, int, int],
    rgb: npt.NDArray[np.uint8],
) -> None:
    """Copy red, green and blue of pixels to `rgb` (N, 3), for the rows from `first` to `end`.

    Rows are `step` bytes apart, pixels `pixel` bytes; `places` are those of the three bytes in a pixel.
    """
    for row in range(first, end):
        for column in range(width):
            start = row * step + column * pixel
            i = index(row * width + column)
            rgb[i, 0] = data[index(start + places[0])]
            rgb[i, 1] = data[index(start + places[1])]
            rgb[i, 2] = data[index(start + places[2])]
