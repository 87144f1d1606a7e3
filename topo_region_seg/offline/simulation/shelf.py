# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A shelf against a wall, with things in a row on each board."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.offline.simulation.camera import TABLE_CENTER
from topo_region_seg.offline.simulation.hollow import Compound, Cup
from topo_region_seg.offline.simulation.scene import Body, Paint, Scene
from topo_region_seg.offline.simulation.shapes import Box, Cylinder, Shape
from topo_region_seg.offline.simulation.tabletop import COLORS
from topo_region_seg.offline.simulation.vessels import bottle

WIDTH, DEPTH, BOARD = 0.8, 0.32, 0.02
HEIGHTS = (-0.36, 0.0, 0.36)
"""Of the upper sides of the boards, about the middle of the shelf."""
_GAP = 0.015


def shelf(seed: int) -> Scene:
    """Return a shelf of two open compartments; boards, sides, back, wall and floor are background."""
    rng = np.random.default_rng(seed)
    x, y, z = TABLE_CENTER
    x += 0.25
    boards = [(Box((DEPTH, WIDTH, BOARD)), (0.0, 0.0, height - BOARD / 2)) for height in HEIGHTS]
    tall = HEIGHTS[-1] - HEIGHTS[0] + BOARD
    sides = [(Box((DEPTH, BOARD, tall)), (0.0, side * (WIDTH + BOARD) / 2, -BOARD / 2)) for side in (-1, 1)]
    back = (Box((BOARD, WIDTH, tall)), ((DEPTH + BOARD) / 2, 0.0, -BOARD / 2))
    furniture = Body(Compound((*boards, *sides, back)), Paint((186, 170, 140)), (x, y, z))
    wall = Body(Box((0.1, 6.0, 3.0)), Paint((214, 212, 204)), (x + DEPTH / 2 + BOARD + 0.07, 0.0, 1.5))
    floor = Body(Box((6.0, 6.0, 0.1)), Paint((108, 110, 114)), (0.0, 0.0, -0.05))
    things: list[Body] = []
    for height in HEIGHTS[:-1]:
        across = -WIDTH / 2
        while True:
            shape, half, deep = _thing(rng)
            across += _GAP * rng.uniform(0.1, 2.0) + half
            if across + half > WIDTH / 2:
                break
            behind = rng.uniform(-DEPTH / 2 + deep, DEPTH / 2 - deep) if rng.random() < 0.5 else -DEPTH / 2 + deep
            paint = Paint(COLORS[(len(things) + seed) % len(COLORS)])
            turn = rng.uniform(-0.1, 0.1) if isinstance(shape, Box) else rng.uniform(0.0, math.pi)
            things.append(Body(shape, paint, (x + behind, y + across, z + height + shape.half_height), yaw=turn))
            across += half + 0.1 * deep
    return Scene((furniture, wall, floor), tuple(things))


def _thing(rng: np.random.Generator) -> tuple[Shape, float, float]:
    """Return a shape, and half of what it takes of the board's width and depth, metres."""
    kind = rng.choice(4, p=(0.55, 0.2, 0.1, 0.15))
    if kind == 0:
        size = rng.uniform((0.08, 0.03, 0.1), (0.2, 0.14, 0.28))
        return Box((size[0], size[1], size[2])), size[1] / 2 + 0.1 * size[0] / 2, size[0] / 2 + 0.1 * size[1] / 2
    radius = rng.uniform(0.03, 0.05)
    if kind == 1:
        return Cylinder(radius, rng.uniform(0.1, 0.22)), radius, radius
    if kind == 2:
        return Cup(radius, rng.uniform(0.08, 0.12)), radius, radius
    return bottle(radius, rng.uniform(0.2, 0.3)), radius, radius
