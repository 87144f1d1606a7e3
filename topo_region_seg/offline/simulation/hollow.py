# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Shapes that are not convex: vessels, and several shapes in one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.offline.simulation.shapes import Entry, Shape

FACES = 8
"""Faces that each shape of a compound has numbers for."""


@dataclass(frozen=True)
class Cup:
    """An upright vessel (axis z) that is open above, metres.

    Faces: 0 outside, 1 bottom, 2 rim, 3 inside, 4 floor inside.

    Parameters
    ----------
    radius, height : float
        Of the outside.
    wall : float
        Thickness of the wall and of the bottom.
    """

    radius: float
    height: float
    wall: float = 0.004

    @property
    def bounding_radius(self) -> float:
        """Radius of the bounding sphere, metres."""
        return math.hypot(self.radius, self.height / 2)

    @property
    def half_height(self) -> float:
        """Half the extent along z, metres."""
        return self.height / 2

    def enter(self, origin: FloatArray, directions: FloatArray) -> Entry:
        """Return where rays first meet a wall, the rim, the bottom or the floor inside."""
        top, bottom = self.half_height, -self.half_height
        inner, floor = self.radius - self.wall, bottom + self.wall
        t = np.full(len(directions), np.inf)
        face = np.zeros(len(directions), np.int64)
        for number, radius, low in ((0, self.radius, bottom), (3, inner, floor)):
            for root in _mantle(origin, directions, radius):
                z = origin[2] + np.where(np.isfinite(root), root, 0.0) * directions[:, 2]
                _keep(t, face, np.where((z >= low) & (z <= top), root, np.inf), number)
        rings = ((1, bottom, 0.0, self.radius), (2, top, inner, self.radius), (4, floor, 0.0, inner))
        for number, height, low, high in rings:
            with np.errstate(divide="ignore", invalid="ignore"):
                root = (height - origin[2]) / directions[:, 2]
                across = np.linalg.norm(origin[:2] + root[:, None] * directions[:, :2], axis=1)
            _keep(t, face, np.where((across >= low) & (across <= high) & (root > 0), root, np.inf), number)
        normal = np.zeros_like(directions)
        hit = np.isfinite(t)
        normal[hit, :2] = (origin[:2] + t[hit, None] * directions[hit, :2]) / self.radius
        normal[hit & (face == 3)] *= -self.radius / inner
        normal[hit & np.isin(face, (2, 4))] = (0.0, 0.0, 1.0)
        normal[hit & (face == 1)] = (0.0, 0.0, -1.0)
        return Entry(t, face, normal)


@dataclass(frozen=True)
class Compound:
    """Several shapes that are one body, each at an offset (x, y, z) from its origin, metres."""

    parts: tuple[tuple[Shape, tuple[float, float, float]], ...]

    @property
    def bounding_radius(self) -> float:
        """Radius of a sphere around the origin that contains all parts, metres."""
        return max(shape.bounding_radius + math.hypot(*offset) for shape, offset in self.parts)

    @property
    def half_height(self) -> float:
        """Largest extent along z on either side of the origin, metres."""
        return max(shape.half_height + abs(offset[2]) for shape, offset in self.parts)

    def enter(self, origin: FloatArray, directions: FloatArray) -> Entry:
        """Return where rays enter the first of the parts; its faces are numbered from FACES times its place."""
        t = np.full(len(directions), np.inf)
        face, normal = np.zeros(len(directions), np.int64), np.zeros_like(directions)
        for place, (shape, offset) in enumerate(self.parts):
            entry = shape.enter(origin - offset, directions)
            nearer = entry.t < t
            t[nearer], normal[nearer] = entry.t[nearer], entry.normal[nearer]
            face[nearer] = FACES * place + entry.face[nearer]
        return Entry(t, face, normal)


def _mantle(origin: FloatArray, directions: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """Return both places where rays cross an endless cylinder; inf where they do not or that is behind."""
    flat = directions[:, :2]
    a, half_b = np.einsum("ij,ij->i", flat, flat), flat @ origin[:2]
    inside = half_b * half_b - a * (float(origin[:2] @ origin[:2]) - radius * radius)
    with np.errstate(divide="ignore", invalid="ignore"):
        near, far = (-half_b - np.sqrt(inside)) / a, (-half_b + np.sqrt(inside)) / a
    hit = inside > 0
    return np.where(hit & (near > 0), near, np.inf), np.where(hit & (far > 0), far, np.inf)


def _keep(t: FloatArray, face: IntArray, root: FloatArray, number: int) -> None:
    """Put `root` and the face into the rows where it is nearer."""
    nearer = root < t
    t[nearer], face[nearer] = root[nearer], number
