# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A table with hollow things: mugs with handles, bowls, pots, trays, and bottles with necks."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from topo_region_seg.offline.simulation.camera import TABLE_CENTER
from topo_region_seg.offline.simulation.hollow import Compound, Cup
from topo_region_seg.offline.simulation.scene import Body, Paint, Scene
from topo_region_seg.offline.simulation.shapes import Box, Cylinder, Shape
from topo_region_seg.offline.simulation.tabletop import COLORS, room_of_table

_PLACES = tuple(product((-0.22, 0.0, 0.22), (-0.3, 0.0, 0.3)))


def vessels(seed: int, things: int = 7) -> Scene:
    """Return a table with up to nine vessels on a grid of places, each turned and moved a little."""
    rng = np.random.default_rng(seed)
    bodies = []
    for number, place in enumerate(rng.permutation(len(_PLACES))[:things]):
        x, y = np.add(_PLACES[place], rng.uniform(-0.025, 0.025, 2)).tolist()
        shape = _vessel(rng)
        paint = Paint(COLORS[(number + seed) % len(COLORS)])
        position = (x, y, TABLE_CENTER[2] + shape.half_height)
        bodies.append(Body(shape, paint, position, yaw=rng.uniform(0.0, 2 * math.pi)))
    return Scene(room_of_table(), tuple(bodies))


def mug(radius: float, height: float) -> Shape:
    """Return a cup with a square handle."""
    thick, reach, tall = 0.01, 0.03, 0.55 * height
    out = radius + reach / 2 - 0.002
    bars = [(Box((reach, thick, thick)), (out, 0.0, side * (tall - thick) / 2)) for side in (-1, 1)]
    grip = (Box((thick, thick, tall)), (radius + reach, 0.0, 0.0))
    return Compound(((Cup(radius, height), (0.0, 0.0, 0.0)), *bars, grip))


def bottle(radius: float, height: float) -> Shape:
    """Return a cylinder with a neck, whose origin is in the middle of its height."""
    body, neck = 0.7 * height, 0.3 * height
    return Compound(
        (
            (Cylinder(radius, body), (0.0, 0.0, (body - height) / 2)),
            (Cylinder(0.4 * radius, neck), (0.0, 0.0, (height - neck) / 2)),
        )
    )


def tray(length: float, width: float, height: float) -> Shape:
    """Return an open box."""
    w = 0.006
    ends = [(Box((w, width, height)), (side * (length - w) / 2, 0.0, 0.0)) for side in (-1, 1)]
    sides = [(Box((length - 2 * w, w, height)), (0.0, side * (width - w) / 2, 0.0)) for side in (-1, 1)]
    return Compound(((Box((length, width, w)), (0.0, 0.0, (w - height) / 2)), *ends, *sides))


def _vessel(rng: np.random.Generator) -> Shape:
    kind = rng.choice(5, p=(0.35, 0.2, 0.15, 0.15, 0.15))
    if kind == 0:
        return mug(rng.uniform(0.036, 0.046), rng.uniform(0.08, 0.11))
    if kind == 1:
        return Cup(rng.uniform(0.06, 0.085), rng.uniform(0.045, 0.07))
    if kind == 2:
        return Cup(rng.uniform(0.07, 0.09), rng.uniform(0.1, 0.16))
    if kind == 3:
        return bottle(rng.uniform(0.03, 0.04), rng.uniform(0.2, 0.26))
    return tray(rng.uniform(0.14, 0.2), rng.uniform(0.1, 0.14), rng.uniform(0.03, 0.06))
