# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Fewer points where lengths follow the sensor: the mean of a block of pixels in place of what noise hides anyway.

Blocks are about as wide as voxels are, or as the noise; wider where more points are left than are worth their time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from topo_region_seg.beyond.auto_scale.local_units import LocalUnits
from topo_region_seg.compiled.voxels import number_voxels
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.growth import REFERENCE_SPACING, Growth
from topo_region_seg.params import Params
from topo_region_seg.steps.thinning import voxels_of
from topo_region_seg.steps.view.pixel_blocks import Blocks, pixel_angle, pixel_blocks

WIDTH = 1.5
"""Voxels in the width of a block."""
WIDEST_FOR_NOISE = 2
"""Pixels along the side of a block that noise asks for, at most."""
MOST = 40_000
"""Blocks of a full image, at most."""
CROWD = 60_000
"""Points of a list, of no image, from which on there are fewer."""


def spacings_apart(units: LocalUnits, count: int, listed: bool, params: Params) -> int:
    """Return how many spacings apart the points of a cloud are to be; 1 if the `count` points that are left may stay.

    `voxel_size` = 0 keeps all; of lists of points only crowds are thinned.
    """
    if params.voxel_size == 0.0 or count == 0:
        return 1
    spacing = REFERENCE_SPACING * units.growth_of_spacing
    fewer = math.ceil(math.sqrt(count / MOST))
    if listed:
        return 1 if count * min(1.0, (spacing / params.voxel_size) ** 2) <= CROWD else fewer
    noise = min(round(units.noise * units.middle**2 / spacing), WIDEST_FOR_NOISE)
    return max(round(WIDTH * params.voxel_size / spacing), noise, fewer, 1)


def coarser(
    xyz: FloatArray,
    rgb: npt.NDArray[np.uint8] | None,
    rows: IntArray,
    size: Sequence[int],
    apart: int,
    units: LocalUnits,
    *,
    listed: bool,
) -> Blocks:
    """Replace points by means of those around, `apart` spacings wide.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions seen from the sensor at the origin, metres.
    rgb : (N, 3) uint8 or None
        Colors.
    rows : (N,) int64
        Their pixels, in rising order.
    size : two of int
        Height and width of the image, pixels; of a list of points the height is 1.
        Only what a camera saw goes by pixels.
    apart : int
        Spacings.
    units : LocalUnits
        How lengths grow with the distance.
    listed : bool
        Whether they are a list of points, at no pixels of a camera.
    """
    if not listed:
        return pixel_blocks(xyz, rgb, rows, size, apart, units.block_angle(pixel_angle(xyz, rows), apart))
    voxel, first = number_voxels(units.at(xyz), apart * units.spacing)
    return Blocks(voxels_of(xyz, rgb, voxel, first), np.empty((0, 0), np.int32), None)


def wider_angles(growth: Growth, units: LocalUnits, apart: int, params: Params) -> Growth:
    """Return how regions grow on such points: on round things normals turn by more from one to the next."""
    low, high = growth.angle
    wider = max(1.0, apart * units.spacing / max(params.voxel_size, units.spacing))
    return replace(growth, angle=(low, min(wider * high, 180.0)))
