# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Streams of things that move too far between two frames, or hide, for overlap alone to follow them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from benchmarks.recordings import FIRST_OBJECT, PER_OBJECT
from topo_region_seg.data import Cloud
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.camera import TABLE_CENTER
from topo_region_seg.offline.simulation.scene import Body, Color, Paint, Scene
from topo_region_seg.offline.simulation.shapes import Box, Sphere

COLORS: tuple[Color, ...] = (
    (196, 60, 52),
    (52, 110, 190),
    (240, 196, 70),
    (70, 150, 80),
    (230, 128, 46),
    (128, 82, 158),
)
RED, GRAY = COLORS[0], (60, 60, 60)
Moment = tuple[tuple[Body, ...], tuple[Body, ...]]
"""What stands on the table: first what is not followed, then what is."""


def hidden(frames: int = 14) -> Iterator[Moment]:
    """Yield two boxes alike, one of which a board hides for some frames while it passes before it."""
    for k in range(frames):
        board = _standing(Box((0.01, 0.2, 0.25)), GRAY, -0.2, -0.42 + 0.05 * k)
        alike = Box((0.05, 0.05, 0.06))
        yield (board,), (_standing(alike, RED, 0.05, -0.09), _standing(alike, RED, 0.05, 0.09))


def ball(frames: int = 10) -> Iterator[Moment]:
    """Yield a ball that gains speed, to 0.15 m a frame: twice its width."""
    place = -0.4
    for k in range(frames):
        place += min(0.03 * k, 0.15)
        yield (), (_standing(Sphere(0.035), RED, 0.05, place),)


def belt(frames: int = 14) -> Iterator[Moment]:
    """Yield boxes alike, 0.08 m apart, on a belt that gains speed, to 0.05 m a frame: the nearest is another one."""
    start = -0.5
    for k in range(frames):
        start += min(0.01 * k, 0.05)
        yield (), tuple(_standing(Box((0.035, 0.035, 0.05)), COLORS[1], 0.0, start + 0.08 * i) for i in range(6))


def turntable(colors: bool, frames: int = 8) -> Iterator[Moment]:
    """Yield six boxes on a turntable, 35 degrees a frame: the nearest is another one, of other color or other size."""
    sizes = [(0.04, 0.04, 0.06)] if colors else [(0.03, 0.03, 0.04), (0.06, 0.06, 0.07)]
    for k in range(frames):
        angles = [math.radians(60 * i + 35 * k) for i in range(6)]
        yield (
            (),
            tuple(
                _standing(
                    Box(sizes[i % len(sizes)]), COLORS[i if colors else 0], 0.12 * math.cos(a), 0.12 * math.sin(a)
                )
                for i, a in enumerate(angles)
            ),
        )


STREAMS: dict[str, Callable[[], Iterator[Moment]]] = {
    "box hidden for some frames, beside one alike": hidden,
    "fast ball": ball,
    "fast belt of boxes alike": belt,
    "turntable, boxes of different colors": lambda: turntable(colors=True),
    "turntable, boxes of two sizes": lambda: turntable(colors=False),
}


def seen_by(camera: Camera, moments: Iterator[Moment]) -> Iterator[tuple[Cloud, npt.NDArray[np.uint32]]]:
    """Yield the clouds of a stream and the true labels, one label for each whole object."""
    room = tabletop(0, objects=0).background
    for number, (passing, followed) in enumerate(moments):
        frame = simulate(Scene(room + passing, followed), camera, number)
        whole = frame.labels - (frame.labels - FIRST_OBJECT) % PER_OBJECT
        yield frame.cloud, np.where(frame.labels < FIRST_OBJECT, frame.labels, whole).astype(np.uint32)


def _standing(shape: Box | Sphere, color: Color, x: float, y: float) -> Body:
    return Body(shape, Paint(color), (x, y, TABLE_CENTER[2] + shape.half_height))
