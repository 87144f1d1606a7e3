# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which region of a frame goes on with which one in memory: those that overlap most, or are near and alike."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching
from scipy.spatial import cKDTree

from topo_region_seg.beyond.tracking.overlap import common_points
from topo_region_seg.beyond.tracking.tracks import Tracks
from topo_region_seg.data import FloatArray, IntArray, RegionTable

REACH = 0.1
"""Farthest way of a region's center from where it is expected, if it overlaps nothing of what it was, metres."""
COLOR_REACH = 20.0
"""Largest difference of mean colors of such a region, CIE76 dE."""
SIZE_REACH = 1.0
"""Largest difference of sizes of such a region, in doublings."""
CANDIDATES = 8
"""Regions in memory, nearest in place, color and size, that a region may go on with if it does not overlap them."""
HIGHEST_COST = 3.0
"""Cost of a pair without any score: above the highest score, 2, as a cost of 0 means that there is no such pair."""
LEAST_OVERLAP = 0.1
"""Least intersection over union that is taken for a region's own."""


def matched(
    table: RegionTable, tracks: Tracks, now: npt.NDArray[np.integer], before: npt.NDArray[np.integer]
) -> IntArray:
    """Return for each region of a frame (R,) the row of `tracks` that it goes on with, or -1.

    Of all ways to pair regions it is the one with the largest sum of intersections over union (0 to 1) and likenesses
    (0 to 1) in place, color and size.

    Parameters
    ----------
    table : RegionTable
        The regions of the frame.
    tracks : Tracks
        The regions in memory.
    now, before : (N,) int
        Rows of the same points, counted from 1, in `table` and in `tracks`; 0 = none.
    """
    match = np.full(len(table), -1)
    if not len(table) or not len(tracks):
        return match
    one, other, overlap = _overlapping(now, before)
    here, there = _looks(table, tracks)
    near, near_other = _alike(here, there)
    pairs, place = np.unique(np.append(one, near) * len(tracks) + np.append(other, near_other), return_inverse=True)
    rows, columns = pairs // len(tracks), pairs % len(tracks)
    score = np.maximum(0.0, 1.0 - np.linalg.norm(here[rows] - there[columns], axis=1))
    score[place[: len(overlap)]] += overlap
    # With a column of its own, which costs as much as a pair without any score, each row can be left alone.
    alone = np.arange(len(table))
    cost = coo_array(
        (
            HIGHEST_COST - np.append(score, np.zeros(len(table))),
            (np.append(rows, alone), np.append(columns, len(tracks) + alone)),
        ),
        (len(table), len(tracks) + len(table)),
    )
    found, partner = min_weight_full_bipartite_matching(cost.tocsr())
    match[found] = np.where(partner < len(tracks), partner, -1)
    return match


def _overlapping(
    now: npt.NDArray[np.integer], before: npt.NDArray[np.integer]
) -> tuple[IntArray, IntArray, FloatArray]:
    """Return the pairs of rows, from 0, that overlap enough, and their intersections over union.

    Points of a region where nothing was known, as at the edge of a moving image, do not count.
    """
    common = common_points(now, before)
    ours = np.bincount(common.now, common.count)[common.now]
    theirs = np.bincount(before)[common.before + 1]
    overlap = common.count / (ours + theirs - common.count)
    enough = overlap >= LEAST_OVERLAP
    return common.now[enough], common.before[enough], overlap[enough]


def _looks(table: RegionTable, tracks: Tracks) -> tuple[FloatArray, FloatArray]:
    """Return place, color and size of the regions of a frame (R, 7) and of those in memory (T, 7), in reaches."""
    color, old_color = table.mean_lab, tracks.lab
    if np.isnan(color).any() or np.isnan(old_color).any():
        color, old_color = np.zeros_like(color), np.zeros_like(old_color)
    now = table.centroid / REACH, color / COLOR_REACH, np.log2(table.size)[:, None] / SIZE_REACH
    before = tracks.expected_centers() / REACH, old_color / COLOR_REACH, np.log2(tracks.size)[:, None] / SIZE_REACH
    return np.hstack(now), np.hstack(before)


def _alike(here: FloatArray, there: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the pairs of rows, from 0, that are near one another in all: less than one reach apart."""
    k = min(CANDIDATES, len(there))
    distance, partner = cKDTree(there).query(here, k=np.arange(1, k + 1), distance_upper_bound=1.0)
    rows, places = np.nonzero(np.isfinite(distance))
    return rows, partner[rows, places]
