# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Ray casting: the exact surface point that each pixel of a camera sees."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import FloatArray, IntArray, LabelArray
from topo_region_seg.offline.simulation.camera import Camera
from topo_region_seg.offline.simulation.parts import PartNumbers, true_labels
from topo_region_seg.offline.simulation.scene import Body, Scene

_LIGHT = np.array([-0.45, 0.35, 0.82]) / np.linalg.norm([-0.45, 0.35, 0.82])  # in the world, towards the light
_AMBIENT = 0.82
_GRAIN_CELL = 0.004
ZONES, ON_BAND = 3, 1
"""Pieces of a face: below its printed band, on it, above it."""


@dataclass(frozen=True)
class Rendering:
    """The view of a camera, one row per pixel.

    Parameters
    ----------
    depth : (N,) float64
        z in the camera's frame, metres; NaN where nothing is hit.
    normals : (N, 3) float64
        Outward unit normals in the camera's frame; NaN where nothing is hit.
    rgb : (N, 3) float64
        Shaded color, 0..255.
    labels : (N,) uint32
        0 nothing, 1-9 background, then parts of objects from 20, 30, ...; a part is a connected piece of one face.
    """

    depth: FloatArray
    normals: FloatArray
    rgb: FloatArray
    labels: LabelArray


def render(scene: Scene, camera: Camera, numbers: PartNumbers | None = None) -> Rendering:
    """Cast one ray per pixel and keep the nearest surface; `numbers` are those of parts in the frames before."""
    to_world = camera.rotation
    rays = camera.rays() @ to_world.T  # z = 1 in the camera's frame, so ray parameters are depths
    eye = np.asarray(camera.eye)
    depth = np.full(len(rays), np.inf)
    normals = np.full((len(rays), 3), np.nan)
    rgb = np.zeros((len(rays), 3))
    owner = np.full(len(rays), -1)
    piece = np.zeros(len(rays), dtype=np.int64)
    for number, body in enumerate(scene.bodies):
        rows = _rows_near(body, eye, rays)
        turn = body.rotation
        origin = (eye - body.position) @ turn
        local = rays[rows] @ turn
        entry = body.shape.enter(origin, local)
        first = entry.t < depth[rows]
        rows, t, face = rows[first], entry.t[first], entry.face[first]
        point = origin + t[:, None] * local[first]
        world_normals = entry.normal[first] @ turn.T
        depth[rows] = t
        normals[rows] = world_normals @ to_world
        zone = _zone(body, point, entry.normal[first])
        rgb[rows] = _painted(body, point, zone == ON_BAND) * _shade(world_normals)[:, None]
        owner[rows] = number
        piece[rows] = ZONES * face + zone
    depth[np.isinf(depth)] = np.nan
    labels = true_labels(owner, piece, len(scene.background), (camera.height, camera.width), numbers or PartNumbers())
    return Rendering(depth, normals, rgb, labels)


def _rows_near(body: Body, eye: FloatArray, rays: FloatArray) -> IntArray:
    """Return the rows of the rays that meet the body's bounding sphere."""
    center = np.asarray(body.position) - eye
    distance = float(np.linalg.norm(center))
    radius = body.shape.bounding_radius
    if distance <= radius:
        return np.arange(len(rays))
    along = rays @ (center / distance)
    cosine = math.sqrt(1.0 - (radius / distance) ** 2)
    return np.flatnonzero((along > 0) & (along * along >= cosine**2 * np.einsum("ij,ij->i", rays, rays)))


def _zone(body: Body, point: FloatArray, normal: FloatArray) -> IntArray:
    """Return where points lie: ON_BAND of the sides, 2 above it, 0 below it and on what has no band."""
    height = point[:, 2] / (2 * body.shape.half_height) + 0.5
    paint = body.paint
    zone = np.where(height < paint.band_from, 0, np.where(height < paint.band_to, ON_BAND, 2))
    return np.where((np.abs(normal[:, 2]) < 0.99) & (paint.band is not None), zone, 0)


def _painted(body: Body, point: FloatArray, banded: npt.NDArray[np.bool_]) -> FloatArray:
    paint = body.paint
    color = np.where(banded[:, None], paint.band or paint.color, paint.color).astype(np.float64)
    if paint.grain:
        cell = np.floor(point / _GRAIN_CELL).astype(np.int64).astype(np.uint64)
        mixed = cell @ np.array([73856093, 19349663, 83492791], dtype=np.uint64)
        mixed ^= mixed >> np.uint64(13)
        mixed *= np.uint64(0x9E3779B97F4A7C15)
        color += paint.grain * ((mixed >> np.uint64(40)) / 2.0**23 - 1.0)[:, None]
    return color


def _shade(world_normals: FloatArray) -> FloatArray:
    return _AMBIENT + (1.0 - _AMBIENT) * np.maximum(world_normals @ _LIGHT, 0.0)
