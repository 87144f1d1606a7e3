# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The scale whose regions stay the same for longest."""

from __future__ import annotations

import numpy as np

from topo_region_seg.beyond.auto_scale.stability import stability
from topo_region_seg.data import Components, IntArray
from topo_region_seg.growth import FEWEST_SPACINGS, REFERENCE_SPACING
from topo_region_seg.steps.scales.search import deaths_in_order

SAME = 0.8
"""Share of what becomes of it and another that a region must be to count as still the same. Less would let regions of
like size pass for one of them, more would end a region with every bit that it gains."""


def stable_scale(components: Components, weight: IntArray, min_region_size: int) -> float:
    """Return the scale whose regions stay the same for longest, as a ratio of scales, in the mean over the points.

    It lies between FEWEST_SPACINGS and the end of the filtration, metres. This is the gap that ToMATo looks for in a
    barcode (Chazal, Guibas, Oudot and Skraba, Persistence-based clustering in Riemannian manifolds, 2013), but for
    each region: in a cloud of many things two of them join at nearly every scale.

    Parameters
    ----------
    components : Components
        The whole filtration.
    weight : (N,) int64
        How many input points each point stands for.
    min_region_size : int
        Fewest input points of a region.
    """
    death, order = components.death, deaths_in_order(components)
    least, last = FEWEST_SPACINGS * REFERENCE_SPACING, components.max_radius
    capped = np.minimum(death, last)
    lasting = stability(components.parent, order, capped, weight, min_region_size, SAME, least)
    begins = np.maximum(np.append(least, death[order]), least)
    ends = np.append(begins[1:], last)
    places = np.flatnonzero(ends > begins)
    best = places[np.argmax(lasting[places])]
    return float(np.sqrt(begins[best] * ends[best]))
