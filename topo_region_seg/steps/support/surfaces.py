# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Finite planes of an image grid: their points are joined in the image, and each has an outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import ConvexHull, QhullError

from topo_region_seg.data import BoolArray, FloatArray
from topo_region_seg.steps.support.hypotheses import best_plane, weighted_moments
from topo_region_seg.steps.support.search import _least_squares
from topo_region_seg.steps.view.grid import ImageGrid
from topo_region_seg.steps.view.model import SensorModel
from topo_region_seg.steps.view.outlines import relations

PIXELS = 20_000
"""About how many pixels planes are looked for in."""
SAMPLE = 2_000
TRIES = 300
PLANES = 6
"""Planes that are looked for."""
LEAST_SHARE = 0.03
LEAST_TOLERANCE = 0.004
TOLERANCE = 2.5
REFINEMENTS = 5
HIGH = 0.5
BOX = np.ones((3, 3))


@dataclass(frozen=True)
class Surface:
    """A finite plane ``normal · x + offset = 0``, its normal towards the sensor at the origin."""

    normal: FloatArray
    offset: float
    share: float
    front: float
    through: float
    side: float
    own: BoolArray
    step: int
    center: FloatArray
    axes: FloatArray
    hull: FloatArray
    outline: FloatArray  # occluded, touching, own, frame, void


def find_surfaces(grid: ImageGrid, model: SensorModel, min_extent: float, seed: int) -> list[Surface]:
    step = max(1, round(np.sqrt(grid.height * grid.width / PIXELS)))
    depth = grid.depth.reshape(grid.height, grid.width)[::step, ::step]
    xyz = grid.xyz.reshape(grid.height, grid.width, 3)[::step, ::step]
    valid = np.isfinite(depth)
    points = xyz[valid].astype(np.float64)
    near = np.maximum(LEAST_TOLERANCE, TOLERANCE * model.noise_at(depth[valid]))
    total, left = len(points), np.ones(len(points), np.bool_)
    generator, found = np.random.default_rng(seed), []
    for _ in range(PLANES):
        if np.count_nonzero(left) < 2.0 * LEAST_SHARE * total:
            break
        normal, offset = _largest(points[left], near[left], generator)
        on = left & (np.abs(points @ normal + offset) < near)
        if np.count_nonzero(on) < LEAST_SHARE * total:
            break
        mask = np.zeros(valid.shape, np.bool_)
        mask[valid] = on
        parts, _ = ndimage.label(ndimage.binary_closing(mask, BOX, iterations=2) & mask, BOX)
        sizes = np.bincount(parts.ravel())
        sizes[0] = 0
        for part in np.flatnonzero(sizes >= LEAST_SHARE * total):
            own = (parts == part)[valid]
            surface = _judged(points, near, own, step, valid, depth, model)
            if surface is not None and surface.side >= min_extent:
                found.append(surface)
        left &= ~on
    return found


def _largest(points, near, generator):
    some = generator.choice(len(points), min(len(points), SAMPLE), replace=False)
    triples = generator.integers(0, len(some), (TRIES, 3))
    normal, offset, _ = best_plane(points[some], near[some], triples, 1.0, 1e-9)
    for _ in range(REFINEMENTS):
        moments = weighted_moments(points, near, normal, offset)
        if moments[0] <= 0.0:
            break
        normal, offset = _least_squares(moments)
    return (-normal, -offset) if offset < 0.0 else (normal, offset)


def _judged(points, near, own, step, valid, depth, model):
    mine = points[own]
    normal, offset = np.zeros(3), 0.0
    normal, offset = _least_squares(weighted_moments(mine, near[own], normal, offset))
    if offset < 0.0:
        normal, offset = -normal, -offset
    center = mine.mean(axis=0)
    axes = np.linalg.eigh(np.cov((mine - center).T))[1][:, 1:]
    flat = (mine - center) @ axes
    low, high = np.percentile(flat, [2.0, 98.0], axis=0)
    try:
        hull = ConvexHull(flat).equations
    except QhullError:
        return None
    along = points @ normal
    height = along + offset
    ray = -offset / np.minimum(along, -1e-9)
    behind = (height < -3.0 * near) & (ray > 0.0) & (ray < 1.0)
    before = (height > near) & (height < HIGH)

    def inside(flat):
        return np.count_nonzero((flat @ hull[:, :2].T + hull[:, 2] <= 0.0).all(axis=1))

    through = inside((points[behind] * ray[behind, None] - center) @ axes)
    front = inside((points[before] - center) @ axes)
    n = len(points)
    image = np.zeros(valid.shape, np.bool_)
    image[valid] = own
    label = np.where(image, 1, np.where(valid, 2, 0)).astype(np.int32).ravel()
    seen = relations(label, np.ascontiguousarray(depth).ravel(), *valid.shape, 3, model.noise, model.pixel * step)
    mine_of = seen.count[(seen.first == 1) & (seen.second == 2)].sum(axis=0) if len(seen.first) else np.zeros(3)
    outline = np.append(mine_of, [seen.frame[1], seen.void[1]]) / max(mine_of.sum() + seen.frame[1] + seen.void[1], 1.0)
    return Surface(
        normal, offset, len(mine) / n, front / n, through / n, float((high - low).min()), image, step, center, axes, hull, outline
    )
