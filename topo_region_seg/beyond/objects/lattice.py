# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Every other pixel of every other row, which stand for the others where a frame has very many points.

Where neighborhoods are many pixels wide, neighbors have nearly the same normal. Then normals are estimated, from all
points, at one pixel in four, and regions grow there; each other pixel takes both from the one beside it whose plane it
continues best.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from topo_region_seg.beyond.objects.spreading import spread_labels
from topo_region_seg.compiled.kd_tree import Tree
from topo_region_seg.data import BoolArray, FloatArray, IntArray
from topo_region_seg.params import Params
from topo_region_seg.steps.normals.estimate import estimate_normals
from topo_region_seg.steps.view.grid import normals_of_pixels
from topo_region_seg.steps.view.label_image import Labels
from topo_region_seg.steps.view.lengths import Lengths, middle_of, pixels_of, scales
from topo_region_seg.steps.view.scene import Scene

MANY = 100_000
"""Points from which on one pixel in four stands for the others."""
WIDE = 4.5
"""Radius, pixels, that the neighborhood of a normal and the scale of regions need for this."""


def normals_in(
    scene: Scene, xyz: FloatArray, rows: IntArray, tree: Tree, lengths: Lengths, params: Params
) -> tuple[FloatArray, Scene]:
    """Return the normals (N, 3) of points at pixels `rows` (N,), and the scene with what pixels stand for others."""
    radius = params.object_normal_radius * scales(lengths, xyz @ scene.axes[2])
    least = min(params.object_normal_radius, params.object_radius)
    if len(rows) <= MANY or pixels_of(least, lengths, scene.model, middle_of(scene)) < WIDE:
        return estimate_normals(xyz, tree, radius, params.normal_min_neighbors), scene
    own = on_lattice(rows, scene.grid.width)
    normals = estimate_normals(xyz, tree, np.where(own, radius, -radius), params.normal_min_neighbors)
    stands_for = _stands_for(scene, normals, rows, own)
    point = np.full(len(scene.classes) + 1, -1)
    point[rows + 1] = np.arange(len(rows))
    by = point[stands_for[rows]]
    normals[by >= 0] = normals[by[by >= 0]]
    return normals, replace(scene, stands_for=stands_for)


def on_lattice(rows: IntArray, width: int) -> BoolArray:
    """Return which pixels `rows` (N,) stand for others."""
    found: BoolArray = (rows % width % 2 == 0) & (rows // width % 2 == 0)
    return found


def labels_of_all(scene: Scene, label: Labels) -> Labels:
    """Return labels (P,) in which pixels have that of the pixel that stands for them."""
    return label if scene.stands_for is None else np.append(np.int32(0), label)[scene.stands_for]


def _stands_for(scene: Scene, normals: FloatArray, rows: IntArray, own: BoolArray) -> Labels:
    """Return of each pixel (P,) the one that stands for it, counted from 1; 0 where there is none."""
    number, todo = np.zeros(len(scene.classes), np.int32), np.zeros(len(scene.classes), np.bool_)
    number[rows[own]], todo[rows[~own]] = rows[own] + 1, True
    placed = normals_of_pixels(normals, rows, len(number))
    return spread_labels(scene.grid, placed, number, todo, scene.model.noise, scene.model.pixel, 1)
