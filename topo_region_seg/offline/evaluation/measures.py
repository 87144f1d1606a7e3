# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The quality measures of one frame; docs/evaluation.md defines them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from topo_region_seg.data import BoolArray, IntArray, LabelArray
from topo_region_seg.offline.evaluation.boundaries import boundary, object_boundary_f, share_near
from topo_region_seg.offline.evaluation.contingency import Contingency, contingency
from topo_region_seg.offline.evaluation.detection import detect
from topo_region_seg.offline.evaluation.leakage import leakage

FIRST_OBJECT = 20
"""True labels from this one up are segments of objects; 0 is unknown, the others are background."""
PER_OBJECT = 10
"""The parts of an object have labels with the same tens."""

SEGMENTATION = ("wov", "fos", "fus", "ari", "boundary_recall", "boundary_precision", "asa", "labelled")
"""How well regions fit the true segments, whatever else they cover."""
DETECTION = (
    "overlap_precision",
    "overlap_recall",
    "overlap_f",
    "f75",
    "precision_50",
    "recall_50",
    "precision_75",
    "recall_75",
    "false_objects",
    "boundary_f",
)
"""How good each region is as a detection of one object."""
LEAKAGE = ("achievable", "spill", "pieces")
"""How far regions reach beyond the objects that they lie on."""
MEASURES = SEGMENTATION + DETECTION + LEAKAGE
"""The names of the measures, in the order in which they are shown."""
NEEDS_ALL_OBJECTS = (
    "boundary_precision",
    "overlap_precision",
    "overlap_f",
    "precision_50",
    "precision_75",
    "false_objects",
    "boundary_f",
)
"""Measures that count regions without a true object as wrong, which is only known if all objects have truth."""

Measures = dict[str, float | None]
"""A value for each of MEASURES; None where a frame does not define it."""


