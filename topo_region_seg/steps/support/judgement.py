# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a plane is a surface, how large it is, and whether things stand on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from topo_region_seg.data import BoolArray, FloatArray, IntArray

CELLS = 8
"""Cells along each side of a plane's footprint."""
FEWEST_CELLS = CELLS * CELLS // 4
"""Cells in which a plane must have points; where it has few points, half as many as these."""
BESIDE = 3.0
"""Distance from a plane, as a multiple of that of its own points, up to which points lie beside it. Where points fill a
volume there are twice as many as on the plane; on a surface there are fewer."""
DENSE = 0.5
"""Points in a cell, as a multiple of the mean of those that hold any, from which on nothing is seen through it."""
STANDING = 0.05
"""Height above a plane, metres, up to which points are the foot of something that stands on it."""
FEWEST_STANDING = 0.002
"""Share of the points that must be the feet of things for the plane to carry them."""
SEEN_THROUGH = 2.0
"""How much more a point that is seen through a plane counts against it than one on it, or in front, counts for it."""


@dataclass(frozen=True)
class Judged:
    """A plane ``normal · x + offset = 0``, its normal towards the sensor.

    Parameters
    ----------
    normal : (3,) float64
        Unit normal.
    offset : float
        Distance of the sensor, metres.
    share, before, behind : float
        Shares of the points on it, in front of it and behind it.
    carries : bool
        Whether things stand on it.
    seen_through : bool
        Whether the scene is seen through it, so that it is no surface.
    hidden : float
        Share of the points that lie behind where it is dense, and could not be seen from the sensor.
    beneath : float
        Share of the points that are the feet of things on its far side.
    """

    normal: FloatArray
    offset: float
    share: float
    before: float
    behind: float
    carries: bool
    seen_through: bool
    hidden: float
    beneath: float

    @property
    def carries_beneath(self) -> bool:
        """Whether things stand on its far side alone, so that the sensor must be there."""
        return not self.carries and self.beneath > FEWEST_STANDING

    @property
    def rank(self) -> tuple[bool, float]:
        """What is largest for the support plane: what carries things comes first, then what is largest."""
        return self.carries, self.share


def judge(xyz: FloatArray, normal: FloatArray, offset: float, distance: float, min_extent: float) -> Judged | None:
    """Judge a plane by all points (N, 3) of a sample; None if it is no surface, or too small.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions in metres, the sensor at the origin.
    normal : (3,) float64
        Unit normal of the plane.
    offset : float
        Its offset, metres.
    distance : float
        Largest distance of a point of the plane from it, metres.
    min_extent : float
        Shorter side that it needs, metres.
    """
    if offset < 0.0:
        normal, offset = -normal, -offset
    height = xyz @ normal + offset
    on = np.abs(height) <= distance
    beside = (np.abs(height) <= BESIDE * distance) & ~on
    if int(np.count_nonzero(on)) < max(3, int(np.count_nonzero(beside))):
        return None
    axes = np.linalg.eigh(np.cov(xyz[on].T))[1][:, 1:]
    flat = xyz @ axes
    low, high = np.percentile(flat[on], [2.0, 98.0], axis=0)
    if float((high - low).min()) < min_extent:
        return None
    cells = np.bincount(_cells(flat[on], low, high), minlength=CELLS * CELLS)
    if np.count_nonzero(cells) < min(FEWEST_CELLS, (np.count_nonzero(on) + 1) // 2):
        return None  # its points are gathered in a few places
    try:
        hull = ConvexHull(flat[on]).equations
    except QhullError:  # all on a line
        return None

    def inside(points: FloatArray, margin: float) -> BoolArray:
        within: BoolArray = (points @ hull[:, :2].T + hull[:, 2] <= -margin).all(axis=1)
        return within

    before, behind = height > distance, height < -distance
    front = np.count_nonzero(inside(flat[before], 0.0))
    # Where the ray from the sensor to a point behind the plane crosses it.
    crossing = xyz[behind] * (offset / (offset - height[behind]))[:, None]
    crossing = crossing @ axes
    through = np.count_nonzero(inside(crossing, 0.0))
    dense = cells >= DENSE * np.count_nonzero(on) / np.count_nonzero(cells)
    unseen = inside(crossing, STANDING) & dense[_cells(crossing, low, high)]
    seen_through = np.count_nonzero(on) + front <= SEEN_THROUGH * through
    foot = (np.abs(height) > 1.5 * distance) & (np.abs(height) <= max(STANDING, BESIDE * distance))
    standing, beneath = (
        float(np.count_nonzero(inside(flat[foot & side], STANDING))) / len(xyz) for side in (before, behind)
    )
    return Judged(
        normal,
        offset,
        share=float(np.mean(on)),
        before=float(np.mean(before)),
        behind=float(np.mean(behind)),
        carries=bool(standing > FEWEST_STANDING),
        seen_through=bool(seen_through),
        hidden=float(np.count_nonzero(unseen)) / len(xyz),
        beneath=beneath,
    )


def _cells(flat: FloatArray, low: FloatArray, high: FloatArray) -> IntArray:
    """Return the cell of the footprint that each of the points (N, 2) on a plane is in, or next to."""
    cell = np.clip((flat - low) / (high - low) * CELLS, 0, CELLS - 1).astype(np.int64)
    cells: IntArray = cell[:, 0] * CELLS + cell[:, 1]
    return cells
