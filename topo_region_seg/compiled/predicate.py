# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The homogeneity predicate P(i, j) of two points (paper, section IV.C, equations (5) and (6)), for several steps."""

from __future__ import annotations

from typing import NamedTuple

from topo_region_seg.compiled.dialect import index, inlined

CHANNELS = 9


class Criterion(NamedTuple):
    """Squared limits: an edge needs d2 <= reach and its color and chord differences within [low, high]."""

    reach: float
    color_low: float
    color_high: float
    chord_low: float
    chord_high: float


@inlined
def edge_length(points, limits, a, b):  # type: ignore[no-untyped-def]
    """Return the squared length of the edge between two points; -1 where the criterion does not hold."""
    p, q = index(a), index(b)
    dx, dy, dz = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1], points[q, 2] - points[p, 2]
    dl, da, db = points[q, 3] - points[p, 3], points[q, 4] - points[p, 4], points[q, 5] - points[p, 5]
    du, dv, dw = points[q, 6] - points[p, 6], points[q, 7] - points[p, 7], points[q, 8] - points[p, 8]
    d2 = dx * dx + dy * dy + dz * dz
    color = dl * dl + da * da + db * db  # the square of the paper's equation (5)
    chord = du * du + dv * dv + dw * dw  # grows with the angle of equation (6)
    alike = (d2 <= limits.reach) & (color <= limits.color_high) & (color >= limits.color_low)
    # Negated, so that the NaN of a missing normal passes.
    aligned = not ((chord > limits.chord_high) | (chord < limits.chord_low))
    return d2 if alike & aligned else -1.0
