# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions as detections of objects: how many are right, and how much of what they cover is.

Overlap precision, recall and F are those of unseen object instance segmentation: Dave, Tokmakov and Ramanan, "Towards
Segmenting Anything That Moves", 2019; Xie, Xiang, Mousavian and Fox, "Unseen Object Instance Segmentation for Robotic
Environments", IEEE T-RO 2021. Regions are assigned to true segments one to one, so that the sum of the pairs' F is
largest. A pair's intersection over union above one half makes it a detection; a segment then has one such region at
most, and a region one such segment.

A region with more than half of its points where the truth is unknown (label 0) is neither right nor false.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from topo_region_seg.data import BoolArray, FloatArray, IntArray, LabelArray
from topo_region_seg.offline.evaluation.contingency import Contingency

WELL_SEGMENTED = 0.75
"""F above which a true segment counts as segmented well."""

_POINTS_NEXT = 1e-9
"""Of assignments with the same sum of F that with more common points counts."""


@dataclass(frozen=True)
class Assigned:
    """Which region stands for which true segment.

    Parameters
    ----------
    segments, regions : (P,) uint32
        Labels of each pair.
    counted : uint32 array
        Labels of all regions that are right or false.
    """

    segments: LabelArray
    regions: LabelArray
    counted: LabelArray


@dataclass(frozen=True)
class Detection:
    """Pairs of true segment and region that share points, and which of them were chosen.

    Parameters
    ----------
    counted : Contingency
        All labels and their sizes.
    is_object : (T,) bool
        Which true labels are segments of objects.
    segment, region, shared : (P,) int64
        For each pair the rows of the labels in `counted`, and their common points.
    chosen : int64 array
        Rows of the pairs that are assigned to each other.
    reported : (L,) bool
        Which labels are regions that are right or false.
    """

    counted: Contingency
    is_object: BoolArray
    segment: IntArray
    region: IntArray
    shared: IntArray
    chosen: IntArray
    reported: BoolArray

    def measures(self) -> dict[str, float | None]:
        """Return the measures, by their names; None where there is nothing to measure."""
        c = self.counted
        f, iou = _f_and_iou(self)
        right, objects = int(self.shared[self.chosen].sum()), int(np.count_nonzero(self.is_object))
        covered = int(c.label_size[self._counts()].sum())
        precision = right / covered if covered else None
        recall = right / int(c.truth_size[self.is_object].sum()) if objects else None
        found: dict[str, float | None] = {
            "overlap_precision": precision,
            "overlap_recall": recall,
            "overlap_f": None if recall is None else harmonic_mean(precision or 0.0, recall),
            "f75": int(np.count_nonzero(f[self.chosen] > WELL_SEGMENTED)) / objects if objects else None,
        }
        reported = int(np.count_nonzero(self.reported))
        for percent in (50, 75):
            hits = int(np.count_nonzero(iou > percent / 100))
            found[f"precision_{percent}"] = hits / reported if reported else None
            found[f"recall_{percent}"] = hits / objects if objects else None
        if (c.truths > 0).any():
            found["false_objects"] = float(reported - np.count_nonzero(iou > 0.5))
        return found

    def hits(self) -> tuple[LabelArray, LabelArray]:
        """Return the labels (H,) of the segments and regions whose intersection over union is above one half."""
        c, hit = self.counted, _f_and_iou(self)[1] > 0.5
        return c.truths[self.segment[hit]], c.labels[self.region[hit]]

    def assigned(self) -> Assigned:
        """Return the labels that are assigned to each other."""
        c, segment, region = self.counted, self.segment[self.chosen], self.region[self.chosen]
        return Assigned(c.truths[segment], c.labels[region], c.labels[self._counts()])

    def _counts(self) -> BoolArray:
        """Which regions' points are right or false, (L,): those of an assigned one count even if most are unknown."""
        counts: BoolArray = self.reported.copy()
        counts[self.region[self.chosen]] = True
        return counts


def detect(counted: Contingency, first_object: int) -> Detection:
    """Assign regions to true segments.

    Parameters
    ----------
    counted : Contingency
        The points of the true labels and of the regions; label 0 is none.
    first_object : int
        True labels from this one up are objects; 0 is unknown, the others are surroundings.
    """
    c = counted
    is_object, is_region = c.truths >= first_object, c.labels > 0
    pair = is_object[c.truth] & is_region[c.label]
    unknown = c.truths[c.truth] == 0
    unknown_points = np.bincount(c.label[unknown], weights=c.count[unknown], minlength=len(c.labels))
    reported = is_region & (2 * unknown_points <= c.label_size)
    segment, region, shared = c.truth[pair], c.label[pair], c.count[pair]
    found = Detection(c, is_object, segment, region, shared, np.zeros(0, np.int64), reported)
    return replace(found, chosen=_assignment(found, _f_and_iou(found)[0]))


def harmonic_mean(precision: float, recall: float) -> float:
    """Return F; 0 where both are 0."""
    return 2.0 * precision * recall / (precision + recall) if precision + recall else 0.0


def _f_and_iou(d: Detection) -> tuple[FloatArray, FloatArray]:
    """Return F and intersection over union of each pair."""
    sizes = d.counted.truth_size[d.segment] + d.counted.label_size[d.region]
    return 2.0 * d.shared / sizes, d.shared / (sizes - d.shared)


def _assignment(d: Detection, f: FloatArray) -> IntArray:
    """Return the rows of the pairs that are assigned; pairs that share no point are not."""
    return best_pairs(d.segment, d.region, f + _POINTS_NEXT * d.shared / max(int(d.shared.sum()), 1))


def best_pairs(one: IntArray, other: IntArray, score: FloatArray) -> IntArray:
    """Return the rows, rising, of the pairs (P,) that take each of `one` and of `other` once and score most together.

    Parameters
    ----------
    one, other : (P,) int64
        The two of each pair, counted from 0.
    score : (P,) float64
        What each pair scores, above 0.
    """
    if not len(score):
        return np.zeros(0, np.int64)
    # Those that have no pair in common, not even by way of others, do not compete: each such part stands alone.
    first = int(np.max(one)) + 1
    count = first + int(np.max(other)) + 1
    graph = coo_matrix((np.ones(len(score), np.int8), (one, first + other)), (count, count))
    part = connected_components(graph, directed=False)[1][one]
    order = np.argsort(part, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(part[order])) + 1)
    return np.sort(np.concatenate([_best(rows, one[rows], other[rows], score[rows]) for rows in parts]))


def _best(pairs: IntArray, one: IntArray, other: IntArray, score: FloatArray) -> IntArray:
    """Return those of the pairs that together have the largest score."""
    if len(pairs) == 1:
        return pairs
    _, row = np.unique(one, return_inverse=True)
    _, column = np.unique(other, return_inverse=True)
    shape = int(np.max(row)) + 1, int(np.max(column)) + 1
    scores, place = np.zeros(shape), np.full(shape, -1)
    scores[row, column], place[row, column] = score, pairs
    chosen: IntArray = place[linear_sum_assignment(scores, maximize=True)]
    return chosen[chosen >= 0]
