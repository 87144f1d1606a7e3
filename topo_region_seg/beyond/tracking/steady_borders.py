# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Borders between regions at rest: noise gives their points to the one side or the other from frame to frame."""

from __future__ import annotations

import numpy as np

from topo_region_seg.data import BoolArray, FloatArray, IntArray

STILL = 0.005
"""Farthest way of a region's center from frame to frame for the region to be at rest, metres."""


def settled_labels(region: IntArray, before: IntArray, xyz: FloatArray, center: FloatArray) -> IntArray:
    """Return the former label (R,) that each region at rest goes on with; 0 where there is none.

    A region goes on with a label if most of its known points had it, and most of those that had it are in the region.

    Parameters
    ----------
    region : (N,) int64
        Region of each point, counted from 0; -1 for none.
    before : (N,) int64
        Label of the point in the frame before; 0 = none.
    xyz : (N, 3) float64
        Positions, metres.
    center : (L, 3) float64
        Where the center of the region of each label was; NaN where there was none.
    """
    n_regions, width = int(np.max(region, initial=-1)) + 1, len(center)
    inside = region >= 0
    pairs = region[inside] * width + before[inside]
    common = np.bincount(pairs, minlength=n_regions * width).reshape(n_regions, width)
    common[:, 0] = 0
    label = np.argmax(common, axis=1)
    home = np.argmax(common, axis=0)
    now = centers(region + 1, xyz, n_regions + 1)[1:]
    way = np.linalg.norm(now - center[label], axis=1)
    mutual = (home[label] == np.arange(n_regions)) & (common[np.arange(n_regions), label] > 0)
    return np.where(mutual & (way <= STILL), label, 0)


def centers(label: IntArray, xyz: FloatArray, n: int) -> FloatArray:
    """Return the mean position (n, 3) of the points (N, 3) with each label; NaN where there is none."""
    count = np.bincount(label, minlength=n)
    sums = np.column_stack([np.bincount(label, xyz[:, axis], n) for axis in range(3)])
    middle: FloatArray = np.full((n, 3), np.nan)
    np.divide(sums, count[:, None], out=middle, where=count[:, None] > 0)
    return middle


def with_steady_borders(region: IntArray, before: IntArray, label: IntArray, hold: BoolArray) -> IntArray:
    """Return the regions (N,) with the points to `hold` (N,) in the region at rest that had them in the frame before.

    `label` (R,) is what `settled_labels` returns. Points stay where they are unless both regions are at rest.
    """
    settled = np.flatnonzero(label)
    home = np.full(max(int(np.max(label, initial=0)), int(np.max(before, initial=0))) + 1, -1)
    home[label[settled]] = settled
    back = home[before]
    own = np.append(label, 0)[region]
    return np.where(hold & (back >= 0) & (own > 0), back, region)
