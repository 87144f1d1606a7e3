# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Made clouds: boxes, cylinders and balls with labels printed on them, at any number of points and any spacing."""

from __future__ import annotations

import numpy as np

from benchmarks.points import FloatArray, Points, single, unit

COLOR_NOISE = 2.0  # dE, standard deviation per channel
NORMAL_NOISE = 1.5  # degrees, standard deviation per axis
DEPTH_NOISE = 0.1  # standard deviation in units of the spacing
SPACE = 0.3  # distance of the objects' centers, metres


def objects(n: int, spacing: float, seed: int = 0) -> Points:
    """Return a cloud of `n` points about `spacing` (m) apart on as many objects as that takes."""
    rng = np.random.default_rng(seed)
    parts: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    total = 0
    while total < n:
        number = len(parts)
        place = np.array([number % 8, number // 8, 0.0]) * SPACE + [0.0, 0.0, 1.0]
        xyz, normals = (_box, _cylinder, _ball)[number % 3](spacing, rng)
        parts.append((xyz + place, _paint(xyz, normals, rng), normals))
        total += len(xyz)
    xyz, lab, normals = (np.concatenate(columns)[:n] for columns in zip(*parts, strict=True))
    xyz = xyz + rng.normal(size=(n, 3)) * DEPTH_NOISE * spacing
    normals = unit(normals + rng.normal(size=(n, 3)) * np.radians(NORMAL_NOISE))
    name = f"made, {n:,} points {spacing * 1e3:g} mm apart"
    order = rng.permutation(n)
    return Points(name, single(xyz), lab, normals).take(order, name)


def _grid(width: float, height: float, spacing: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    u, v = np.meshgrid(np.arange(0.0, width, spacing), np.arange(0.0, height, spacing))
    shake = rng.uniform(-0.3, 0.3, (2, u.size)) * spacing
    return u.ravel() + shake[0], v.ravel() + shake[1]


def _box(spacing: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Three faces of a box."""
    size = rng.uniform(0.08, 0.16, 3)
    faces, normals = [], []
    for axis in range(3):
        u, v = _grid(size[(axis + 1) % 3], size[(axis + 2) % 3], spacing, rng)
        face = np.zeros((len(u), 3))
        face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = u, v
        faces.append(face)
        normals.append(np.tile(-np.eye(3)[axis], (len(u), 1)))
    return np.concatenate(faces), np.concatenate(normals)


def _cylinder(spacing: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Sample the half of a cylinder that faces the sensor."""
    radius, height = rng.uniform(0.03, 0.06), rng.uniform(0.10, 0.20)
    arc, v = _grid(np.pi * radius, height, spacing, rng)
    normals = np.column_stack([np.cos(arc / radius), np.zeros(len(arc)), -np.sin(arc / radius)])
    return normals * radius + np.outer(v, [0.0, 1.0, 0.0]), normals


def _ball(spacing: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Sample the half of a ball that faces the sensor, on a spiral."""
    radius = rng.uniform(0.04, 0.08)
    n = int(2.0 * np.pi * (radius / spacing) ** 2)
    depth, turn = (np.arange(n) + 0.5) / n, np.arange(n) * np.pi * (3.0 - np.sqrt(5.0))
    ring = np.sqrt(1.0 - depth**2)
    normals = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), -depth])
    return normals * radius, normals


def _paint(xyz: FloatArray, normals: FloatArray, rng: np.random.Generator) -> FloatArray:
    """CIELAB colors: shaded by the normal, with a label of another color across the middle."""
    base, label = rng.uniform([35.0, -40.0, -40.0], [75.0, 40.0, 40.0], (2, 3))
    middle, half = np.median(xyz[:, 1]), 0.2 * np.ptp(xyz[:, 1])
    lab = np.where((np.abs(xyz[:, 1] - middle) < half)[:, None], label, base)
    lab = lab + np.outer(-8.0 * normals[:, 2] + 4.0 * normals[:, 0], [1.0, 0.0, 0.0])
    return lab + rng.normal(size=lab.shape) * COLOR_NOISE
