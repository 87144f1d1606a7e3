# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Boundaries on the image grid of an organized cloud.

A pixel is on a boundary if one of its four neighbors has another label and both are valid: the end of the depth data
is not a boundary of the segmentation.

Boundary recall is the share of the pixels on a true boundary that have a region's boundary in the square of 5 x 5
pixels around them, which means at most 2 pixels away; boundary precision is the share of the pixels on a region's
boundary that have a true one there. Both are of all labels together.

Boundary F is of objects: of a pixel on the boundary of an object, the boundary of the region that is assigned to it (as
for Overlap F) has to be near, and the other way round. Near is a disk, whose radius is 0.3 % of the image's diagonal
(3 pixels of 640 x 480). It is that of Xie et al. (T-RO 2021), who take it from video segmentation, except for the end
of the depth data.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import maximum_filter

from topo_region_seg.data import BoolArray, IntArray, LabelArray
from topo_region_seg.offline.evaluation.detection import Assigned, harmonic_mean

TOLERANCE = 2
"""Pixels."""
DIAGONALS = 0.003
"""Tolerance of `boundary_f`, in diagonals of the image: as the program of the authors of the measure has it."""


def boundary(labels: LabelArray, valid: BoolArray) -> BoolArray:
    """Return the pixels on a boundary, those of both its sides, (H, W)."""
    found = np.zeros(labels.shape, np.bool_)
    across = (labels[:, 1:] != labels[:, :-1]) & valid[:, 1:] & valid[:, :-1]
    down = (labels[1:] != labels[:-1]) & valid[1:] & valid[:-1]
    found[:, 1:] |= across
    found[:, :-1] |= across
    found[1:] |= down
    found[:-1] |= down
    return found


def share_near(wanted: BoolArray, given: BoolArray) -> float | None:
    """Return the share of the pixels `wanted` that are within 2 pixels of `given`, (H, W) each; None without any."""
    count = int(np.count_nonzero(wanted))
    if not count:
        return None
    near = maximum_filter(given, size=2 * TOLERANCE + 1, mode="constant", cval=False)
    return int(np.count_nonzero(wanted & near)) / count


def tolerance(height: int, width: int) -> int:
    """Return the pixels that the boundaries of an object and of its region may be apart, for `boundary_f`."""
    return math.ceil(DIAGONALS * math.hypot(height, width))


def object_boundary_f(
    segments: LabelArray, labels: LabelArray, true_edge: BoolArray, own_edge: BoolArray, assigned: Assigned
) -> float | None:
    """Return F of the boundaries of objects and the regions that are assigned to them; None without a true boundary.

    Parameters
    ----------
    segments, labels : (H, W) uint32
        True segments and regions; 0 = none.
    true_edge, own_edge : (H, W) bool
        Pixels on the boundary of the segments and of the regions.
    assigned : Assigned
        Which region stands for which segment.
    """
    objects, regions = true_edge & (segments > 0), own_edge & (labels > 0)
    regions[regions] = np.isin(labels[regions], assigned.counted)
    true_pixels, own_pixels = int(np.count_nonzero(objects)), int(np.count_nonzero(regions))
    if not true_pixels:
        return None
    if not own_pixels:
        return 0.0
    # Numbers from 1 for the pairs, the same for a segment as for its region.
    of_true = _numbered(segments, objects, assigned.segments)
    of_own = _numbered(labels, regions, assigned.regions)
    reach = tolerance(*segments.shape)
    recall = _count_near(of_true, of_own, reach) / true_pixels
    precision = _count_near(of_own, of_true, reach) / own_pixels
    return harmonic_mean(precision, recall)


def _numbered(labels: LabelArray, edge: BoolArray, order: LabelArray) -> IntArray:
    """Return on the pixels of an edge the place of their label in `order`, from 1; 0 elsewhere and for other labels."""
    found = np.zeros(labels.shape, np.int64)
    if len(order):
        sorter = np.argsort(order)
        at = np.minimum(np.searchsorted(order, labels[edge], sorter=sorter), len(order) - 1)
        found[edge] = np.where(order[sorter[at]] == labels[edge], sorter[at] + 1, 0)
    return found


def _count_near(wanted: IntArray, given: IntArray, reach: int) -> int:
    """Count the pixels with a number that have the same number in `given` within a disk of radius `reach`."""
    rows, columns = np.nonzero(wanted)
    number, found = wanted[rows, columns], np.zeros(len(rows), np.bool_)
    padded = np.pad(given, reach)
    for down in range(-reach, reach + 1):
        side = math.isqrt(reach * reach - down * down)
        for right in range(-side, side + 1):
            found |= padded[rows + reach + down, columns + reach + right] == number
    return int(np.count_nonzero(found))
