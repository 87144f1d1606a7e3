# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Points in the records of a sensor_msgs/PointCloud2, in one pass over its bytes."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.data import LabelArray


@kernel
def read_records(
    data: npt.NDArray[np.uint8],
    height: int,
    width: int,
    row_step: int,
    point_step: int,
    coordinates: tuple[int, int, int],
    color: tuple[int, int, int],
    xyz: npt.NDArray[np.float32],
    rgb: npt.NDArray[np.uint8],
) -> None:
    """Copy little-endian float32 coordinates to `xyz` (N, 3), and bytes of color to `rgb` (N, 3), or (0, 3) if none.

    `coordinates` and `color` are offsets in a record, `row_step` and `point_step` strides, all in bytes and within
    `data` (M,). Nothing need be aligned.
    """
    colored = len(rgb) > 0
    point = 0
    for row in range(height):
        for column in range(width):
            record = row * row_step + column * point_step
            i = index(point)
            xyz[i, 0] = float32_at(data, record + coordinates[0])
            xyz[i, 1] = float32_at(data, record + coordinates[1])
            xyz[i, 2] = float32_at(data, record + coordinates[2])
            if colored:
                rgb[i, 0] = data[index(record + color[0])]
                rgb[i, 1] = data[index(record + color[1])]
                rgb[i, 2] = data[index(record + color[2])]
            point += 1


@inlined
def float32_at(data, place):  # type: ignore[no-untyped-def]
    """Return the float32 whose four bytes, the lowest first, begin at a place in `data`; compiled to a single load."""
    p = index(place)
    word = np.uint32(data[p]) | (np.uint32(data[p + index(1)]) << np.uint32(8))
    word |= np.uint32(data[p + index(2)]) << np.uint32(16)
    word |= np.uint32(data[p + index(3)]) << np.uint32(24)
    return np.uint32(word).view(np.float32)


@kernel
def write_labeled_records(
    xyz: npt.NDArray[np.float32],
    rgb: npt.NDArray[np.uint8],
    labels: LabelArray,
    records: npt.NDArray[np.float32],
    words: npt.NDArray[np.uint32],
) -> bool:
    """Fill records (N, 5) of x, y, z, packed color and label; `words` is another view of `records`.

    `rgb` is (N, 3), or (0, 3) where there is no color. Returns whether all coordinates are finite.
    """
    colored = len(rgb) > 0
    finite = True
    for i in range(len(xyz)):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        records[i, 0], records[i, 1], records[i, 2] = x, y, z
        packed = np.uint32(0)
        if colored:
            red, green, blue = np.uint32(rgb[i, 0]), np.uint32(rgb[i, 1]), np.uint32(rgb[i, 2])
            packed = (red << np.uint32(16)) | (green << np.uint32(8)) | blue
        words[i, 3] = packed
        words[i, 4] = labels[i]
        finite &= math.isfinite(x) & math.isfinite(y) & math.isfinite(z)
    return finite
