# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Points at their pixels, also those of lists that came from an image."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from topo_region_seg.data import Cloud, FloatArray, IntArray
from topo_region_seg.steps.view.listed import listed_image


class PlacedPoints(NamedTuple):
    """Points and their pixels.

    Parameters
    ----------
    rows, pixel : (N,) int64
        The input rows of the points, and their pixels, which rise.
    xyz : (N, 3) float64
        Their positions, metres, the sensor at the origin.
    height, width : int
        Size of the image, pixels.
    axes : (3, 3) float64 or None
        Rows: right and down in the image, and the middle of the view, where they had to be found.
    """

    rows: IntArray
    pixel: IntArray
    xyz: FloatArray
    height: int
    width: int
    axes: FloatArray | None = None


def placed_points(cloud: Cloud, rows: IntArray, xyz: FloatArray, possible: Iterable[FloatArray]) -> PlacedPoints | None:
    """Return points at the pixels of the image that they are, or came from; None if there is none.

    Parameters
    ----------
    cloud : Cloud
        Organized, or a list of points.
    rows, xyz : (N,) int64, (N, 3) float64
        Its rows that are not cropped, and their positions, metres, the sensor at the origin. Of points in one pixel of
        a list the nearest is returned.
    possible : iterable of (3, 3) float64
        Axes that the camera of a list may have, to be tried in turn. Rows: the image's right and down, and the middle
        of the view.
    """
    if cloud.organized:
        return PlacedPoints(rows, rows, xyz, cloud.height, cloud.width)
    for axes in possible:
        found = listed_image(xyz, axes)
        if found is not None:
            chosen = np.ascontiguousarray(xyz[found.point])
            return PlacedPoints(rows[found.point], found.pixel, chosen, found.height, found.width, axes)
    return None
