# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A furnished room: a desk with things on it, chairs, a cabinet, a sofa, boxes on the floor."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.offline.simulation.hollow import Compound
from topo_region_seg.offline.simulation.scene import Body, Paint, Scene
from topo_region_seg.offline.simulation.shapes import Box, Cylinder, Shape
from topo_region_seg.offline.simulation.tabletop import COLORS
from topo_region_seg.offline.simulation.vessels import bottle, mug

EYE = (-2.3, 0.6, 1.5)
TARGET = (0.6, -0.1, 0.6)
FRONT, SIDE = 1.6, 1.7
"""Where the walls in front and beside are, metres."""
DESK = 0.73


def room(seed: int) -> Scene:
    """Return a room whose floor and walls are background; each piece of furniture and each thing is an object."""
    rng = np.random.default_rng(seed)
    floor = Body(Box((8.0, 8.0, 0.1)), Paint((120, 104, 88)), (0.0, 0.0, -0.05))
    front = Body(Box((0.1, 8.0, 2.8)), Paint((214, 212, 204)), (FRONT + 0.05, 0.0, 1.4))
    sides = [Body(Box((8.0, 0.1, 2.8)), Paint((206, 210, 212)), (0.0, side * (SIDE + 0.05), 1.4)) for side in (-1, 1)]
    placed: list[tuple[Shape, float, float, float, float]] = []  # shape, x, y, bottom, yaw
    y = rng.uniform(-0.5, 0.3)
    x = FRONT - 0.42
    placed.append((desk(0.7, 1.4), x, y, 0.0, 0.0))
    placed.append((monitor(rng.uniform(0.45, 0.6)), x + 0.15, y + rng.uniform(-0.3, 0.3), DESK, 0.0))
    for number in range(3):
        spot = x - 0.18 + rng.uniform(-0.08, 0.08), y - 0.5 + 0.5 * number + rng.uniform(-0.1, 0.1)
        placed.append((_on_desk(rng), *spot, DESK, rng.uniform(0.0, math.pi)))
    placed.append((chair(), x - 0.7, y + rng.uniform(-0.3, 0.3), 0.0, math.pi + rng.uniform(-0.5, 0.5)))
    placed.append((Box((0.45, 0.8, rng.uniform(0.8, 1.6))), FRONT - 0.24, SIDE - 0.45, 0.0, 0.0))
    if rng.random() < 0.6:
        placed.append((sofa(), rng.uniform(-1.1, -0.75), -SIDE + 0.55, 0.0, math.pi / 2))
    for place in (-0.9, -0.15):
        size = rng.uniform(0.25, 0.45, 3)
        x, y = place + rng.uniform(0.0, 0.05), rng.uniform(0.8, 1.2)
        yaw = rng.uniform(0.0, math.pi)
        placed.append((Box((size[0], size[1], size[2])), x, y, 0.0, yaw))
        if rng.random() < 0.5:
            small = Box((0.6 * size[0], 0.7 * size[1], 0.2))
            placed.append((small, x, y, size[2], yaw + rng.uniform(-0.2, 0.2)))
            break
    objects = [
        Body(shape, Paint(COLORS[(number + seed) % len(COLORS)]), (x, y, bottom + shape.half_height), yaw=yaw)
        for number, (shape, x, y, bottom, yaw) in enumerate(placed)
    ]
    return Scene((floor, front, *sides), tuple(objects))


def desk(deep: float, wide: float) -> Shape:
    """Return a board on four legs; its height is DESK."""
    board = (Box((deep, wide, 0.03)), (0.0, 0.0, DESK / 2 - 0.015))
    legs = [
        (Box((0.05, 0.05, DESK - 0.03)), (a * (deep / 2 - 0.05), b * (wide / 2 - 0.05), -0.015))
        for a in (-1, 1)
        for b in (-1, 1)
    ]
    return Compound((board, *legs))


def chair() -> Shape:
    """Return a chair, 0.9 m high, whose back is at -x."""
    seat = (Box((0.44, 0.44, 0.04)), (0.0, 0.0, 0.0))
    back = (Box((0.03, 0.44, 0.45)), (-0.2, 0.0, 0.225))
    legs = [(Box((0.04, 0.04, 0.45)), (a * 0.19, b * 0.19, -0.225)) for a in (-1, 1) for b in (-1, 1)]
    return Compound((seat, back, *legs))


def sofa() -> Shape:
    """Return a sofa, 0.8 m high, whose back is at -x."""
    seat = (Box((0.8, 1.5, 0.42)), (0.0, 0.0, -0.19))
    back = (Box((0.22, 1.5, 0.8)), (-0.4, 0.0, 0.0))
    arms = [(Box((0.8, 0.18, 0.6)), (0.0, side * 0.8, -0.1)) for side in (-1, 1)]
    return Compound((seat, back, *arms))


def monitor(wide: float) -> Shape:
    """Return a screen on a foot."""
    high, stand = 0.6 * wide, 0.1
    total = high + stand
    screen = (Box((0.03, wide, high)), (0.0, 0.0, (total - high) / 2))
    post = (Box((0.03, 0.06, stand)), (0.02, 0.0, (stand - total) / 2))
    foot = (Box((0.18, 0.24, 0.012)), (0.0, 0.0, 0.006 - total / 2))
    return Compound((screen, post, foot))


def _on_desk(rng: np.random.Generator) -> Shape:
    kind = rng.choice(4)
    if kind == 0:
        return mug(0.04, 0.1)
    if kind == 1:
        return bottle(0.035, 0.24)
    if kind == 2:
        return Cylinder(0.05, rng.uniform(0.1, 0.18))
    return Box((rng.uniform(0.15, 0.22), rng.uniform(0.2, 0.28), rng.uniform(0.03, 0.12)))
