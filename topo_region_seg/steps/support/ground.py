# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What each pixel belongs to, at the noise of its depth: the support, what is behind it, other surfaces, or things."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.compiled.order import order_of
from topo_region_seg.data import FloatArray
from topo_region_seg.steps.support.level import is_level
from topo_region_seg.steps.view.grid import ImageGrid, Single
from topo_region_seg.steps.view.model import SensorModel
from topo_region_seg.steps.view.scene import (
    BEHIND,
    FREE,
    NOTHING,
    STRUCTURE,
    SUPPORT,
    Classes,
    Scene,
    Surface,
    within_footprint,
)
from topo_region_seg.steps.view.table import DepthTable, at_depth

MARGIN = 3.0
"""Height above a surface, times the noise of the depth, within which points are on it."""
SCATTER = 2.5
"""The same, times the scatter of the surface's own points, where that is more: no table is quite flat."""
MOST_MARGIN = 0.03
"""Largest margin, metres: what stands on a table is not to go with it, however noisy it is."""
BINS = 8
"""Depths at which the scatter is told."""
FEWEST, STEP = 100, 5
"""Points that tell it, of every fifth pixel."""
OWN = 0.03
"""Share of its outline where a wall, or another surface that goes on behind what is before it, may hide something."""
APART = 0.01
"""Distance from a footprint, metres, up to which points are within it."""


def scene_of(
    grid: ImageGrid,
    model: SensorModel,
    surfaces: list[Surface],
    least: float,
    *,
    exact: bool,
    axes: FloatArray,
    up: FloatArray | None = None,
) -> Scene:
    """Return the scene with the surface as support that most carries what is seen.

    Parameters
    ----------
    grid : ImageGrid
        The pixels.
    model : SensorModel
        The sensor.
    surfaces : list of Surface
        What `find_surfaces` returns.
    least : float
        Least height above a surface at which points are no longer on it, metres.
    exact : bool
        Whether that height was set, and holds at every depth.
    axes : (3, 3) float64
        The camera's axes.
    up : (3,) float64, optional
        Unit vector. Only level surfaces, seen from above, carry things then.
    """
    classes = np.where(np.isfinite(grid.depth), FREE, NOTHING).astype(np.uint8)
    level = [surface for surface in surfaces if is_level(surface.normal, up)]
    support = max(level, key=lambda surface: _rank(surface, axes[1] if up is None else -up), default=None)
    if support is not None and support.share + support.front <= 2.0 * support.through:
        support = None
    margin = None
    if support is not None:
        margin = margins(grid, model, support, least, exact=exact)
        classes = classes_above(grid.xyz, grid.depth, support.normal, support.offset, margin)
    walls = tuple(surface for surface in surfaces if surface is not support and surface.own <= OWN)
    for wall in walls:
        given = wall.normal, wall.offset, margins(grid, model, wall, least, exact=exact)
        mark_wall(grid.xyz, grid.depth, *given, wall.center, wall.axes, wall.hull, classes)
    return Scene(grid, model, classes, support, walls, margin, axes)


def _rank(surface: Surface, down: FloatArray) -> float:
    """Return how well a surface does as support: much is on it and in front, little is seen through it.

    Cameras are rarely mounted on their side, so that what faces upwards in the image comes before walls.
    """
    up = 1.0 - float(surface.normal @ down)
    return (surface.share + surface.front - 2.0 * surface.through) * up


def margins(grid: ImageGrid, model: SensorModel, surface: Surface, least: float, *, exact: bool = False) -> DepthTable:
    """Return within which height above a surface points are on it, metres, by depth."""
    depths = model.depths
    margin = np.full(len(depths), least)
    if not exact:
        margin = np.clip(MARGIN * model.noise.value, least, max(MOST_MARGIN, least))
        by_noise = DepthTable(model.noise.near, model.noise.density, margin)
        height, depth = near_heights(grid.xyz, grid.depth, surface.normal, surface.offset, by_noise)
        if len(height) > FEWEST:
            order = order_of(depth)
            bounds = np.linspace(0, len(order), BINS + 1).astype(int)
            parts = [order[a:b] for a, b in pairwise(bounds)]
            at = [(depth[part[0]] + depth[part[-1]]) / 2.0 for part in parts]
            scatter = [np.median(height[part]) / 0.6745 for part in parts]
            wide = np.maximum(margin, SCATTER * np.interp(depths, at, scatter))
            margin = np.minimum(wide, max(MOST_MARGIN, least))
    return DepthTable(model.noise.near, model.noise.density, margin)


@kernel
def near_heights(
    xyz: Single, depth: Single, normal: FloatArray, offset: float, margin: DepthTable
) -> tuple[FloatArray, FloatArray]:
    """Return heights (H,) above or below a surface of points within twice the margin, and their depths (H,), metres.

    Every fifth pixel is looked at.
    """
    heights, depths, count = np.empty(len(depth) // STEP + 1), np.empty(len(depth) // STEP + 1), 0
    for p in range(0, len(depth), STEP):
        z = np.float64(depth[p])
        if not abs(z) < np.inf:
            continue
        height = abs(normal[0] * xyz[p, 0] + normal[1] * xyz[p, 1] + normal[2] * xyz[p, 2] + offset)
        if height < min(MOST_MARGIN, 2.0 * at_depth(margin, z)):
            heights[count], depths[count] = height, z
            count += 1
    return heights[:count].copy(), depths[:count].copy()


@kernel
def classes_above(xyz: Single, depth: Single, normal: FloatArray, offset: float, margin: DepthTable) -> Classes:
    """Return the class of each pixel (P,) by its height above the support."""
    classes = np.zeros(len(depth), np.uint8)
    u, v, w = normal[0], normal[1], normal[2]
    for p in range(len(depth)):
        z = np.float64(depth[p])
        if not abs(z) < np.inf:
            continue
        height = u * xyz[p, 0] + v * xyz[p, 1] + w * xyz[p, 2] + offset
        allowed = at_depth(margin, z)
        classes[p] = FREE if height > allowed else (SUPPORT if height >= -allowed else BEHIND)
    return classes


@kernel
def mark_wall(
    xyz: Single,
    depth: Single,
    normal: FloatArray,
    offset: float,
    margin: DepthTable,
    center: FloatArray,
    axes: FloatArray,
    hull: FloatArray,
    classes: Classes,
) -> None:
    """Make the free pixels on a surface, within its footprint, structure."""
    for p in range(len(depth)):
        if classes[p] != FREE:
            continue
        height = normal[0] * xyz[p, 0] + normal[1] * xyz[p, 1] + normal[2] * xyz[p, 2] + offset
        if abs(height) > at_depth(margin, np.float64(depth[p])):
            continue
        if within_footprint(xyz, p, center, axes, hull, APART):
            classes[p] = STRUCTURE
