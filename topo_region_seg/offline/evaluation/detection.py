# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions as detections of objects: how many are right, and how much of what they cover is.

Overlap precision, recall and F are those of unseen object instance segmentation: Dave, Tokmakov and Ramanan 2019; Xie,
Xiang, Mousavian and Fox, "Unseen Object Instance Segmentation for Robotic Environments", IEEE T-RO 2021. Regions are
assigned to true segments one to one, so that the sum of the pairs' F is largest.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from topo_region_seg.data import BoolArray, FloatArray, IntArray
from topo_region_seg.offline.evaluation.contingency import Contingency

WELL_FOUND = 0.75
"""F above which a true segment counts as segmented well."""

_FIRST_TIE, _SECOND_TIE = 1e-7, 1e-9
"""Of assignments with equal sums of F the one with more well-found segments counts, then that with more points."""


def detection_measures(counted: Contingency, first_object: int) -> dict[str, float | None]:
    """Return the measures of regions as detections.

    Parameters
    ----------
    counted : Contingency
        The points of the true labels and of the regions.
    first_object : int
        True labels from this one up are objects; 0 is unknown, the others are surroundings.
    """
    c = counted
    is_object, is_region = c.truths >= first_object, c.labels > 0
    pair = is_object[c.truth] & is_region[c.label]
    segment, region, shared = c.truth[pair], c.label[pair], c.count[pair]
    both = c.truth_size[segment] + c.label_size[region]
    f, iou = 2.0 * shared / both, shared / (both - shared)
    chosen = assignment(segment, region, f, shared)
    objects = int(np.count_nonzero(is_object))
    counted_as = is_region & ~_mostly_unknown(c)
    reported = int(np.count_nonzero(counted_as))
    counted_as[region[chosen]] = True
    covered = int(c.label_size[counted_as].sum())
    right = int(shared[chosen].sum())
    precision = right / covered if covered else None
    recall = right / int(c.truth_size[is_object].sum()) if objects else None
    found: dict[str, float | None] = {
        "overlap_precision": precision,
        "overlap_recall": recall,
        "overlap_f": None if recall is None else harmonic_mean(precision, recall),
        "f75": int(np.count_nonzero(f[chosen] > WELL_FOUND)) / objects if objects else None,
    }
    for percent in (50, 75):
        # Above one half, a segment has one such region at most and a region one such segment.
        hits = int(np.count_nonzero(iou > percent / 100))
        found[f"precision_{percent}"] = hits / reported if reported else None
        found[f"recall_{percent}"] = hits / objects if objects else None
    found["false_objects"] = float(reported - np.count_nonzero(iou > 0.5))
    return found


def assignment(segment: IntArray, region: IntArray, f: FloatArray, shared: IntArray) -> IntArray:
    """Return the pairs, as rows of the arrays, that assign regions to segments one to one with the largest sum of F.

    Pairs that share no point are not assigned.
    """
    if not len(f):
        return np.zeros(0, np.int64)
    score = f + _FIRST_TIE * (f > WELL_FOUND) + _SECOND_TIE * shared / shared.sum()
    segments, rows = np.unique(segment, return_inverse=True)
    regions, columns = np.unique(region, return_inverse=True)
    # What shares no points, not even through others, cannot compete: each such part is a small problem of its own.
    size = len(segments) + len(regions)
    graph = coo_matrix((np.ones(len(f), np.int8), (rows, len(segments) + columns)), shape=(size, size))
    part = connected_components(graph, directed=False)[1][rows]
    order = np.argsort(part, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(part[order])) + 1)
    return np.sort(np.concatenate([_assigned(one, rows[one], columns[one], score[one]) for one in parts]))


def harmonic_mean(precision: float | None, recall: float) -> float:
    """Return F; 0 where nothing was reported."""
    return 2.0 * precision * recall / (precision + recall) if precision and recall else 0.0


def _assigned(pairs: IntArray, rows: IntArray, columns: IntArray, score: FloatArray) -> IntArray:
    if len(pairs) == 1:
        return pairs
    _, row = np.unique(rows, return_inverse=True)
    _, column = np.unique(columns, return_inverse=True)
    table = np.zeros((row.max() + 1, column.max() + 1))
    table[row, column] = score
    at = np.full(table.shape, -1)
    at[row, column] = pairs
    chosen = at[linear_sum_assignment(table, maximize=True)]
    return chosen[chosen >= 0]


def _mostly_unknown(c: Contingency) -> BoolArray:
    """Whether more than half of a region's points have the true label 0, (L,)."""
    unknown = c.truths[c.truth] == 0
    points = np.bincount(c.label[unknown], weights=c.count[unknown], minlength=len(c.labels))
    return 2 * points > c.label_size
