# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Borders between regions at rest: from frame to frame noise gives their points to one side or the other."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.beyond.tracking.overlap import common_points
from topo_region_seg.data import BoolArray, FloatArray, IntArray

MOSTLY = 0.5
"""Share of a region's points that must come from another one for it to be a part of that."""
STILL = 0.005
"""Largest movement of a region's center from frame to frame for the region to be at rest, metres."""
CAMERA_STILL = 0.002
"""Largest median of these movements for the camera to be at rest: where it moves slowly, regions near the middle of its
way seem to be, while their borders move over the pixels."""
ENOUGH = 3
"""Regions that tell the camera's motion from their own."""


def regions_at_rest(region: IntArray, before: IntArray, xyz: FloatArray, center: FloatArray) -> IntArray:
    """Return for each region (R,) the former row that it goes on with if it and the camera are at rest; else 0.

    A region goes on with another one if most of its known points were in that one, and most of those that were are in
    the region.

    Parameters
    ----------
    region : (N,) int64
        Region of each point, counted from 0; -1 for none.
    before : (N,) int64
        Row of the point in the table of the frame before, counted from 1; 0 = none.
    xyz : (N, 3) float64
        Positions, metres.
    center : (B + 1, 3) float64
        Where the center of each row was.
    """
    n_regions = int(np.max(region, initial=-1)) + 1
    common = common_points(region + 1, before)
    former = _with_most(common.now, common.before, common.count, n_regions) + 1
    home = _with_most(common.before, common.now, common.count, len(center) - 1)
    now = centers(region + 1, xyz, n_regions + 1)[1:]
    way = np.linalg.norm(now - center[former], axis=1)
    mutual = (former > 0) & (np.append(home, -1)[former - 1] == np.arange(n_regions))
    if np.count_nonzero(mutual) >= ENOUGH and float(np.median(way[mutual])) > CAMERA_STILL:
        return np.zeros(n_regions, np.int64)
    return np.where(mutual & (way <= STILL), former, 0)


def split_off(region: IntArray, before: IntArray, n_regions: int) -> tuple[IntArray, IntArray]:
    """Return for each region (R,) that is a part of a former one the region that has most of that; -1 for all others.

    A region is a part if most of its points come from the former one. The second result is the former rows, (R,), from
    1; 0 where most points come from none.
    """
    common = common_points(region + 1, before)
    size = np.bincount(region + 1, minlength=n_regions + 1)[1:]
    mostly = common.count >= MOSTLY * size[common.now]
    origin = np.zeros(n_regions, np.int64)
    origin[common.now[mostly]] = common.before[mostly] + 1
    home = _with_most(common.before, common.now, common.count, int(np.max(before, initial=0)))
    main = np.append(home, -1)[origin - 1]
    return np.where((origin > 0) & (main != np.arange(n_regions)), main, -1), origin


def centers(row: npt.NDArray[np.integer], xyz: FloatArray, n: int) -> FloatArray:
    """Return the mean position (n, 3) of the points (N, 3) of each row; NaN where there is none."""
    count = np.bincount(row, minlength=n)
    sums = np.column_stack([np.bincount(row, xyz[:, axis], n) for axis in range(3)])
    middle: FloatArray = np.full((n, 3), np.nan)
    np.divide(sums, count[:, None], out=middle, where=count[:, None] > 0)
    return middle


def with_steady_borders(region: IntArray, before: IntArray, former: IntArray, hold: BoolArray) -> IntArray:
    """Return the regions (N,) with the points to `hold` (N,) in the region at rest that had them in the frame before.

    `former` (R,) is what `regions_at_rest` returns. Points stay where they are unless both regions are at rest.
    """
    resting = np.flatnonzero(former)
    home = np.full(max(int(np.max(former, initial=0)), int(np.max(before, initial=0))) + 1, -1)
    home[former[resting]] = resting
    back = home[before]
    own = np.append(former, 0)[region]
    return np.where(hold & (back >= 0) & (own > 0), back, region)


def _with_most(one: IntArray, other: IntArray, count: IntArray, n: int) -> IntArray:
    """Return for each of n which `other` it has most in common with, the first of equals; -1 for none."""
    order = np.lexsort((-other, count, one))
    found = np.full(n, -1)
    found[one[order]] = other[order]
    return found
