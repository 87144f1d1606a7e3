# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The largest scale of a filtration that has at least so many regions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from topo_region_seg.compiled.order import order_of
from topo_region_seg.data import Components, FloatArray, IntArray
from topo_region_seg.steps.scales.counts import region_counts


def scale_with_kept_regions(components: Components, weight: IntArray, min_size: int, regions: int) -> float:
    """Return the largest scale, metres, with at least so many components that are not small; else that with most."""
    radius, large, _ = _candidates(components, weight, min_size)
    enough = np.flatnonzero(large >= regions)
    return float(radius[enough[-1] if len(enough) else np.flatnonzero(large == np.max(large))[-1]])


def scale_with_merged_regions(
    components: Components, weight: IntArray, min_size: int, regions: int, count_at: Callable[[float], int]
) -> float:
    """Return a scale, metres, with at least so many regions once small ones are merged.

    Merging makes regions of small ones too; how many, only doing it can tell: `count_at` does so for a scale, metres.
    The scale is searched down from the largest in growing steps and by halving.
    """
    radius, large, most = _candidates(components, weight, min_size)
    sure, possible = np.flatnonzero(large >= regions), np.flatnonzero(most >= regions)
    low = int(sure[-1]) if len(sure) else 0
    high = int(possible[-1]) if len(possible) else len(radius) - 1
    found: dict[int, int] = {}

    def enough_at(place: int) -> bool:
        found[place] = count_at(float(radius[place]))
        return found[place] >= regions

    place, above, step = high, high + 1, 1
    while not (len(sure) and place == low) and not enough_at(place):
        if place == low:
            return float(radius[max(found, key=lambda one: (found[one], one))])
        above, place, step = place, max(high - step, low), 2 * step
    while above - place > 1:
        middle = (place + above) // 2
        if enough_at(middle):
            place = middle
        else:
            above = middle
    return float(radius[place])


def _candidates(components: Components, weight: IntArray, min_size: int) -> tuple[FloatArray, IntArray, IntArray]:
    """Return, for all scales that differ, the largest of those alike, and the least and largest count of regions.

    All are (K,), the smallest scale first; the least count is that of components that are not small.
    """
    order, death = deaths_in_order(components), components.death
    large, rest = region_counts(components.parent, order, weight, min_size)
    radius = np.append(np.nextafter(death[order], 0.0), components.max_radius)
    # Deaths at one scale come together, and those at 0, where points coincide, before every scale.
    whole = (radius > 0.0) & (radius >= np.append(0.0, death[order]))
    return radius[whole], large[whole], np.maximum(large + rest // min_size, 1)[whole]


def deaths_in_order(components: Components) -> IntArray:
    """Return the points that die, (D,), the first to die first."""
    dying = np.flatnonzero(np.isfinite(components.death))
    return dying[order_of(components.death[dying])]
