# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbering of the occupied voxels of a grid, by a hash table."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import index, kernel
from topo_region_seg.data import FloatArray, IntArray


@kernel
def number_voxels(xyz: FloatArray, edge: float) -> tuple[IntArray, IntArray]:
    """Return the voxel (N,) of every point, numbered in the order of appearance, and the first point (M,) of each."""
    n = len(xyz)
    slots = 16
    while slots < 2 * n:
        slots *= 2
    table = np.full(slots, -1, np.int32)  # voxel in the slot
    cells = np.empty((n, 3), np.int64)
    first = np.empty(n, np.int64)
    voxel = np.empty(n, np.int64)
    count = 0
    for i in range(n):
        a, b, c = (
            np.int64(math.floor(xyz[i, 0] / edge)),
            np.int64(math.floor(xyz[i, 1] / edge)),
            np.int64(math.floor(xyz[i, 2] / edge)),
        )
        slot = (a * 73856093 ^ b * 19349663 ^ c * 83492791) * -7046029254386353131
        slot = (slot ^ (slot >> 32)) & (slots - 1)
        while True:
            v = np.int64(table[index(slot)])
            if v < 0:
                v, table[index(slot)] = count, count
                cells[index(v), 0], cells[index(v), 1], cells[index(v), 2] = a, b, c
                first[index(v)] = i
                count += 1
            if cells[index(v), 0] == a and cells[index(v), 1] == b and cells[index(v), 2] == c:
                voxel[i] = v
                break
            slot = (slot + 1) & (slots - 1)
    return voxel, first[:count].copy()


@kernel
def voxel_means(values: npt.NDArray[Any], voxel: IntArray, n_voxels: int) -> tuple[FloatArray, IntArray]:
    """Return the mean (M, 3) of the `values` (N, 3) in each voxel, and the number of them (M,)."""
    mean = np.zeros((n_voxels, 3))
    count = np.zeros(n_voxels, np.int64)
    for i in range(len(voxel)):
        v = index(voxel[i])
        count[v] += 1
        for c in range(3):
            mean[v, c] += values[i, c]
    for v in range(n_voxels):
        for c in range(3):
            mean[v, c] /= count[v]
    return mean, count
