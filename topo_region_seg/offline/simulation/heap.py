# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Things laid on one another over a rectangle: heaps on a table, and a bin full of them.

Nothing is simulated of mechanics: each thing comes to lie level on the highest below it, so some stick out over gaps.
"""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.data import BoolArray, FloatArray
from topo_region_seg.offline.simulation.camera import TABLE_CENTER
from topo_region_seg.offline.simulation.hollow import Compound, Cup
from topo_region_seg.offline.simulation.scene import Body, Color, Paint, Scene
from topo_region_seg.offline.simulation.shapes import Box, Cylinder, Shape, Sphere
from topo_region_seg.offline.simulation.tabletop import COLORS, room_of_table

CELL = 0.005
BIN_SIZE = (0.36, 0.5, 0.2)
BIN_WALL = 0.012


def clutter(seed: int, things: int = 14) -> Scene:
    """Return a table with things that touch, lean over and lie on one another."""
    rng = np.random.default_rng(seed)
    return Scene(room_of_table(), heap(rng, things, (0.22, 0.3), TABLE_CENTER[2]))


def full_bin(seed: int, things: int = 16) -> Scene:
    """Return an open bin on the table, full of things; its walls and bottom are background."""
    rng = np.random.default_rng(seed)
    x, y, z = BIN_SIZE
    w, bottom = BIN_WALL, TABLE_CENTER[2]
    walls = Compound(
        (
            (Box((x, y, w)), (0.0, 0.0, (w - z) / 2)),
            *((Box((w, y, z)), (side * (x - w) / 2, 0.0, 0.0)) for side in (-1, 1)),
            *((Box((x - 2 * w, w, z)), (0.0, side * (y - w) / 2, 0.0)) for side in (-1, 1)),
        )
    )
    body = Body(walls, Paint((88, 96, 112)), (0.0, 0.0, bottom + z / 2))
    inside = (x / 2 - w, y / 2 - w)
    return Scene((*room_of_table(), body), heap(rng, things, inside, bottom + w))


def heap(rng: np.random.Generator, things: int, half: tuple[float, float], ground: float) -> tuple[Body, ...]:
    """Return up to `things` bodies that lie within `half` (x, y; m) of the middle, the lowest on `ground` (m)."""
    top = np.full((math.ceil(2 * half[0] / CELL), math.ceil(2 * half[1] / CELL)), ground)
    placed: list[Body] = []
    for number in range(things):
        shape, lying = small_thing(rng)
        yaw = rng.uniform(0.0, math.pi)
        dx, dy, dz = _extents(shape, lying)
        c, s = abs(math.cos(yaw)), abs(math.sin(yaw))
        reach = (c * dx + s * dy, s * dx + c * dy)
        room = half[0] - reach[0], half[1] - reach[1]
        if min(room) <= 0:
            continue
        # Of some places the lowest, as things roll and slide.
        spots = [(rng.uniform(-room[0], room[0]), rng.uniform(-room[1], room[1])) for _ in range(4)]
        masks = [_footprint(top, half, spot, (dx, dy), yaw) for spot in spots]
        lowest = int(np.argmin([top[mask].max() for mask in masks]))
        (x, y), mask = spots[lowest], masks[lowest]
        z = float(top[mask].max())
        top[mask] = z + 2 * dz
        paint = Paint(_color(rng, number), grain=float(rng.choice((0.0, 12.0))))
        placed.append(Body(shape, paint, (x, y, z + dz), yaw=yaw, tilt=math.pi / 2 if lying else 0.0))
    return tuple(placed)


def small_thing(rng: np.random.Generator) -> tuple[Shape, bool]:
    """Return a shape that a hand can hold, and whether it lies on its side."""
    kind = rng.choice(5, p=(0.4, 0.2, 0.15, 0.1, 0.15))
    if kind == 0:
        a, b, c = sorted(rng.uniform((0.05, 0.04, 0.02), (0.16, 0.11, 0.07)), reverse=True)
        return Box((a, b, c)), False
    if kind == 1:
        return Cylinder(rng.uniform(0.02, 0.04), rng.uniform(0.08, 0.16)), bool(rng.random() < 0.6)
    if kind == 2:
        return Sphere(rng.uniform(0.025, 0.045)), False
    if kind == 3:
        return Cup(rng.uniform(0.035, 0.045), rng.uniform(0.07, 0.11)), False
    return Box((rng.uniform(0.14, 0.22), rng.uniform(0.1, 0.15), rng.uniform(0.008, 0.03))), False


def _extents(shape: Shape, lying: bool) -> tuple[float, float, float]:
    """Return half the extents of a shape that stands or lies, before it is turned about the vertical, metres."""
    if isinstance(shape, Box):
        x, y, z = (side / 2 for side in shape.size)
    else:
        x = y = shape.radius if isinstance(shape, Cylinder | Sphere | Cup) else shape.bounding_radius
        z = shape.half_height
    return (x, z, y) if lying else (x, y, z)


def _footprint(
    top: FloatArray, half: tuple[float, float], spot: tuple[float, float], size: tuple[float, float], yaw: float
) -> BoolArray:
    """Return the cells under a rectangle of half extents `size`, turned by `yaw`."""
    x = (np.arange(top.shape[0]) + 0.5) * CELL - half[0] - spot[0]
    y = (np.arange(top.shape[1]) + 0.5) * CELL - half[1] - spot[1]
    c, s = math.cos(yaw), math.sin(yaw)
    along, across = c * x[:, None] + s * y, c * y - s * x[:, None]
    return (np.abs(along) <= size[0] + CELL / 2) & (np.abs(across) <= size[1] + CELL / 2)


def _color(rng: np.random.Generator, number: int) -> Color:
    return COLORS[(number + int(rng.integers(len(COLORS)))) % len(COLORS)]
