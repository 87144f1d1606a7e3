# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Objects of an organized frame: its faces are united, completed and told from the ground on the image grid."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from topo_region_seg.beyond.objects.figure import confidences, relations_in
from topo_region_seg.beyond.objects.fragments import borders_of_fragments
from topo_region_seg.beyond.objects.grid_borders import grid_borders
from topo_region_seg.beyond.objects.spreading import spread_labels
from topo_region_seg.beyond.objects.uniting import unite_convex
from topo_region_seg.beyond.objects.vessels import insides, openings
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.params import Params
from topo_region_seg.steps.view.grid import Single, normals_of_pixels
from topo_region_seg.steps.view.label_image import Labels, bridged, half_widths, kept_labels, united_labels
from topo_region_seg.steps.view.lengths import Lengths, middle_of, pixels_of
from topo_region_seg.steps.view.scene import FREE, Scene

NARROWEST = 1.5
"""Half the width, pixels, that a face has at the least."""
SPREAD = 2.0
"""How far faces spread over what is no face, times the border radius."""
RINGS = (40, 3)
"""Rings that they spread in addition, once what is wide is a segment of its own, and once what is left at all is."""
LOST = 3
"""Pixels in a row that sensors lose here and there."""
FEWEST = 200
"""Pixels that an object has at the least."""
BOX = np.ones((3, 3))


def objects_of_points(
    scene: Scene, pixel: IntArray, normals: FloatArray, region: IntArray, lengths: Lengths, params: Params
) -> tuple[IntArray, FloatArray]:
    """Return the object of each point, (N,), -1 for none, and the confidence of each object.

    `pixel`, `normals` (N, 3) and `region` (N,) are the pixel of each point, its normal, and its region of like normals,
    from 0; -1 for points in none. The other arguments are those of `objects_of_scene`.
    """
    n = len(scene.classes)
    label = np.zeros(n, np.int32)
    label[pixel] = region + 1
    placed = normals_of_pixels(normals, pixel, n)
    found, confidence = objects_of_scene(scene, placed, label, lengths, params)
    return found[pixel].astype(np.int64) - 1, confidence[1:]


def objects_of_scene(
    scene: Scene, normals: Single, label: Labels, lengths: Lengths, params: Params
) -> tuple[Labels, FloatArray]:
    """Return the object of each pixel, (P,), 0 where there is none, and the confidence of each, (L,).

    Parameters
    ----------
    scene : Scene
        The frame.
    normals : (P, 3) float32
        Normals of its pixels; NaN where there is none.
    label : (P,) int32
        Regions of like normals, from 1; 0 for pixels in none, or in grooves.
    lengths : Lengths
        How lengths grow with the depth.
    params : Params
        Uses `min_region_size`, `min_confidence` and the parameters of objects.
    """
    grid, model = scene.grid, scene.model
    free = scene.classes == FREE
    if not free.any():
        return np.zeros(len(label), np.int32), np.zeros(1)
    middle = middle_of(scene)
    narrow = max(NARROWEST, pixels_of(params.object_normal_radius, lengths, model, middle))
    label = kept_labels(label, np.bincount(label) >= params.min_region_size)
    label = kept_labels(label, _half_widths(scene, label) >= narrow)
    label = _united(scene, normals, label, lengths, params, fragments=False)
    rings = int(SPREAD * pixels_of(params.object_border_radius, lengths, model, middle))
    label = _spread(scene, normals, label, max(rings, RINGS[-1]))
    fewest = max(FEWEST, params.object_min_area / (model.pixel * middle) ** 2)
    for wide, rings in zip((True, False), RINGS, strict=True):
        rest = ndimage.label((free & (label == 0)).reshape(grid.height, grid.width), BOX)[0].astype(np.int32).ravel()
        own = np.bincount(rest) >= fewest
        if wide:
            own &= _half_widths(scene, rest) >= narrow
        rest = kept_labels(rest, own)
        label = _spread(scene, normals, np.where(rest > 0, rest + np.max(label), label).astype(np.int32), rings)
    label = kept_labels(label, np.bincount(label) >= fewest)
    label = _united(scene, normals, label, lengths, params, fragments=True)
    n = int(np.max(label)) + 1
    if params.object_vessels and n > 2:
        group = insides(relations_in(scene, label, n), openings(label, grid.xyz, normals, n))
        label = united_labels(label, group)
        n = int(np.max(label)) + 1
    confidence = confidences(scene, label, relations_in(scene, label, n), n)
    sure = confidence >= params.min_confidence
    sure[0] = False
    return kept_labels(label, sure), np.append(0.0, confidence[sure])


def _united(
    scene: Scene, normals: Single, label: Labels, lengths: Lengths, params: Params, *, fragments: bool
) -> Labels:
    """Return labels of which those are one whose borders are convex: all, or fragments and what they belong to."""
    n = int(np.max(label)) + 1
    if n <= 2:
        return label
    borders = grid_borders(scene.grid, normals, label, lengths, params.object_border_radius, scene.model.pixel)
    if fragments:
        borders = borders_of_fragments(borders, relations_in(scene, label, n), np.bincount(label, minlength=n))
    return united_labels(label, unite_convex(borders, n, params.object_convexity))


def _half_widths(scene: Scene, label: Labels) -> FloatArray:
    """Return half the width of each label, (L,), pixels, as if single pixels that the sensor lost were there."""
    height, width = scene.grid.height, scene.grid.width
    whole = bridged(label, scene.classes, height, width, LOST)
    return half_widths(whole, height, width, int(np.max(label)) + 1)


def _spread(scene: Scene, normals: Single, label: Labels, rings: int) -> Labels:
    model = scene.model
    return spread_labels(scene.grid, normals, label, scene.classes == FREE, model.noise, model.pixel, rings)
