# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How the lengths of objects follow from the spacing and the noise of a frame."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.dialect import inlined
from topo_region_seg.data import FloatArray
from topo_region_seg.params import Params
from topo_region_seg.steps.view.camera import evened
from topo_region_seg.steps.view.model import SensorModel
from topo_region_seg.steps.view.scene import FREE, Scene

LEAST, MOST = 0.7, 4.0
"""How many times as long as by default lengths are at the least and at the most."""
NORMAL_ERROR = math.radians(2.0)
"""Angle by which noise may turn a normal: half of the angle between normals that are joined."""
FINEST = 0.0014
"""Spacing, metres, below which points tell nothing new: sensors smooth over a few pixels."""
GROWING = ("object_normal_radius", "object_border_radius")
"""The parameters that say how long lengths are: where one of them was set, all are as given."""


class Lengths(NamedTuple):
    """How many times as long lengths are at a depth: ``clip(growth * depth, least, most)``."""

    growth: float
    least: float
    most: float


AS_GIVEN = Lengths(0.0, 1.0, 1.0)
"""Lengths that are the same at every depth."""
ALIKE = 1.02
"""Ratio of lengths up to which they are alike."""


def lengths_of(scene: Scene, params: Params) -> Lengths:
    """Return how lengths grow in a scene; as given, where one of them was set.

    Noise then turns normals by less than `NORMAL_ERROR` at the median depth of what may be things. A plane through n
    points of noise s, in a disk of radius r, is turned by 2 s / (r sqrt(n)), where n = pi (r / spacing)^2.
    """
    if any(params.differs(name) for name in GROWING):
        return AS_GIVEN
    middle = middle_of(scene)
    spacing = max(scene.model.pixel * middle, FINEST)
    noise = float(scene.model.noise_at(np.float64(middle)))
    radius = math.sqrt(2.0 / math.sqrt(math.pi) * noise * spacing / NORMAL_ERROR)
    return Lengths(radius / params.object_normal_radius / middle, LEAST, MOST)


def middle_of(scene: Scene) -> float:
    """Return the median depth of what may be things, metres; of the whole frame if there is nothing."""
    depth = scene.grid.depth[::3][scene.classes[::3] == FREE]
    return float(np.median(depth)) if len(depth) else scene.model.middle


def scales(lengths: Lengths, depth: FloatArray) -> FloatArray:
    """Return how many times as long lengths are at depths (N,), metres."""
    found: FloatArray = np.clip(lengths.growth * depth, lengths.least, lengths.most)
    return found


def pixels_of(length: float, lengths: Lengths, model: SensorModel, depth: float) -> float:
    """Return how many pixels wide a length, metres, is at a depth, metres."""
    return length * float(scales(lengths, np.float64(depth))) / (model.pixel * depth)


def local_positions(xyz: FloatArray, axes: FloatArray, lengths: Lengths) -> FloatArray:
    """Return positions (N, 3), metres, in coordinates in which lengths are what they say; `axes` are the camera's."""
    depth = xyz @ axes[2]
    scale = scales(lengths, depth)
    least = float(np.min(scale, initial=lengths.most))
    if float(np.max(scale, initial=0.0)) < ALIKE * least:
        return xyz / least
    return evened(xyz / least, axes, float(depth[scale <= ALIKE * least].max()) / least)


@inlined
def scale_at(lengths, depth):  # type: ignore[no-untyped-def]
    """Return how many times as long lengths are at a depth, metres."""
    return min(max(lengths.growth * depth, lengths.least), lengths.most)
