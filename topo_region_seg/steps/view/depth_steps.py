# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""In what steps a sensor tells depths: the millimetres of a driver or a file, or those of a disparity, by depth.

Where depths come in steps, far more pixels than there are steps share the same few depths. Steps are then the gaps
between these; of depths without steps hardly any two are the same.
"""

from __future__ import annotations

import numpy as np

from topo_region_seg.data import FloatArray
from topo_region_seg.steps.view.grid import Single

PIXELS = 30_000
"""About how many pixels are looked at."""
BINS, FEWEST = 6, 100
"""Depths at which the step is told, each from as many pixels, and how many these are at the least."""
SAME = 5e-6
"""Difference of depths, metres, up to which they are the same: clouds in another frame are rounded."""
SHARED = 3.0
"""Pixels with the same depth, on the mean, from which on depths come in steps."""
GAPS = 3
"""Gaps that tell a step."""
USUAL = 0.5
"""How far, as a share of the median gap, a gap may be from it: larger ones span depths at which nothing was seen."""


def depth_steps(depth: Single) -> tuple[FloatArray, FloatArray]:
    """Return depths (BINS,) in order and the step in which depths come there, metres; NaN where it cannot be told.

    Parameters
    ----------
    depth : (P,) float32
        Depths of the pixels, metres; NaN where there is none.
    """
    # An odd stride, which meets columns of all numbers.
    some = depth[:: max(1, len(depth) // PIXELS) | 1]
    ranked = np.sort(some[np.isfinite(some)]).astype(np.float64)
    at, step = np.full(BINS, np.nan), np.full(BINS, np.nan)
    for number, part in enumerate(np.array_split(ranked, BINS)):
        if len(part) < FEWEST:
            continue
        at[number] = part[len(part) // 2]
        gap = np.diff(part)
        place = np.flatnonzero(gap > SAME)
        if len(place) < GAPS or len(part) < SHARED * (len(place) + 1):
            continue
        gap = gap[place]
        usual = np.abs(gap - np.median(gap)) <= USUAL * np.median(gap)
        # The mean, as a disparity that was rounded to millimetres has gaps of 2 and of 3. Its depth is that of the
        # usual gaps: a bin may reach across the edge of a table.
        at[number], step[number] = part[place[usual]].mean(), gap[usual].mean()
    return at, step
