# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The measurements of several clouds combined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from topo_region_seg.offline.inspection.points import PointFigures, known_median

BANDS = 5
"""Number of distance bands with equally many points."""
PERCENTILES = (1, 5, 25, 50, 75, 95, 99)


@dataclass(frozen=True)
class Band:
    """Points between two distances from the sensor: median spacing and depth noise; all in metres."""

    near: float
    far: float
    spacing: float
    noise: float


@dataclass(frozen=True)
class PointSummary:
    """Measurements of several clouds combined; shares from 0 to 1, lengths in metres.

    Parameters
    ----------
    clouds : int
        Number of measured clouds.
    invalid, zeros : float
        Share of the points without a position, including those at exactly (0, 0, 0), and of the latter alone.
    range : dict of int to float
        Percentiles of the distance from the sensor.
    spacing, noise : float
        Medians over all points; NaN where no point has a neighbor.
    bands : tuple of Band
        The medians by distance, near to far.
    """

    clouds: int
    invalid: float
    zeros: float
    range: dict[int, float]
    spacing: float
    noise: float
    bands: tuple[Band, ...]


def summarize(figures: Sequence[PointFigures]) -> PointSummary | None:
    """Combine the measurements of several clouds; None without a valid point."""
    points = sum(f.points for f in figures)
    if not sum(f.valid for f in figures):
        return None
    distance, spacing, noise = (
        np.concatenate(values) for values in zip(*((f.distance, f.spacing, f.noise) for f in figures), strict=True)
    )
    edges = np.quantile(distance, np.linspace(0.0, 1.0, BANDS + 1))
    bands = []
    for near, far in pairwise(edges.tolist()):
        inside = (distance >= near) & (distance <= far)
        bands.append(Band(near, far, known_median(spacing[inside]), known_median(noise[inside])))
    return PointSummary(
        clouds=len(figures),
        invalid=1.0 - sum(f.valid for f in figures) / points,
        zeros=sum(f.zeros for f in figures) / points,
        range={p: float(np.percentile(distance, p)) for p in PERCENTILES},
        spacing=known_median(spacing),
        noise=known_median(noise),
        bands=tuple(bands),
    )
