# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A camera's frame before things are told apart in it: its sensor, its surfaces and its grooves."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from topo_region_seg.beyond.objects.creases import grooves_of_grid
from topo_region_seg.beyond.objects.image import CameraImage
from topo_region_seg.beyond.objects.lattice import on_lattice
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.data import BoolArray, FloatArray, IntArray, Plane
from topo_region_seg.params import Params
from topo_region_seg.steps.support.ground import scene_of
from topo_region_seg.steps.support.judgement import Judged
from topo_region_seg.steps.support.search import NO_SUPPORT, Support, speaks_against_sensor
from topo_region_seg.steps.support.surfaces import find_surfaces
from topo_region_seg.steps.view.grid import normals_of_pixels
from topo_region_seg.steps.view.lengths import Lengths
from topo_region_seg.steps.view.model import sensor_model
from topo_region_seg.steps.view.scene import BEHIND, FREE, Scene, Surface


class Frame(NamedTuple):
    """What is known of a frame, its support, and what was made of that."""

    scene: Scene
    support: Support


def frame_of(image: CameraImage, params: Params, up: FloatArray | None) -> Frame | None:
    """Return the scene of an image and its support; None if it is too sparse to tell the sensor's noise.

    Parameters
    ----------
    image : CameraImage
        The image.
    params : Params
        Uses `remove_floor`, `floor_min_extent`, `floor_seed` and `object_floor_distance`.
    up : (3,) float64 or None
        Unit vector, where it is known.
    """
    grid, axes = image.grid, image.axes
    model = sensor_model(grid)
    if model is None:
        return None
    surfaces = find_surfaces(grid, model, params.floor_min_extent, params.floor_seed) if params.remove_floor else []
    least, exact = params.object_floor_distance, params.differs("object_floor_distance")
    scene = scene_of(grid, model, surfaces, least, exact=exact, axes=axes, up=up)
    largest = max(surfaces, key=lambda surface: surface.share) if surfaces else None
    if largest is not None and image.sensor is None and (scene.support is None or scene.support is largest):
        judged = _judged(scene, largest)
        if speaks_against_sensor(judged):
            return Frame(scene_of(grid, model, [], least, exact=exact, axes=axes), Support(None, judged))
    if scene.support is None:
        return Frame(scene, NO_SUPPORT)
    normal, offset = scene.support.normal, scene.support.offset
    plane = Plane(normal=(float(normal[0]), float(normal[1]), float(normal[2])), offset=offset)
    return Frame(scene, Support(plane, _judged(scene, scene.support)))


def _judged(scene: Scene, surface: Surface) -> Judged:
    """Return what is known of a surface, as `judge` does of a plane."""
    share = np.bincount(scene.classes, minlength=FREE + 1) / max(1, int(np.count_nonzero(scene.classes)))
    return Judged(
        normal=surface.normal,
        offset=surface.offset,
        share=surface.share,
        before=float(share[FREE]),
        behind=float(share[BEHIND]),
        carries=surface.front > 0.0,
        seen_through=False,
        hidden=surface.through,
        beneath=0.0,
    )


def free_points(scene: Scene, rows: IntArray) -> IntArray:
    """Return which of the points at pixels `rows` (N,) may belong to things."""
    return np.flatnonzero(scene.classes[rows] == FREE)


def grooves_in(scene: Scene, normals: FloatArray, rows: IntArray, lengths: Lengths, params: Params) -> BoolArray:
    """Return which points (N,), at pixels `rows`, lie in a groove, as `find_grooves` does in a tree.

    Points that others stand for are taken for such, so that no region grows there.
    """
    placed = normals_of_pixels(normals, rows, len(scene.classes))
    own: BoolArray = np.ones(len(rows), np.bool_) if scene.stands_for is None else on_lattice(rows, scene.grid.width)
    some, grooves, every = rows[own], np.zeros(np.count_nonzero(own), np.bool_), ~own
    limits = params.object_border_radius, scene.model.pixel, math.radians(params.object_groove_angle)
    given = scene.grid, placed, some, lengths, *limits
    side_by_side(grooves_of_grid, [(*given, first, end, grooves) for first, end in in_parts(len(some))])
    every[own] = grooves
    return every
