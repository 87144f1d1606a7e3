# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Clouds that make neighborhood searches slow, at any number of points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.points import FloatArray, Points, single, unit

SPACING = 0.002


def _surface(n: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points of a square patch seen by a camera at pixel pitch, gray, facing the sensor."""
    side = int(np.ceil(np.sqrt(n)))
    row, column = np.divmod(np.arange(n), side)
    xyz = np.column_stack([column * SPACING, row * SPACING, np.full(n, 1.0)])
    xyz += rng.normal(size=(n, 3)) * [0.0, 0.0, 0.0002]
    return xyz, np.tile([50.0, 0.0, 0.0], (n, 1)), np.tile([0.0, 0.0, -1.0], (n, 1))


def random_colors(n: int, radius: float) -> Points:
    """Every color random."""
    rng = np.random.default_rng(1)
    xyz, _, normals = _surface(n, rng)
    lab = rng.uniform([0.0, -100.0, -100.0], [100.0, 100.0, 100.0], (n, 3))
    return Points("every color random", single(xyz), lab, normals)


def random_normals(n: int, radius: float) -> Points:
    """Every normal random."""
    rng = np.random.default_rng(2)
    xyz, lab, _ = _surface(n, rng)
    normals = unit(rng.normal(size=(n, 3)) - [0.0, 0.0, 1.0])
    return Points("every normal random", single(xyz), lab, normals)


def checkerboard(n: int, radius: float) -> Points:
    """Two colors alternate from pixel to pixel."""
    xyz, lab, normals = _surface(n, np.random.default_rng(3))
    row, column = np.divmod(np.arange(n), int(np.ceil(np.sqrt(n))))
    lab[:, 0] += 40.0 * ((row + column) % 2)
    return Points("checkerboard of two colors at pixel pitch", single(xyz), lab, normals)


def dense_ball(n: int, radius: float) -> Points:
    """All points within reach of each other; colors and normals as noisy as a sensor's."""
    rng = np.random.default_rng(4)
    inside = unit(rng.normal(size=(n, 3))) * (0.5 * radius * rng.random((n, 1)) ** (1 / 3))
    lab = np.array([50.0, 0.0, 0.0]) + rng.normal(size=(n, 3)) * 4.0
    normals = unit(np.array([0.0, 0.0, -1.0]) + rng.normal(size=(n, 3)) * 0.05)
    return Points("dense ball, all points within R", single(inside + [0.0, 0.0, 1.0]), lab, normals)


def identical(n: int, radius: float) -> Points:
    """All points at one place, of one color and normal."""
    xyz = np.tile([0.1, 0.2, 1.0], (n, 1))
    return Points("all points identical", single(xyz), np.zeros((n, 3)), np.tile([0.0, 0.0, -1.0], (n, 1)))


def far_outlier(n: int, radius: float) -> Points:
    """One point very far from the others."""
    xyz, lab, normals = _surface(n, np.random.default_rng(5))
    xyz[0] = [3e6, -2e6, 1e6]
    return Points("one far outlier", single(xyz), lab, normals)


CLOUDS: dict[str, Callable[[int, float], Points]] = {
    maker.__name__: maker for maker in (random_colors, random_normals, checkerboard, dense_ball, identical, far_outlier)
}
