# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures that change with the depth, as tables that kernels read."""

from __future__ import annotations

from typing import NamedTuple

from topo_region_seg.compiled.dialect import inlined
from topo_region_seg.data import FloatArray

KNOTS = 64
"""Entries of a table."""


class DepthTable(NamedTuple):
    """A figure at depths evenly spaced from `near` on: `value` (KNOTS,), with `density` entries a metre."""

    near: float
    density: float
    value: FloatArray


@inlined
def at_depth(table, depth):  # type: ignore[no-untyped-def]
    """Return the figure at a depth, metres, between the two nearest entries; at the ends, that of the last."""
    place = min(max((depth - table.near) * table.density, 0.0), KNOTS - 1.0)
    below = min(int(place), KNOTS - 2)
    share = place - below
    return table.value[below] * (1.0 - share) + table.value[below + 1] * share
