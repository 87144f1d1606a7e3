# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The shapes of bodies: where rays from one point first enter them, each in its own frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from topo_region_seg.data import FloatArray, IntArray


class Entry(NamedTuple):
    """Where rays enter a shape: `t` (M,) inf for a miss, `face` (M,) and outward unit `normal` (M, 3)."""

    t: FloatArray
    face: IntArray
    normal: FloatArray


class Shape(Protocol):
    """A closed convex surface around the origin of its own frame."""

    @property
    def bounding_radius(self) -> float:
        """Radius of a sphere around the origin that contains the shape, metres."""

    @property
    def half_height(self) -> float:
        """Half the extent along z, metres."""

    def enter(self, origin: FloatArray, directions: FloatArray) -> Entry:
        """Return where the rays ``origin + t * directions[i]`` (t > 0) enter from outside."""


@dataclass(frozen=True)
class Box:
    """A box of edges `size` (metres) along x, y, z; faces 0..5 are -x, +x, -y, +y, -z, +z."""

    size: tuple[float, float, float]

    @property
    def bounding_radius(self) -> float:
        """Half the diagonal, metres."""
        return math.hypot(*self.size) / 2

    @property
    def half_height(self) -> float:
        """Half the extent along z, metres."""
        return self.size[2] / 2

    def enter(self, origin: FloatArray, directions: FloatArray) -> Entry:
        """Return where rays enter the box, by the slab method."""
        half = np.asarray(self.size) / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            low, high = (-half - origin) / directions, (half - origin) / directions
        near, far = np.fmin(low, high), np.fmax(low, high)
        axis = near.argmax(axis=1)
        rows = np.arange(len(directions))
        t = near[rows, axis]
        t = np.where((t <= far.min(axis=1)) & (t > 0), t, np.inf)
        positive = directions[rows, axis] < 0
        normal = np.zeros_like(directions)
        normal[rows, axis] = np.where(positive, 1.0, -1.0)
        return Entry(t, 2 * axis + positive, normal)


@dataclass(frozen=True)
class Cylinder:
    """An upright cylinder (axis z), metres; face 0 is the side, 1 the bottom, 2 the top."""

    radius: float
    height: float

    @property
    def bounding_radius(self) -> float:
        """Radius of the bounding sphere, metres."""
        return math.hypot(self.radius, self.height / 2)

    @property
    def half_height(self) -> float:
        """Half the extent along z, metres."""
        return self.height / 2

    def enter(self, origin: FloatArray, directions: FloatArray) -> Entry:
        """Return where rays enter the cylinder: its side or one of its caps."""
        flat = directions[:, :2]
        mantle = _nearest_root(
            np.einsum("ij,ij->i", flat, flat), flat @ origin[:2], float(origin[:2] @ origin[:2]) - self.radius**2
        )
        with np.errstate(invalid="ignore"):
            z = origin[2] + mantle * directions[:, 2]
        mantle = np.where(np.abs(z) <= self.half_height, mantle, np.inf)
        top = np.full(len(directions), math.copysign(self.half_height, origin[2]))
        with np.errstate(divide="ignore", invalid="ignore"):
            cap = (top - origin[2]) / directions[:, 2]
            across = origin[:2] + cap[:, None] * flat
        inside = np.einsum("ij,ij->i", across, across) <= self.radius**2
        cap = np.where(inside & (cap > 0) & (abs(origin[2]) > self.half_height), cap, np.inf)

        on_cap = cap < mantle
        t = np.where(on_cap, cap, mantle)
        normal = np.zeros_like(directions)
        hit = np.isfinite(t)
        normal[hit, :2] = (origin[:2] + t[hit, None] * flat[hit]) / self.radius
        normal[on_cap] = (0.0, 0.0, math.copysign(1.0, origin[2]))
        return Entry(t, np.where(on_cap, 2 if origin[2] > 0 else 1, 0), normal)


@dataclass(frozen=True)
class Sphere:
    """A sphere, metres; its one face is 0."""

    radius: float

    @property
    def bounding_radius(self) -> float:
        """The radius, metres."""
        return self.radius

    @property
    def half_height(self) -> float:
        """The radius, metres."""
        return self.radius

    def enter(self, origin: FloatArray, directions: FloatArray) -> Entry:
        """Return where rays enter the sphere."""
        t = _nearest_root(
            np.einsum("ij,ij->i", directions, directions), directions @ origin, float(origin @ origin) - self.radius**2
        )
        normal = np.zeros_like(directions)
        hit = np.isfinite(t)
        normal[hit] = (origin + t[hit, None] * directions[hit]) / self.radius
        return Entry(t, np.zeros(len(t), dtype=np.int64), normal)


def _nearest_root(a: FloatArray, half_b: FloatArray, c: float) -> FloatArray:
    """Return the smaller root of ``a t^2 + 2 half_b t + c`` where it is real and positive, else inf."""
    discriminant = half_b * half_b - a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (-half_b - np.sqrt(discriminant)) / a
    return np.where((discriminant > 0) & (t > 0), t, np.inf)
