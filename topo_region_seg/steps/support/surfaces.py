# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Finite planes of an image grid: their points are joined in the image, and each has a footprint and an outline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage
from scipy.spatial import ConvexHull, QhullError

from topo_region_seg.data import BoolArray, FloatArray
from topo_region_seg.steps.support.hypotheses import best_hypothesis
from topo_region_seg.steps.support.level import ANY_WAY
from topo_region_seg.steps.support.search import MISS
from topo_region_seg.steps.view.grid import ImageGrid, Single
from topo_region_seg.steps.view.model import SensorModel
from topo_region_seg.steps.view.outlines import OWN, relations
from topo_region_seg.steps.view.scene import Surface

PIXELS = 20_000
"""About how many pixels surfaces are looked for in."""
SAMPLE = 2_000
"""Pixels that a plane is tried on."""
HYPOTHESES = 300
"""Triples that are drawn for a plane: one of a tenth of the points is missed in three of four cases, but then it is
looked for again among what the others leave."""
PLANES = 6
"""Planes that are looked for, the largest first."""
SMALLEST_SHARE = 0.03
"""Share of the points that a surface needs."""
LEAST_TOLERANCE, TOLERANCE = 0.004, 2.5
"""Distance of a point of a surface from its plane: in metres at the least, and times the noise of the depth."""
FITTED, REFINEMENTS = 5_000, 5
"""About how many points a plane is fitted to, and how often."""
GAPS = 2
"""Half the width, pixels of the coarse image, of gaps across which points are joined."""
HIGH = 0.5
"""Height above a surface, metres, up to which points are in front of it."""
SEEN_THROUGH = 3.0
"""Tolerances behind a surface from which on it is seen through."""
BOX = np.ones((3, 3))


def find_surfaces(grid: ImageGrid, model: SensorModel, min_extent: float, seed: int) -> list[Surface]:
    """Return the surfaces of a frame whose shorter side is at least `min_extent`, metres, the largest planes first."""
    step = max(1, round(np.sqrt(grid.height * grid.width / PIXELS)))
    depth = np.ascontiguousarray(grid.depth.reshape(grid.height, grid.width)[::step, ::step])
    valid: BoolArray = np.isfinite(depth)
    xyz = grid.xyz.reshape(grid.height, grid.width, 3)[::step, ::step]
    points = np.asfortranarray(xyz[valid].astype(np.float64))
    near = np.maximum(LEAST_TOLERANCE, TOLERANCE * model.noise_at(depth[valid]))
    fewest = max(3.0, SMALLEST_SHARE * len(points))
    left, found = np.ones(len(points), np.bool_), []
    generator = np.random.default_rng(seed)
    for _ in range(PLANES):
        rest = np.flatnonzero(left)
        if len(rest) < fewest:
            break
        some = generator.choice(rest, min(len(rest), SAMPLE), replace=False)
        triples = generator.integers(0, len(some), (HYPOTHESES, 3))
        sample = np.ascontiguousarray(points[some])
        normal, offset, inliers = best_hypothesis(sample, triples, near[some], 3.0, MISS, ANY_WAY, 0.0)
        if inliers < 3:
            break
        some = rest[:: max(1, len(rest) // FITTED)]
        normal, offset = _fitted(points[some], near[some], normal, offset)
        on = left & (np.abs(points @ normal + offset) < near)
        if np.count_nonzero(on) < fewest:
            break
        left &= ~on
        mask = np.zeros(valid.shape, np.bool_)
        mask[valid] = on
        parts = ndimage.label(ndimage.binary_closing(mask, BOX, iterations=GAPS) & mask, BOX)[0]
        sizes = np.bincount(parts.ravel())
        sizes[0] = 0
        for part in np.flatnonzero(sizes >= fewest):
            image: BoolArray = parts == part
            surface = _described(points, near, image[valid])
            if surface is not None and surface.side >= min_extent:
                found.append((surface, np.where(image, 1, 2 * valid).astype(np.int32)))
    return [_with_outline(surface, label, depth, model, step) for surface, label in found]


def _fitted(points: FloatArray, near: FloatArray, normal: FloatArray, offset: float) -> tuple[FloatArray, float]:
    """Fit a plane to the points on it, weighed by their noise: far ones, of which more are near it, do not turn it."""
    for _ in range(REFINEMENTS):
        on = np.abs(points @ normal + offset) < near
        if np.count_nonzero(on) < 3:
            break
        mine, weight = points[on], near[on, None] ** -2
        center = (mine * weight).sum(axis=0) / weight.sum()
        apart = (mine - center) / near[on, None]
        normal = np.linalg.eigh(apart.T @ apart)[1][:, 0]
        offset = -float(normal @ center)
    return normal, offset


def _described(points: FloatArray, near: FloatArray, own: BoolArray) -> Surface | None:
    mine = points[own]
    center = mine.mean(axis=0)
    vectors = np.linalg.eigh(np.cov((mine - center).T))[1]
    normal, axes = vectors[:, 0], vectors[:, 1:]
    offset = -float(normal @ center)
    if offset < 0.0:
        normal, offset = -normal, -offset
    flat = (mine - center) @ axes
    low, high = np.percentile(flat, [2.0, 98.0], axis=0)
    try:
        hull = ConvexHull(flat).equations
    except QhullError:  # all on a line
        return None
    along = points @ normal
    height = along + offset
    ray = -offset / np.minimum(along, -1e-9)  # where the line of sight meets the plane
    behind = (height < -SEEN_THROUGH * near) & (ray > 0.0) & (ray < 1.0)
    before = (height > near) & (height < HIGH)

    def inside(places: FloatArray) -> float:
        within = ((places - center) @ axes @ hull[:, :2].T + hull[:, 2] <= 0.0).all(axis=1)
        return float(np.count_nonzero(within)) / len(points)

    return Surface(
        normal=normal,
        offset=offset,
        share=len(mine) / len(points),
        front=inside(points[before]),
        through=inside(points[behind] * ray[behind, None]),
        side=float((high - low).min()),
        own=0.0,
        center=center,
        axes=axes,
        hull=hull,
    )


def _with_outline(surface: Surface, label: np.ndarray, depth: Single, model: SensorModel, step: int) -> Surface:
    """Return the surface with what is known of its outline; its pixels have label 1, the others with a depth 2."""
    found = relations(label.ravel(), depth.ravel(), depth.shape[0], depth.shape[1], 3, model.noise, model.pixel * step)
    count = found.pixels[found.first == 1].sum(axis=0)
    total = max(float(count.sum()) + found.frame[1] + found.void[1], 1.0)
    return replace(surface, own=float(count[OWN]) / total)
