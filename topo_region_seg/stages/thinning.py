# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Voxel thinning for sensors that deliver more points than are needed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.kernels.voxels import number_voxels, voxel_means


class Thinned(NamedTuple):
    """One point per occupied voxel.

    `xyz` (M, 3) and `rgb` (M, 3) uint8 or None are means over the voxel, `first` (M,) is the first input row
    in the voxel, `voxel` (N,) the voxel of every input row, by which labels are carried back, and `weight` (M,) the
    number of input rows in the voxel.
    """

    xyz: FloatArray
    rgb: npt.NDArray[np.uint8] | None
    first: IntArray
    voxel: IntArray
    weight: IntArray


def thin(xyz: FloatArray, rgb: npt.NDArray[np.uint8] | None, voxel_size: float) -> Thinned:
    """Replace the points of every voxel of edge `voxel_size` (m) by their mean.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions, metres.
    rgb : (N, 3) uint8 or None
        Colors.
    voxel_size : float
        Edge of the grid's cubes, metres, > 0. The grid is aligned with the sensor frame.
    """
    voxel, first = number_voxels(xyz, voxel_size)
    means = [voxel_means(values, voxel, len(first)) for values in ((xyz,) if rgb is None else (xyz, rgb))]
    mean_rgb = None if rgb is None else np.rint(means[1][0]).astype(np.uint8)
    return Thinned(means[0][0], mean_rgb, first, voxel, means[0][1])
