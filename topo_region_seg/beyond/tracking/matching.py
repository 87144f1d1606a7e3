# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which region of a frame goes on with which one in memory: those that overlap most, or are near and alike."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from topo_region_seg.beyond.tracking.overlap import common_points
from topo_region_seg.beyond.tracking.tracks import Tracks
from topo_region_seg.data import BoolArray, FloatArray, IntArray, RegionTable

REACH = 0.1
"""Largest distance of a region's center from where it is expected, if it no longer overlaps where it was, metres."""
COLOR_REACH = 20.0
"""Largest difference of mean colors of such a region, CIE76 dE."""
CANDIDATES = 4
"""Regions in memory, nearest in place and color, that a region may go on with if it does not overlap them."""
SETTLED = 0.5
"""Intersection over union above which a region goes on with another one whatever they look like."""
LEAST_OVERLAP = 0.1
"""Least intersection over union that is taken for a region's own."""


def matched(
    table: RegionTable,
    tracks: Tracks,
    now: npt.NDArray[np.integer],
    before: npt.NDArray[np.integer],
    *,
    likeness: bool = True,
) -> IntArray:
    """Return for each region of a frame (R,) the row of `tracks` that it goes on with, or -1.

    First those that mostly overlap; then, from the highest down, by the sum of intersection over
    union (0 to 1) and likeness (0 to 1) in place and color.

    Parameters
    ----------
    table : RegionTable
        The regions of the frame.
    tracks : Tracks
        The regions in memory.
    now, before : (N,) int
        Rows of the same points, counted from 1, in `table` and in `tracks`; 0 = none.
    likeness : bool
        Whether what does not overlap may go on with what is near and alike.
    """
    match = np.full(len(table), -1)
    if not len(table) or not len(tracks):
        return match
    one, other, overlap = _overlapping(now, before)
    mostly = overlap > SETTLED
    match[one[mostly]] = other[mostly]
    columns = np.ones(len(tracks), np.bool_)
    columns[match[match >= 0]] = False
    some = (match[one] < 0) & columns[other]
    one, other, score = one[some], other[some], overlap[some]
    if likeness:
        one, other, score = _with_alike(table, tracks, np.flatnonzero(match < 0), columns, (one, other, score))
    found = _paired(one, other, score, len(table), len(tracks))
    return np.where(match < 0, found, match)


Pairs = tuple[IntArray, IntArray, FloatArray]
"""Rows of regions, rows of `tracks`, and how well they fit, each (P,)."""


def _with_alike(table: RegionTable, tracks: Tracks, rows: IntArray, free: BoolArray, overlapping: Pairs) -> Pairs:
    """Return the pairs that overlap and those of some `rows` and `free` tracks that are near, likeness added to all."""
    one, other, overlap = overlapping
    here, there = _looks(table, tracks)
    near, near_other = _alike(here, there, rows, np.flatnonzero(free))
    pairs = np.append(one, near) * len(tracks) + np.append(other, near_other)
    pairs, place = np.unique(pairs, return_inverse=True)
    one_of, other_of = np.divmod(pairs, len(tracks))
    score = np.maximum(0.0, 1.0 - np.linalg.norm(here[one_of] - there[other_of], axis=1))
    score[place[: len(one)]] += overlap
    return one_of, other_of, score


def _paired(rows: IntArray, columns: IntArray, score: FloatArray, n_rows: int, n_columns: int) -> IntArray:
    """Return the column of each row (n_rows,), or -1, taking pairs from the highest score down, each column once.

    In rounds: a pair is taken once no better one is left of its row or of its column; of equal ones the first is
    better. The assignment with the highest sum (Hungarian method) takes more than linear time.
    """
    match = np.full(n_rows, -1)
    order = np.argsort(-score, kind="stable")
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
    """Return place and color of the regions of a frame (R, 6) and of those in memory (T, 6), in reaches."""
    color, old_color = table.mean_lab, tracks.lab
    if np.isnan(color).any() or np.isnan(old_color).any():
        color, old_color = np.zeros_like(color), np.zeros_like(old_color)
    now = table.centroid / REACH, color / COLOR_REACH
    before = tracks.expected_centers() / REACH, old_color / COLOR_REACH
    return np.hstack(now), np.hstack(before)


def _alike(here: FloatArray, there: FloatArray, rows: IntArray, columns: IntArray) -> tuple[IntArray, IntArray]:
    """Return pairs of some rows of `here` and of `there` that are less than one reach apart."""
    if not len(rows) or not len(columns):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    k = np.arange(1, min(CANDIDATES, len(columns)) + 1)
    tree = cKDTree(there[columns], balanced_tree=False, compact_nodes=False)
    distance, partner = tree.query(here[rows], k=k, distance_upper_bound=1.0)
    found, places = np.nonzero(np.isfinite(distance))
    return rows[found], columns[partner[found, places]]
