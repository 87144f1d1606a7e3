# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The image grid of a cloud that came as a list of points.

Drivers, filters and files often leave out the pixels without depth, and with them the grid. Where nothing else was
changed, positions divided by their depth still lie at equal steps, as they do seen from nowhere but where the camera
was. So the pixels are found again, whatever the order of the points.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.dialect import index, kernel
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.steps.view.camera import NEAREST, seen_from

CELL = 64
"""Points in a part of the image, of which its step is estimated."""
PARTS = 16
"""Parts of a step in which columns are looked for."""
APART = 3
"""Empty parts in a row that tell two columns apart."""
OFF = 0.2
"""Largest distance of a point from its column, in steps."""
ODD = 0.01
"""Share of the points that may be farther from theirs, or share a pixel."""
EMPTIEST = 16
"""Pixels a point that an image may have."""
LONGEST = 32
"""How many times as long as wide an image may be: what lies along a line has no grid, and would seem to have any."""
ASIDE = 0.06
"""How far the middle of the view may be from that of the image, as a share of its size."""


class ListedImage(NamedTuple):
    """Where points are in the image that they came from.

    Parameters
    ----------
    pixel : (M,) int64
        The pixels that hold a point, row by row.
    point : (M,) int64
        The nearest point of each.
    height, width : int
        Size of the image.
    """

    pixel: IntArray
    point: IntArray
    height: int
    width: int


def listed_image(xyz: FloatArray, axes: FloatArray) -> ListedImage | None:
    """Return the image of points (N, 3), metres, seen from the origin; None where they lie on no grid of pixels.

    The rows of `axes` (3, 3) are the image's right, down, and the middle of the view. Where more pixels are empty at
    one side than cameras have their middle aside, rows or columns without depth are taken to have been there.
    """
    if len(xyz) < CELL:
        return None
    u, v, depth = pictured_all(xyz, axes)
    if float(np.min(depth)) < NEAREST:
        return None
    extent = float(np.ptp(u)), float(np.ptp(v))
    if max(extent) > LONGEST * min(extent) or not min(extent) > 0.0:
        return None
    step = _step_of(u, v)
    # Before room is made for the columns, of which points in a heap seem to have any number.
    if extent[0] * extent[1] > EMPTIEST * len(u) * step**2:
        return None
    across, down = _columns(u, step), _columns(v, step)
    if across is None or down is None:
        return None
    (columns, width), (rows, height) = across, down
    if height * width > EMPTIEST * len(xyz):
        return None
    pixel, point = nearest_of_pixels(rows * width + columns, depth, height * width)
    if len(pixel) < (1.0 - ODD) * len(xyz):
        return None
    return ListedImage(pixel, point, height, width)


def _step_of(u: FloatArray, v: FloatArray) -> float:
    """Return about how far points (N,), on no line, are apart in most of the image, in units of the depth."""
    edge = math.sqrt(float(np.ptp(u)) * float(np.ptp(v)) * CELL / len(u))
    column, row = (((values - np.min(values)) / edge).astype(np.int64) for values in (u, v))
    cell = row * (np.max(column) + 1) + column
    count = np.sort(np.bincount(cell))
    middle = np.searchsorted(np.cumsum(count), len(u) / 2)
    return edge / math.sqrt(float(count[middle]))


def _columns(values: FloatArray, step: float) -> tuple[IntArray, int] | None:
    """Return the column of each of the values (N,) at depth 1, and how many there are; None if these have no step.

    `step` is about that of the columns.
    """
    low = float(np.min(values))
    part = ((values - low) * (PARTS / step)).astype(np.int64)
    count = np.bincount(part)
    taken = np.flatnonzero(count)
    number = np.append(0, np.cumsum(np.diff(taken) > APART))
    held = np.bincount(number, count[taken])
    center = np.bincount(number, np.bincount(part, values - low)[taken]) / held
    if len(center) < 2:
        return None
    gaps = np.diff(center)
    usual = np.median(gaps)
    place = np.append(0.0, np.cumsum(np.rint(gaps / np.median(gaps[gaps <= 1.5 * usual]))))
    slope, begin = np.polyfit(place, center, 1, w=np.sqrt(held))
    if not slope > 0.0:
        return None
    exact = (values - (low + begin)) / slope
    column = np.rint(exact)
    if np.mean(np.abs(exact - column) > OFF) > ODD:
        return None
    first, last = float(np.min(column)), float(np.max(column))
    middle = -(low + begin) / slope
    before, after = middle - first, last - middle
    if abs(before - after) > 2.0 * ASIDE * (last - first):
        first, last = min(first, math.floor(middle - after)), max(last, math.ceil(middle + before))
    return (column - first).astype(np.int64), int(last - first) + 1


@kernel
def pictured_all(xyz: FloatArray, axes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return where points (N, 3) are in the image at depth 1, (N,) each way, and their depths (N,), at least 1e-6."""
    seen = seen_from(xyz, axes)
    n = len(seen)
    u, v, depth = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        z = max(seen[i, 2], 1e-6)
        u[i], v[i], depth[i] = seen[i, 0] / z, seen[i, 1] / z, z
    return u, v, depth


@kernel
def nearest_of_pixels(pixel: IntArray, depth: FloatArray, count: int) -> tuple[IntArray, IntArray]:
    """Return which of `count` pixels hold points (N,), and the nearest point of each, the first of several as near."""
    nearest = np.full(count, -1, np.int64)
    for i in range(len(pixel)):
        p = index(pixel[i])
        if nearest[p] < 0 or depth[i] < depth[index(nearest[p])]:
            nearest[p] = i
    held = np.flatnonzero(nearest >= 0)
    return held, nearest[held]
