# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The search for the support plane: planes by RANSAC, the one that carries things, a fit to all of its points."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.sampling import sample_rows
from topo_region_seg.data import FloatArray, Plane
from topo_region_seg.steps.support.hypotheses import best_hypothesis, plane_moments
from topo_region_seg.steps.support.judgement import Judged, judge
from topo_region_seg.steps.support.level import ANY_WAY, NEARLY_LEVEL, is_level

SAMPLE = 2_000
"""About how many points hypotheses are drawn from and judged by."""
SMALLEST_SHARE = 0.08
"""Share of the points that a plane needs."""
MISS = 1e-3
"""Probability that the search misses a plane of the smallest share: no triple drawn lies on it."""
MOST_HYPOTHESES = math.ceil(math.log(MISS) / math.log(1.0 - 0.1**3))
"""Triples that are drawn at most: enough for a plane that holds a tenth of the points."""
MOST_PLANES = 4
"""Planes that are looked at: where the largest one carries nothing, a smaller one may."""
REFINEMENTS = 20
"""Least-squares fits; two or three usually settle the inliers."""


LARGE = 0.2
"""Share of the points on a plane from which on it may put the place of the sensor in doubt."""
DOUBT = 0.05
"""Share of the points that could not be seen from the sensor from which on it is probably elsewhere."""
IN_PLANE = 0.05
"""Distance from a large plane, metres, at which no sensor is."""


class Support(NamedTuple):
    """What the search found.

    Parameters
    ----------
    plane : Plane or None
        The support plane, its normal towards the sensor; None if there is none.
    judged : Judged or None
        What is known of it; without a plane, of a large one that could not be seen so from where the sensor is said to
        be, if there is such.
    """

    plane: Plane | None
    judged: Judged | None


NO_SUPPORT = Support(None, None)


def find_support(
    xyz: FloatArray,
    distance: float,
    min_extent: float,
    seed: int,
    *,
    sensor_known: bool = False,
    up: FloatArray | None = None,
) -> Support:
    """Find the plane that carries the objects.

    Planes are searched by RANSAC on a sample, the largest first. Each must be a surface (more points near it than
    beside it) of some extent that the scene is not seen through. Of these, one that things stand on is chosen before
    one that nothing stands on, such as a wall; then the largest. It is fitted by least squares to all of its points
    until these settle.

    The sample depends on the points alone, not on their order, so that a shuffled cloud gives the same plane.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions in metres, the sensor at the origin.
    distance : float
        Largest distance of a point of the plane from it, metres.
    min_extent : float
        Shorter side, metres, that a plane needs to carry objects.
    seed : int
        Seed of the search.
    sensor_known : bool
        Whether the place of the sensor was given, so that there is no doubt about it: points of several sensors may lie
        where one of them could not see them.
    up : (3,) float64, optional
        Unit vector. Only level planes, seen from above, carry things then; walls and ceilings do not.

    Returns
    -------
    Support
        The plane, or why there is doubt.
    """
    if len(xyz) < 3:
        return NO_SUPPORT
    xyz = np.asfortranarray(xyz)  # column by column, so that the passes over it become vector code
    sample = np.ascontiguousarray(xyz[sample_rows(xyz, SAMPLE, seed)])
    fewest = max(3.0, SMALLEST_SHARE * len(sample))
    rest, best = sample, None
    for _ in range(MOST_PLANES):
        if len(rest) < fewest:
            break
        triples = np.random.default_rng(seed).integers(0, len(rest), (MOST_HYPOTHESES, 3))
        given = rest, triples, np.full(len(rest), distance), fewest, MISS
        normal, offset, inliers = best_hypothesis(*given, *((ANY_WAY, 0.0) if up is None else (up, NEARLY_LEVEL)))
        if inliers < fewest:
            break
        normal, offset = fitted(rest, normal, offset, distance)
        found = judge(sample, normal, offset, distance, min_extent)
        if found is not None and is_level(found.normal, up):
            if not sensor_known and speaks_against_sensor(found):
                return Support(None, found)
            if not found.seen_through and (best is None or found.rank > best.rank):
                best = found
        if best is not None and best.carries:
            break
        rest = np.ascontiguousarray(rest[np.abs(rest @ normal + offset) > 2.0 * distance])
    return NO_SUPPORT if best is None else Support(_plane_of_all(xyz, best, distance), best)


def speaks_against_sensor(found: Judged) -> bool:
    """Return whether a plane is such that the sensor can hardly be where it is said to be."""
    return found.share >= LARGE and (found.hidden > DOUBT or found.offset < IN_PLANE or found.carries_beneath)


def fitted(xyz: FloatArray, normal: FloatArray, offset: float, distance: float) -> tuple[FloatArray, float]:
    """Fit a plane by least squares to the points (N, 3) within `distance` (m) of it, until these settle."""
    count = -1
    for _ in range(REFINEMENTS):
        moments = plane_moments(xyz, normal, offset, distance)
        if moments[0] < 3 or moments[0] == count:
            break
        count = moments[0]
        normal, offset = _least_squares(moments)
    return normal, offset


def _plane_of_all(xyz: FloatArray, best: Judged, distance: float) -> Plane:
    normal, offset = fitted(xyz, best.normal, best.offset, distance)
    if offset < 0.0:
        normal, offset = -normal, -offset
    return Plane(normal=(float(normal[0]), float(normal[1]), float(normal[2])), offset=float(offset))


def _least_squares(moments: FloatArray) -> tuple[FloatArray, float]:
    count, mean = moments[0], moments[1:4] / moments[0]
    xx, xy, xz, yy, yz, zz = moments[4:10] / count
    covariance = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - np.outer(mean, mean)
    normal: FloatArray = np.linalg.eigh(covariance)[1][:, 0]
    return normal, float(-normal @ mean)
