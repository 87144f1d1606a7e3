# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Random tabletop scenes: boxes, some stacked, cylinders and balls on a table in a room."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.offline.simulation.camera import TABLE_CENTER
from topo_region_seg.offline.simulation.scene import Body, Color, Paint, Scene
from topo_region_seg.offline.simulation.shapes import Box, Cylinder, Shape, Sphere

TABLE_SIZE = (0.9, 1.3, 0.04)
COLORS: tuple[Color, ...] = (
    (196, 60, 52),
    (52, 110, 190),
    (240, 196, 70),
    (70, 150, 80),
    (228, 228, 222),
    (230, 128, 46),
    (128, 82, 158),
    (70, 178, 186),
    (150, 100, 66),
    (214, 130, 160),
)
_REACH = (0.26, 0.38)  # objects stand within these distances from the middle of the table along x and y
_GAP = 0.02


def tabletop(seed: int, objects: int = 8) -> Scene:
    """Return a scene with up to `objects` objects; the same seed gives the same scene.

    The table's top is centered at ``camera.TABLE_CENTER``. About every third box carries another, smaller one, and
    every fourth object has a printed band. Objects without a free place are left out.
    """
    rng = np.random.default_rng(seed)
    colors = [COLORS[i] for i in rng.permutation(len(COLORS))]
    placed: list[Body] = []
    footprints: list[tuple[float, float, float]] = []
    while len(placed) < objects:
        shape = _shape(rng)
        spot = _free_spot(rng, shape, footprints)
        if spot is None:
            break
        x, y = spot
        footprints.append((x, y, _footprint(shape)))
        bottom = TABLE_CENTER[2]
        lower = _stand(rng, shape, x, y, bottom, _paint(rng, colors, len(placed)))
        placed.append(lower)
        if isinstance(shape, Box) and len(placed) < objects and rng.random() < 0.4:
            a, b, c = shape.size
            upper = Box((a * rng.uniform(0.5, 0.8), b * rng.uniform(0.5, 0.8), rng.uniform(0.04, 0.09)))
            placed.append(_stand(rng, upper, x, y, bottom + c, _paint(rng, colors, len(placed)), lower.yaw))
    return Scene(room_of_table(), tuple(placed))


def room_of_table() -> tuple[Body, ...]:
    """Return table top, floor, wall and table leg, which get the truth labels 1 to 4."""
    top = Body(Box(TABLE_SIZE), Paint((176, 152, 120)), (0.0, 0.0, TABLE_CENTER[2] - TABLE_SIZE[2] / 2))
    floor = Body(Box((6.0, 6.0, 0.1)), Paint((108, 110, 114)), (0.0, 0.0, -0.05))
    wall = Body(Box((0.1, 6.0, 3.0)), Paint((214, 212, 204)), (2.2, 0.0, 1.5))
    leg_height = TABLE_CENTER[2] - TABLE_SIZE[2]
    leg = Body(Box((0.3, 0.5, leg_height)), Paint((90, 84, 78)), (0.0, 0.0, leg_height / 2))
    return top, floor, wall, leg


def _shape(rng: np.random.Generator) -> Shape:
    kind = rng.choice(3, p=(0.55, 0.3, 0.15))
    if kind == 0:
        return Box((rng.uniform(0.06, 0.16), rng.uniform(0.08, 0.2), rng.uniform(0.06, 0.2)))
    if kind == 1:
        return Cylinder(rng.uniform(0.03, 0.05), rng.uniform(0.09, 0.2))
    return Sphere(rng.uniform(0.04, 0.07))


def _footprint(shape: Shape) -> float:
    """Return the radius of a circle around the area of the table that the shape covers, metres."""
    if isinstance(shape, Box):
        return math.hypot(shape.size[0], shape.size[1]) / 2
    return shape.radius if isinstance(shape, Cylinder | Sphere) else shape.bounding_radius


def _free_spot(
    rng: np.random.Generator, shape: Shape, footprints: list[tuple[float, float, float]]
) -> tuple[float, float] | None:
    radius = _footprint(shape)
    for _ in range(200):
        x, y = rng.uniform(-_REACH[0], _REACH[0]), rng.uniform(-_REACH[1], _REACH[1])
        if all(math.hypot(x - a, y - b) > radius + r + _GAP for a, b, r in footprints):
            return x, y
    return None


def _paint(rng: np.random.Generator, colors: list[Color], number: int) -> Paint:
    color = colors[number % len(colors)]
    if rng.random() < 0.25:
        return Paint(color, band=colors[(number + len(colors) // 2) % len(colors)])
    return Paint(color)


def _stand(
    rng: np.random.Generator,
    shape: Shape,
    x: float,
    y: float,
    bottom: float,
    paint: Paint,
    yaw: float | None = None,
) -> Body:
    """Place the shape at height `bottom`, rotated at random or, on top of another shape, roughly like that one."""
    turn = rng.uniform(0.0, math.pi) if yaw is None else yaw + rng.uniform(-0.2, 0.2)
    return Body(shape, paint, (x, y, bottom + shape.half_height), yaw=turn)
