# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions of one frame that have become one in the next, by noise perhaps, and how they lay apart."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial import cKDTree

from topo_region_seg.beyond.tracking.overlap import common_points
from topo_region_seg.data import FloatArray, IntArray

PRESENT = 0.5
"""Share of a region's points that must lie in another one for the region to have become part of it."""
FEWEST = 10
"""Points of the smallest region that is looked at."""


def joined_regions(now: IntArray, before: IntArray) -> dict[int, tuple[int, ...]]:
    """Return the regions of now that several of before have become: for each the rows of those, the largest first.

    Parameters
    ----------
    now, before : (N,) int64
        Rows of the same points in the tables of two consecutive frames, counted from 1; 0 = none.
    """
    common = common_points(now, before)
    inside = common.count >= np.maximum(PRESENT * np.bincount(before)[common.before + 1], FEWEST)
    parts: dict[int, list[tuple[int, int]]] = {}
    pairs = common.now[inside] + 1, common.before[inside] + 1, common.count[inside]
    for one, former, count in zip(*(column.tolist() for column in pairs), strict=True):
        parts.setdefault(one, []).append((-count, former))
    return {one: tuple(former for _, former in sorted(found)) for one, found in parts.items() if len(found) > 1}


def parted(xyz: FloatArray, now: IntArray, before: IntArray, held: Mapping[int, tuple[int, ...]]) -> IntArray:
    """Return regions of now (N,), counted from 0, -1 for none, in which those of `held` are parted as before.

    Parameters
    ----------
    xyz : (N, 3) float64
        Positions, metres.
    now, before : (N,) int64
        As for `joined_regions`.
    held : mapping
        For each region to part, the former rows of its parts. Points that were in none of them go with the nearest
        that was in one.
    """
    found, fresh = now.copy(), int(np.max(now)) + 1
    for region, formers in held.items():
        rows = np.flatnonzero(now == region)
        part = np.full(len(rows), -1)
        for number, former in enumerate(formers):
            part[before[rows] == former] = number
        known = part >= 0
        if not known.all():
            _, nearest = cKDTree(xyz[rows[known]]).query(xyz[rows[~known]])
            part[~known] = part[known][nearest]
        found[rows[part > 0]] = fresh + part[part > 0] - 1
        fresh += len(formers) - 1
    _, counted = np.unique(found[found > 0], return_inverse=True)
    regions = np.full(len(found), -1, np.int64)
    regions[found > 0] = counted
    return regions
