# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Fewer points of clouds that have more than are worth their time: blocks of pixels, or voxels that grow as lengths do.

Far from the sensor, where noise is several times the spacing, the mean of four points tells as much as they do.
"""

from __future__ import annotations

import math
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

MANY = 60_000
"""Points from which on there are fewer."""
MOST = 80_000
"""Blocks that may be left at most of a full image."""


def spacings_apart(units: LocalUnits, count: int, params: Params) -> int:
    """Return how many spacings apart the points of a cloud are to be; 1 if all `count` points that are left may stay.

    `voxel_size` = 0 keeps all.
    """
    if params.voxel_size == 0.0:
        return 1
    spacing = REFERENCE_SPACING * units.growth_of_spacing
    if count * min(1.0, (spacing / params.voxel_size) ** 2) <= MANY:
        return 1
    return max(2, math.ceil(math.sqrt(count / MOST)))


def coarser(
    xyz: FloatArray,
    rgb: npt.NDArray[np.uint8] | None,
    rows: IntArray,
    size: tuple[int, int],
    apart: int,
    units: LocalUnits,
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
    size : (int, int)
        Height and width of the image, pixels; of a list of points the height is 1.
        Only what a camera saw goes by pixels.
    apart : int
        Spacings.
    units : LocalUnits
        How lengths grow with the distance.
    """
    if size[0] > 1 and not math.isinf(units.depth):
        return pixel_blocks(xyz, rgb, rows, size, apart, units.block_angle(pixel_angle(xyz, rows), apart))
    voxel, first = number_voxels(units.at(xyz), apart * units.spacing)
    return Blocks(voxels_of(xyz, rgb, voxel, first), np.empty((0, 0), np.int32), None)


def wider_angles(growth: Growth, units: LocalUnits, apart: int, params: Params) -> Growth:
    """Return how regions grow on such points: on round things normals turn by more from one to the next."""
    low, high = growth.angle
    wider = max(1.0, apart * units.spacing / max(params.voxel_size, units.spacing))
    return replace(growth, angle=(low, min(wider * high, 180.0)))
