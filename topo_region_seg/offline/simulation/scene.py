# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The scene in front of the camera: colored bodies in a world frame with z up, lengths in metres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from topo_region_seg.data import FloatArray
from topo_region_seg.offline.simulation.shapes import Shape

Color = tuple[int, int, int]


@dataclass(frozen=True)
class Paint:
    """The color of a body.

    Parameters
    ----------
    color : (r, g, b)
        8-bit sRGB.
    band : (r, g, b) or None
        Color of a printed band around the sides, which counts as a part of its own.
    band_from, band_to : float
        Lower and upper end of the band, as fractions of the height.
    grain : float
        Amplitude of a fine random texture of 4 mm cells, 8-bit levels.
    """

    color: Color
    band: Color | None = None
    band_from: float = 0.35
    band_to: float = 0.75
    grain: float = 0.0


@dataclass(frozen=True)
class Body:
    """A shape with a color and a pose.

    Parameters
    ----------
    shape : Shape
        Its geometry in its own frame.
    paint : Paint
        Its color.
    position : (x, y, z)
        Position of the center of the shape, metres.
    yaw, tilt : float
        Rotation about the world's z axis after one about the shape's own x axis, radians.
    """

    shape: Shape
    paint: Paint
    position: tuple[float, float, float]
    yaw: float = 0.0
    tilt: float = 0.0

    @property
    def rotation(self) -> FloatArray:
        """Matrix (3, 3) from the body's frame to the world."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        c, s = math.cos(self.tilt), math.sin(self.tilt)
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
        turn: FloatArray = about_z @ about_x
        return turn


@dataclass(frozen=True)
class Scene:
    """Background bodies (truth labels 1, 2, ...) and objects (parts 20-29, 30-39, ...).

    Raises
    ------
    ValueError
        If there are more than nine background bodies.
    """

    background: tuple[Body, ...]
    objects: tuple[Body, ...]

    def __post_init__(self) -> None:
        if len(self.background) > 9:
            raise ValueError(f"a scene has at most 9 background bodies, not {len(self.background)}")

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The background, then the objects."""
        return self.background + self.objects
