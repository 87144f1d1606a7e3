# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which pixels belong to the support plane, or lie behind it, at the noise of each depth."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray
from topo_region_seg.steps.support.surfaces import Surface
from topo_region_seg.steps.view.grid import ImageGrid
from topo_region_seg.steps.view.model import SensorModel
from topo_region_seg.steps.view.table import DepthTable, at_depth

NOTHING, SUPPORT, BEHIND, FREE = 0, 1, 2, 3
"""Classes of pixels: without depth, on the support plane, behind it, and what may belong to things."""
MARGIN = 3.0
SCATTER = 2.5
LEAST_MARGIN = 0.004
MOST_MARGIN = 0.03
BINS = 8
FEWEST = 500


def margins(grid: ImageGrid, model: SensorModel, surface: Surface, least: float) -> DepthTable:
    """Return within which height above a plane points are on it, metres, by depth."""
    depths = model.depths
    margin = np.clip(MARGIN * model.noise.value, least, MOST_MARGIN)
    height = np.abs(grid.xyz[::5] @ surface.normal.astype(np.float32) + np.float32(surface.offset))
    depth = grid.depth[::5]
    near = height < np.minimum(MOST_MARGIN, 2.0 * np.interp(depth, depths, margin))
    if np.count_nonzero(near) > FEWEST // 5:
        height, depth = height[near], depth[near]
        order = np.argsort(depth)
        bounds = np.linspace(0, len(order), BINS + 1).astype(int)
        at, scatter = np.empty(BINS), np.empty(BINS)
        for i in range(BINS):
            part = order[bounds[i] : bounds[i + 1]]
            at[i] = (depth[part[0]] + depth[part[-1]]) / 2.0
            scatter[i] = np.median(height[part]) / 0.6745
        margin = np.minimum(np.maximum(margin, SCATTER * np.interp(depths, at, scatter)), MOST_MARGIN)
    return DepthTable(model.noise.near, model.noise.density, margin)


@kernel
def classes_of_pixels(
    xyz: npt.NDArray[np.float32], depth: npt.NDArray[np.float32], normal: FloatArray, offset: float, margin: DepthTable
) -> npt.NDArray[np.uint8]:
    found = np.zeros(len(depth), np.uint8)
    u, v, w = normal[0], normal[1], normal[2]
    for p in range(len(depth)):
        z = np.float64(depth[p])
        if not z > 0.0:
            continue
        height = u * xyz[p, 0] + v * xyz[p, 1] + w * xyz[p, 2] + offset
        allowed = at_depth(margin, z)
        if height > allowed:
            found[p] = FREE
        elif height >= -allowed:
            found[p] = SUPPORT
        else:
            found[p] = BEHIND
    return found
