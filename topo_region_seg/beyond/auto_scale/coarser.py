# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Fewer points where lengths follow the sensor: the mean of a block of pixels in place of what noise hides anyway.

Blocks are about as wide as voxels are, or as the noise; wider where more points are left than are worth their time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.beyond.auto_scale.local_units import LocalUnits
from topo_region_seg.data import BoolArray, FloatArray, IntArray
from topo_region_seg.growth import REFERENCE_SPACING, Growth
from topo_region_seg.params import Params
from topo_region_seg.steps.thinning.pixel_blocks import pixel_angle, pixel_blocks
from topo_region_seg.steps.thinning.voxels import Thinned, thin_to, voxels_of

WIDTH = 1.5
"""Voxels in the width of a block."""
WIDEST_FOR_NOISE = 2
"""Pixels along the side of a block that noise asks for, at most."""
MOST = 40_000
"""Blocks of a full image, at most."""
CROWD = 60_000
"""Points of a list, of no image, from which on at most MOST are left."""


class FewerPoints(NamedTuple):
    """Means in place of points.

    Parameters
    ----------
    points : Thinned
        The means.
    kept : (N,) bool or None
        Which of the given points they stand for, those that `points` tells the mean of; None if all.
    apart : float
        About how many spacings they are apart.
    """

    points: Thinned
    kept: BoolArray | None
    apart: float


def fewer_points(
    xyz: FloatArray,
    rgb: npt.NDArray[np.uint8] | None,
    rows: IntArray,
    size: Sequence[int],
    units: LocalUnits,
    params: Params,
) -> FewerPoints | None:
    """Replace points by means over blocks of pixels; None if all may stay.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions seen from the sensor at the origin, metres.
    rgb : (N, 3) uint8 or None
        Colors.
    rows : (N,) int64
        Their pixels, in rising order.
    size : two of int
        Height and width of the image, pixels. A list of points has a height of 1: only where it is a crowd is it
        thinned, by voxels that grow as lengths do.
    units : LocalUnits
        How lengths grow with the distance.
    params : Params
        Uses `voxel_size`; 0 keeps all points.
    """
    if params.voxel_size == 0.0 or len(xyz) == 0:
        return None
    if size[0] == 1 or math.isinf(units.depth):
        spacing = REFERENCE_SPACING * units.growth_of_spacing
        if len(xyz) * min(1.0, (spacing / params.voxel_size) ** 2) <= CROWD:
            return None
        even = thin_to(units.at(xyz), None, MOST, units.spacing)
        return FewerPoints(voxels_of(xyz, rgb, even.voxel, even.first), None, even.edge / units.spacing)
    side = pixels_wide(units, len(xyz), params)
    if side == 1:
        return None
    blocks = pixel_blocks(xyz, rgb, rows, size, side, pixel_angle(xyz, rows), units.clear)
    return FewerPoints(blocks.points, blocks.kept, side)


def pixels_wide(units: LocalUnits, count: int, params: Params) -> int:
    """Return how wide the blocks of an image are to be of which `count` points are left, pixels."""
    spacing = REFERENCE_SPACING * units.growth_of_spacing
    noise = min(round(units.noise * units.middle**2 / spacing), WIDEST_FOR_NOISE)
    return max(round(WIDTH * params.voxel_size / spacing), noise, math.ceil(math.sqrt(count / MOST)), 1)


def wider_angles(growth: Growth, units: LocalUnits, apart: float, params: Params) -> Growth:
    """Return how regions grow on such points: on round things normals turn by more from one to the next."""
    low, high = growth.angle
    wider = max(1.0, apart * units.spacing / max(params.voxel_size, units.spacing))
    return replace(growth, angle=(low, min(wider * high, 180.0)))
