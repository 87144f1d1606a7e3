# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Finite planes of an image grid: their points are joined in the image, and each has a footprint and an outline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage
from scipy.spatial import ConvexHull, QhullError

from topo_region_seg.data import BoolArray, FloatArray
from topo_region_seg.steps.support.footprints import outside_polygon, seen_around, weighed_scatter
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
BOX = np.ones((3, 3))
DIRECTIONS, ROUNDING = 16, 1e-9
"""Directions in which points are extreme, and the distance from the sides of their polygon, as a share of its size,
within which points may be corners of a footprint, too."""


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
        count, center, scatter = weighed_scatter(points, near, normal, offset)
        if count < 3:
            break
        normal = np.ascontiguousarray(np.linalg.eigh(scatter)[1][:, 0])
        offset = -float(normal @ center)
    return normal, offset


def _described(points: FloatArray, near: FloatArray, own: BoolArray) -> Surface | None:
    mine = points[own]
    center = mine.mean(axis=0)
    vectors = np.linalg.eigh(np.cov((mine - center).T))[1]
    normal, axes = np.ascontiguousarray(vectors[:, 0]), np.ascontiguousarray(vectors[:, 1:])
    offset = -float(normal @ center)
    if offset < 0.0:
        normal, offset = -normal, -offset
    flat = (mine - center) @ axes
    low, high = np.percentile(flat, [2.0, 98.0], axis=0)
    try:
        hull = ConvexHull(_outer(flat)).equations
    except QhullError:  # all on a line
        return None
    front, through = seen_around(points, near, normal, offset, center, axes, hull)
    return Surface(
        normal=normal,
        offset=offset,
        share=len(mine) / len(points),
        front=front / len(points),
        through=through / len(points),
        side=float((high - low).min()),
        own=0.0,
        center=center,
        axes=axes,
        hull=hull,
    )


def _outer(flat: FloatArray) -> FloatArray:
    """Return those of points (N, 2) that are not inside the polygon of the extreme ones in some directions."""
    angle = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
    extreme = flat[np.unique((flat @ np.stack([np.cos(angle), np.sin(angle)])).argmax(axis=0))]
    sides = ConvexHull(extreme).equations
    return flat[outside_polygon(flat, sides, float(np.abs(flat).max()) * ROUNDING)]


def _with_outline(surface: Surface, label: np.ndarray, depth: Single, model: SensorModel, step: int) -> Surface:
    """Return the surface with what is known of its outline; its pixels have label 1, the others with a depth 2."""
    found = relations(label.ravel(), depth.ravel(), depth.shape[0], depth.shape[1], 3, model.noise, model.pixel * step)
    count = found.pixels[found.first == 1].sum(axis=0)
    total = max(float(count.sum()) + found.frame[1] + found.void[1], 1.0)
    return replace(surface, own=float(count[OWN]) / total)
