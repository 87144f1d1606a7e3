# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which region of a frame goes on with which one in memory: those that overlap most, or are near and alike."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
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
CANDIDATES = 4
"""Regions in memory, nearest in place, color and size, that a region may go on with if it does not overlap them."""
SETTLED = 0.5
"""Intersection over union from which on a region is not looked for elsewhere."""
LEAST_OVERLAP = 0.1
"""Least intersection over union that is taken for a region's own."""


def matched(
    table: RegionTable, tracks: Tracks, now: npt.NDArray[np.integer], before: npt.NDArray[np.integer]
) -> IntArray:
    """Return for each region of a frame (R,) the row of `tracks` that it goes on with, or -1.

    Pairs with the highest sum of intersection over union (0 to 1) and likeness (0 to 1) in place, color and size come
    first.

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
    settled = np.zeros(len(table), np.bool_)
    settled[one[overlap >= SETTLED]] = True
    near, near_other = _alike(here, there, np.flatnonzero(~settled))
    pairs, place = np.unique(np.append(one, near) * len(tracks) + np.append(other, near_other), return_inverse=True)
    rows, columns = pairs // len(tracks), pairs % len(tracks)
    score = np.maximum(0.0, 1.0 - np.linalg.norm(here[rows] - there[columns], axis=1))
    score[place[: len(overlap)]] += overlap
    return _paired(rows, columns, score, len(table), len(tracks))


def _paired(rows: IntArray, columns: IntArray, score: FloatArray, n_rows: int, n_columns: int) -> IntArray:
    """Return the column of each row (n_rows,), or -1, taking pairs from the highest score down; no column twice.

    In rounds: a pair is taken once no better one is left of its row nor of its column. The best assignment of all
    (Hungarian method) switches no fewer labels on the benchmark's streams, and takes more than linear time.
    """
    match = np.full(n_rows, -1)
    order = np.lexsort((columns, rows, -score))
    rows, columns = rows[order], columns[order]
    best_of_row, best_of_column = np.zeros(n_rows, np.int64), np.zeros(n_columns, np.int64)
    while len(rows):
        place = np.arange(len(rows))
        best_of_row[rows[::-1]] = best_of_column[columns[::-1]] = place[::-1]
        best = (best_of_row[rows] == place) & (best_of_column[columns] == place)
        match[rows[best]] = columns[best]
        taken = np.zeros(n_columns, np.bool_)
        taken[columns[best]] = True
        left = (match[rows] < 0) & ~taken[columns]
        rows, columns = rows[left], columns[left]
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


def _alike(here: FloatArray, there: FloatArray, wanted: IntArray) -> tuple[IntArray, IntArray]:
    """Return pairs of the rows `wanted` (W,) of `here` and rows of `there` that are less than one reach apart."""
    k = min(CANDIDATES, len(there))
    distance, partner = cKDTree(there, balanced_tree=False, compact_nodes=False).query(
        here[wanted], k=np.arange(1, k + 1), distance_upper_bound=1.0
    )
    rows, places = np.nonzero(np.isfinite(distance))
    return wanted[rows], partner[rows, places]
