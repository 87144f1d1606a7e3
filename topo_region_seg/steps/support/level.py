# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which planes can carry things where it is known which way is up: those that are level, seen from above."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.data import FloatArray

LEVEL = math.cos(math.radians(10.0))
"""Cosine of the angle from up within which the normal of a plane that carries things lies: mountings are a little off,
floors a little sloped."""
NEARLY_LEVEL = math.cos(math.radians(20.0))
"""The same for a plane through three noisy points."""
ANY_WAY = np.zeros(3)
"""Stands for up where it is not known."""


def is_level(normal: FloatArray, up: FloatArray | None) -> bool:
    """Return whether a plane, its normal (3,) towards the sensor, is level and seen from above; True without `up`."""
    return up is None or bool(normal @ up >= LEVEL)