@dataclass(frozen=True)
class TruthReading:
    """What true labels mean.

    Parameters
    ----------
    whole_objects : bool
        Labels from 20 on with the same tens are one segment.
    partial : bool
        Only some of the objects have truth: :data:`NEEDS_ALL_OBJECTS` are not defined.
    """

    whole_objects: bool = False
    partial: bool = False

    def segments(self, truth: LabelArray) -> LabelArray:
        """Return the true labels (N,) with one for each segment."""
        if not self.whole_objects:
            return truth
        return np.where(truth >= FIRST_OBJECT, truth // PER_OBJECT * PER_OBJECT, truth)


AS_LABELED = TruthReading()
"""Each label is a segment, and all objects have truth."""


def measure(
    truth: LabelArray,
    labels: LabelArray,
    valid: BoolArray,
    height: int = 1,
    width: int | None = None,
    reading: TruthReading = AS_LABELED,
) -> Measures:
    """Return all measures of one frame.

    Parameters
    ----------
    truth : (N,) uint32
        True segments; labels from 20 up are objects. Labels of invalid points are ignored.
    labels : (N,) uint32
        Regions; 0 = none.
    valid : (N,) bool
        Points with a finite position.
    height, width : int
        Organization of the cloud; the boundary measures need an image grid, so `height` greater than 1.
    reading : TruthReading
        What the true labels mean.

    Returns
    -------
    dict of str to float or None
        - `wov`, weighted overlap, 0 to 1: sum |G| |G ∩ S| / |G ∪ S| / sum |G|, where S is the region that covers
          most of the true segment G (of equal ones, the largest).
        - `fos`, over-segmentation, 0 to 1, 0 is best: 1 - sum |G ∩ S| / sum |G|.
        - `fus`, under-segmentation, 0 is best, can exceed 1: sum of |S - G| / sum |G|.
        - `ari`, adjusted Rand index on the points of objects; points without a region are one cluster.
        - `boundary_recall`, `boundary_precision`, `boundary_f`, 0 to 1, see
          :mod:`topo_region_seg.offline.evaluation.boundaries`.
        - `asa`, achievable segmentation accuracy, 0 to 1: sum over regions of their largest |G ∩ S| / sum |G|.
        - `labelled`, share of the valid points that have a region, 0 to 1.
        - those of LEAKAGE, see :mod:`topo_region_seg.offline.evaluation.leakage`.
        - the others of DETECTION, see :mod:`topo_region_seg.offline.evaluation.detection`.

        None where there is nothing to measure: no object in the frame, no boundary, no image grid, no valid point.

    Raises
    ------
    ValueError
        The arrays differ in length, or their length is not `height` * `width`.
    """
    if width is None:
        width = len(labels) // height
    if not len(truth) == len(labels) == len(valid) == height * width:
        raise ValueError(f"{len(truth)} true labels, {len(labels)} labels, {len(valid)} points, {width} x {height}")
    truth = reading.segments(truth)
    counted = contingency(truth[valid], labels[valid])
    found: Measures = dict.fromkeys(MEASURES)
    found["labelled"] = float(np.mean(labels[valid] > 0)) if valid.any() else None
    detection = detect(counted, FIRST_OBJECT)
    found |= detection.measures()
    overlaps = _overlaps(counted)
    if len(overlaps.count):
        found["wov"], found["fos"], found["fus"] = _best_regions(overlaps)
        found["ari"] = _adjusted_rand_index(overlaps)
        found["asa"] = _achievable_accuracy(overlaps)
        found |= leakage(counted, FIRST_OBJECT)
        if height > 1:
            segments = np.where(valid & (truth >= FIRST_OBJECT), truth, np.uint32(0)).reshape(height, width)
            grid, known = labels.reshape(height, width), valid.reshape(height, width)
            true_edge, own_edge = boundary(segments, known), boundary(grid, known)
            found["boundary_recall"] = share_near(true_edge, own_edge)
            found["boundary_precision"] = share_near(own_edge, true_edge)
            found["boundary_f"] = object_boundary_f(segments, grid, true_edge, own_edge, detection.assigned())
    if reading.partial:
        found |= dict.fromkeys(NEEDS_ALL_OBJECTS)
    return found


@dataclass(frozen=True)
class _Overlaps:
    """The pairs of true segment and region that share points, sorted by segment; row i of each array is a pair.

    Segments and regions are numbered; `count` is |G ∩ S|, `segment_size` |G|, `region_size` |S|, and `none` is
    true where the region is label 0: no region.
    """

    segment: IntArray
    region: IntArray
    count: IntArray
    segment_size: IntArray
    region_size: IntArray
    none: BoolArray

    @property
    def total(self) -> int:
        """Number of points of all true segments."""
        return int(self.count.sum())


def _overlaps(counted: Contingency) -> _Overlaps:
    """Take the pairs of objects."""
    c = counted
    of_object = c.truths[c.truth] >= FIRST_OBJECT
    segment, region, count = c.truth[of_object], c.label[of_object], c.count[of_object]
    return _Overlaps(segment, region, count, c.truth_size[segment], c.label_size[region], c.labels[region] == 0)


def _best_regions(overlaps: _Overlaps) -> tuple[float, float, float]:
    """Return weighted overlap, over-segmentation and under-segmentation."""
    o = overlaps
    order = np.lexsort((o.region_size, np.where(o.none, 0, o.count), o.segment))
    best = order[np.append(np.diff(o.segment[order]) > 0, True)]  # the last of each segment
    best = best[~o.none[best]]
    shared, size, region = o.count[best], o.segment_size[best], o.region_size[best]
    wov = (size * shared / (size + region - shared)).sum() / o.total
    return float(wov), float(1.0 - shared.sum() / o.total), float((region - shared).sum() / o.total)


def _adjusted_rand_index(overlaps: _Overlaps) -> float:
    """Return the adjusted Rand index (Hubert and Arabie, 1985) of the two partitions of the points of objects."""
    o = overlaps
    together = _pairs(o.count)
    in_segments = _pairs(np.bincount(o.segment, weights=o.count).astype(np.int64))
    in_regions = _pairs(np.bincount(o.region, weights=o.count).astype(np.int64))
    if together == in_segments == in_regions:
        return 1.0
    expected = in_segments * in_regions / _pairs(np.array([o.total]))
    return (together - expected) / ((in_segments + in_regions) / 2 - expected)


def _pairs(sizes: IntArray) -> int:
    """Return the number of pairs of points within sets of these sizes."""
    return int((sizes * (sizes - 1)).sum()) // 2


def _achievable_accuracy(overlaps: _Overlaps) -> float:
    """Return the share of the objects' points that is right if every region takes its most frequent segment."""
    o = overlaps
    largest = np.zeros(int(np.max(o.region)) + 1, np.int64)
    np.maximum.at(largest, o.region, np.where(o.none, 0, o.count))
    return float(largest.sum() / o.total)
