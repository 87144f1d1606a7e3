# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The quality measures of one frame; docs/algorithm.md defines them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import BoolArray, IntArray, LabelArray
from topo_region_seg.offline.evaluation.boundaries import boundary_precision, boundary_recall

FIRST_OBJECT = 20
"""True labels from this one up are segments of objects; 0 is unknown, the others are background."""

MEASURES = ("wov", "fos", "fus", "ari", "boundary_recall", "boundary_precision", "asa", "labelled")
"""The names of the measures, in the order in which they are shown."""

Measures = dict[str, float | None]
"""A value for each of MEASURES; None where a frame does not define it."""


def measure(
    truth: LabelArray, labels: LabelArray, valid: BoolArray, height: int = 1, width: int | None = None
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

    Returns
    -------
    dict of str to float or None
        - `wov`, weighted overlap, 0 to 1: sum |G| |G ∩ S| / |G ∪ S| / sum |G|, where S is the region that covers
          most of the true segment G (of equal ones, the largest).
        - `fos`, over-segmentation, 0 to 1, 0 is best: 1 - sum |G ∩ S| / sum |G|.
        - `fus`, under-segmentation, 0 is best, can exceed 1: sum of |S - G| / sum |G|.
        - `ari`, adjusted Rand index on the points of objects; points without a region are one cluster.
        - `boundary_recall`, `boundary_precision`, 0 to 1, see :mod:`topo_region_seg.offline.evaluation.boundaries`.
        - `asa`, achievable segmentation accuracy, 0 to 1: sum over regions of their largest |G ∩ S| / sum |G|.
        - `labelled`, share of the valid points that have a region, 0 to 1.

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
    objects = valid & (truth >= FIRST_OBJECT)
    found: Measures = dict.fromkeys(MEASURES)
    found["labelled"] = float(np.mean(labels[valid] > 0)) if valid.any() else None
    if not objects.any():
        return found
    overlaps = _overlaps(truth[objects], labels[objects], labels[valid])
    found["wov"], found["fos"], found["fus"] = _best_regions(overlaps)
    found["ari"] = _adjusted_rand_index(overlaps)
    found["asa"] = _achievable_accuracy(overlaps)
    if height > 1:
        segments = np.where(objects, truth, 0).reshape(height, width)
        grid, known = labels.reshape(height, width), valid.reshape(height, width)
        found["boundary_recall"] = boundary_recall(segments, grid, known)
        found["boundary_precision"] = boundary_precision(segments, grid, known)
    return found


@dataclass(frozen=True)
class _Overlaps:
    """The pairs of true segment and region that share points, sorted by segment; row i of each array is a pair.

    Segments and regions are numbered from 0; `count` is |G ∩ S|, `segment_size` |G|, `region_size` |S|, and `none` is
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


def _overlaps(truth: LabelArray, labels: LabelArray, all_labels: npt.NDArray[np.uint32]) -> _Overlaps:
    """Count pairs of labels of the points of objects; `all_labels` are those of every valid point."""
    pairs, count = np.unique(truth.astype(np.uint64) << np.uint64(32) | labels, return_counts=True)
    _, segment = np.unique(pairs >> np.uint64(32), return_inverse=True)
    label, region = np.unique(pairs & np.uint64(0xFFFFFFFF), return_inverse=True)
    known, size = np.unique(all_labels, return_counts=True)
    segment_size = np.bincount(segment, weights=count).astype(np.int64)
    region_size = size[np.searchsorted(known, label)]
    return _Overlaps(segment, region, count, segment_size[segment], region_size[region], label[region] == 0)


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
    largest = np.zeros(len(o.region), np.int64)
    np.maximum.at(largest, o.region, np.where(o.none, 0, o.count))
    return float(largest.sum() / o.total)
