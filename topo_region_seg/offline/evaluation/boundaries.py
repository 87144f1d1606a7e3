# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Boundary recall and precision on the image grid of an organized cloud.

A pixel is on a boundary if one of its four neighbors has another label and both are valid: the end of the depth data
is not a boundary of the segmentation. A boundary pixel is found if the other boundary passes through the square of
5 x 5 pixels around it, which means at most 2 pixels away.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter

from topo_region_seg.data import BoolArray, LabelArray

TOLERANCE = 2
"""Pixels."""


def boundary_recall(segments: LabelArray, labels: LabelArray, valid: BoolArray) -> float | None:
    """Return the share of the true boundary that is within 2 pixels of that of the regions; None without one.

    Parameters
    ----------
    segments : (H, W) uint32
        True segments; 0 = not on an object.
    labels : (H, W) uint32
        Regions; 0 = none.
    valid : (H, W) bool
        Pixels with a finite position.
    """
    return _found(boundary(segments, valid), boundary(labels, valid))


def boundary_precision(segments: LabelArray, labels: LabelArray, valid: BoolArray) -> float | None:
    """Return the share of the regions' boundary that is within 2 pixels of the true one; None without one.

    The parameters are those of :func:`boundary_recall`.
    """
    return _found(boundary(labels, valid), boundary(segments, valid))


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


def _found(wanted: BoolArray, given: BoolArray) -> float | None:
    count = int(np.count_nonzero(wanted))
    if not count:
        return None
    near = maximum_filter(given, size=2 * TOLERANCE + 1, mode="constant", cval=False)
    return int(np.count_nonzero(wanted & near)) / count
