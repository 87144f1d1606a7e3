# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How long the regions at each scale of a filtration stay the same."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray, IntArray


@kernel
def stability(
    parent: IntArray, order: IntArray, death: FloatArray, weight: IntArray, min_size: int, same: float, first: float
) -> FloatArray:
    """Return how long regions stay the same, after each death: the mean over the points, as a logarithm; (D + 1,).

    A region is a component of at least `min_size`. It stays the same from the scale at which it arose, or `first`
    if that is larger, until it joins another and is less than the share `same` of what becomes of both. A point
    without a region counts as 0.

    Parameters
    ----------
    parent : (N,) int64
        Parents in the merge tree.
    order : (D,) int64
        The points that die, first to die first. Between deaths at the same scale the result means nothing.
    death : (N,) float64
        Their scales, metres; for all others the end of the filtration.
    weight : (N,) int64
        How many input points each point stands for.
    min_size : int
        Fewest input points of a region.
    same : float
        From 0.5 to 1.
    first : float
        Least scale that counts, metres, above 0.
    """
    n = len(parent)
    last, points = first, 0
    for point in range(n):
        last = max(last, death[point])
        points += weight[point]
    lasted = np.empty(n + len(order))  # of each region, as a logarithm
    begun = np.empty(n + len(order))
    means = np.empty(len(order) + 1)
    # How long a region lasts is known when it ends, so that the deaths are gone through twice.
    for summing in (False, True):
        size = weight.copy()
        region = np.full(n, -1)
        regions, total = 0, 0.0
        for point in range(n):
            if size[point] >= min_size:
                region[point] = regions
                if summing:
                    total += size[point] * lasted[regions]
                else:
                    begun[regions], lasted[regions] = first, math.log(last / first)
                regions += 1
        means[0] = total
        for place in range(len(order)):
            young = order[place]
            old = parent[young]
            scale = max(death[young], first)
            large, small = (young, old) if size[young] > size[old] else (old, young)
            both = size[large] + size[small]
            one, other = region[large], region[small]
            if summing:
                total -= size[large] * lasted[one] if one >= 0 else 0.0
                total -= size[small] * lasted[other] if other >= 0 else 0.0
            elif other >= 0:
                lasted[other] = math.log(scale / begun[other])
            if other >= 0 and size[large] < same * both:
                if not summing:
                    lasted[one] = math.log(scale / begun[one])
                one = -1
            if one < 0 and both >= min_size:
                one = regions
                regions += 1
                if not summing:
                    begun[one], lasted[one] = scale, math.log(last / scale)
            size[old], region[old] = both, one
            if summing:
                total += both * lasted[one] if one >= 0 else 0.0
                means[place + 1] = total
    for place in range(len(means)):
        means[place] /= max(points, 1)
    return means
