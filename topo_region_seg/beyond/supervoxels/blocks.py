# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Blocks of pixels that supervoxels grow on, where there is an image grid."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.params import Params
from topo_region_seg.steps.thinning.pixel_blocks import Blocks, pixel_angle, pixel_blocks

WIDTH = 1.75
"""Voxels in the width of a block."""
MANY = 40_000
"""Blocks from which on they are made wider."""
PER_SEED = 4.0
"""Blocks from one seed to the next, at least, where they are."""
WIDEST = 12
"""Pixels along the side of the widest block."""
ROUNDING = 1e-6


def takes_blocks(params: Params, height: int, count: int) -> bool:
    """Return whether supervoxels of `count` points in an image of some height grow on its grid; a list's is 1."""
    return params.output == "supervoxels" and height > 1 and count <= params.max_points


def block_width(params: Params, count: int, pixel: float) -> float:
    """Return how wide a block may be, metres, in an image of `count` points whose pixels are `pixel` (m) wide.

    As wide as some voxels are; wider where more than MANY would be left, up to a share of the spacing of seeds.
    """
    if params.voxel_size == 0.0:
        return 0.0
    fewer = min(math.ceil(math.sqrt(count / MANY)) * pixel, params.seed_spacing / PER_SEED)
    return max(WIDTH * params.voxel_size, fewer)


def image_blocks(
    xyz: FloatArray,
    rgb: npt.NDArray[np.uint8] | None,
    rows: IntArray,
    size: Sequence[int],
    params: Params,
    growth: float = 1.0,
    noise: float = 0.0,
    *,
    mix_colors: bool = True,
) -> Blocks:
    """Replace the points of every block by their mean.

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
    params : Params
        Uses `voxel_size` and `seed_spacing`, which say how wide a block may be at the middle distance.
    growth : float
        Factor by which these lengths have grown there.
    noise : float
        How far noise takes points of a surface from it there, as a share of their depth.
    mix_colors : bool
        Whether blocks may be of several pixels.
    """
    angle = pixel_angle(xyz, rows)
    middle = float(np.median(np.linalg.norm(xyz[::16], axis=1))) if len(xyz) else 0.0
    across = max(angle * middle, 1e-9)
    across /= growth
    wide = block_width(params, len(xyz), across) / across
    side = int(min(max(wide + ROUNDING, 1.0), WIDEST)) if mix_colors else 1
    return pixel_blocks(xyz, rgb, rows, size, side, angle, noise)
