# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How the lengths of objects follow from the noise of the frame."""

from __future__ import annotations

import math
from typing import NamedTuple

from topo_region_seg.compiled.dialect import inlined
from topo_region_seg.params import Params
from topo_region_seg.steps.view.model import SensorModel

LEAST, MOST = 0.7, 4.0
NORMAL_ERROR = 2.0
FINEST = 0.002


class Lengths(NamedTuple):
    """How many times as long lengths are at a depth: ``clip(growth * depth, least, most)``."""

    growth: float
    least: float
    most: float


def lengths_of(model: SensorModel, middle: float, params: Params) -> Lengths:
    """Return the lengths with which noise turns normals by less than `NORMAL_ERROR` at the depth `middle` (m)."""
    spacing = max(model.pixel * middle, FINEST * LEAST)
    noise = float(model.noise_at(middle))
    radius = math.sqrt(2.0 * noise * spacing / (1.77 * math.radians(NORMAL_ERROR)))
    return Lengths(radius / params.object_normal_radius / middle, LEAST, MOST)


@inlined
def scale_at(lengths, depth):  # type: ignore[no-untyped-def]
    """Return how many times as long lengths are at a depth, metres."""
    return min(max(lengths.growth * depth, lengths.least), lengths.most)
