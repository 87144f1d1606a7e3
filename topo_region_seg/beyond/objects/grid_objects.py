# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Objects of an organized frame: its faces are united, completed and told from the ground on the image grid."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from topo_region_seg.beyond.objects.figure import confidences, relations_in
from topo_region_seg.beyond.objects.fragments import SMALL, borders_of_fragments
from topo_region_seg.beyond.objects.grid_borders import grid_borders
from topo_region_seg.beyond.objects.lattice import labels_of_all
from topo_region_seg.beyond.objects.spreading import spread_labels
from topo_region_seg.beyond.objects.uniting import unite_convex
from topo_region_seg.beyond.objects.vessels import insides, openings
from topo_region_seg.data import BoolArray, FloatArray, IntArray
from topo_region_seg.params import Params
from topo_region_seg.steps.view.grid import Single, normals_of_pixels
from topo_region_seg.steps.view.label_image import (
    Labels,
    bridged,
    kept_labels,
    renumbered,
    sizes_of,
    united_labels,
    wide_labels,
)
from topo_region_seg.steps.view.lengths import Lengths, middle_of, pixels_of
from topo_region_seg.steps.view.outlines import Relations
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


class Objects(NamedTuple):
    """The object of each point, (N,), -1 for none; the confidence of each; which points are in what is less sure."""

    region: IntArray
    confidence: FloatArray
    unsure: BoolArray


def objects_of_points(
    scene: Scene, pixel: IntArray, normals: FloatArray, region: IntArray, lengths: Lengths, params: Params
) -> Objects:
    """Return the objects that are at least as sure as `min_confidence`.

    `pixel`, `normals` (N, 3) and `region` (N,) are the pixel of each point, its normal, and its region of like normals,
    from 0; -1 for points in none. The other arguments are those of `objects_of_scene`.
    """
    n = len(scene.classes)
    label = np.zeros(n, np.int32)
    label[pixel] = region + 1
    placed = normals_of_pixels(normals, pixel, n)
    found, confidence = objects_of_scene(scene, placed, labels_of_all(scene, label), lengths, params)
    sure = confidence >= params.min_confidence
    sure[0] = False
    number, segment = np.where(sure, np.cumsum(sure), 0), found[pixel]
    return Objects(number[segment] - 1, confidence[sure], (segment > 0) & ~sure[segment])


def objects_of_scene(
    scene: Scene, normals: Single, label: Labels, lengths: Lengths, params: Params
) -> tuple[Labels, FloatArray]:
    """Return the segment of each pixel, (P,), 0 where there is none, and how sure it is that each is a thing, (L,).

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
        Uses `min_region_size` and the parameters of objects.
    """
    model = scene.model
    free = scene.classes == FREE
    if not free.any():
        return np.zeros(len(label), np.int32), np.zeros(1)
    middle = middle_of(scene)
    narrow = max(NARROWEST, pixels_of(params.object_normal_radius, lengths, model, middle))
    label = kept_labels(label, _sizes(label) >= params.min_region_size)
    label = kept_labels(label, _wide(scene, label, narrow))
    label = _united(scene, normals, label, lengths, params)
    rings = int(SPREAD * pixels_of(params.object_border_radius, lengths, model, middle))
    label = _spread(scene, normals, label, free, max(rings, RINGS[-1]))
    fewest = max(FEWEST, params.object_min_area / (model.pixel * middle) ** 2)
    for wide, rings in zip((True, False), RINGS, strict=True):
        label = _with_rest(scene, label, free & (label == 0), fewest, narrow if wide else None)
        label = _spread(scene, normals, label, free, rings)
    label = kept_labels(label, _sizes(label) >= fewest)
    label, found = _whole(scene, normals, label, lengths, params)
    n = int(np.max(label)) + 1
    return label, confidences(scene, label, found, n)


def _united(scene: Scene, normals: Single, label: Labels, lengths: Lengths, params: Params) -> Labels:
    """Return labels of which those are one whose borders are convex."""
    n = int(np.max(label)) + 1
    if n <= 2:
        return label
    every = np.ones(n, np.bool_)
    borders = grid_borders(scene.grid, normals, label, every, lengths, params.object_border_radius, scene.model.pixel)
    return united_labels(label, unite_convex(borders, n, params.object_convexity))


def _with_rest(scene: Scene, label: Labels, rest: BoolArray, fewest: float, narrow: float | None) -> Labels:
    """Return labels that what is joined in the `rest` (P,) has, too, if it is large and, where asked for, wide."""
    if np.count_nonzero(rest) < fewest:
        return label
    parts = ndimage.label(rest.reshape(scene.grid.height, scene.grid.width), BOX)[0].astype(np.int32).ravel()
    own: BoolArray = _sizes(parts) >= fewest
    own[0] = False
    if own.any() and narrow is not None:
        own &= _wide(scene, parts, narrow)
    if not own.any():
        return label
    number = np.where(own, np.cumsum(own) + np.max(label), 0).astype(np.int32)
    number[0] = 0
    return label + renumbered(parts, number)


def _whole(scene: Scene, normals: Single, label: Labels, lengths: Lengths, params: Params) -> tuple[Labels, Relations]:
    """Return labels of which fragments and what they belong to are one, and vessels and their insides; and relations.

    The relations are those between the labels that are returned.
    """
    size = _sizes(label)
    n = len(size)
    found = relations_in(scene, label, n)
    small = size <= SMALL
    small[0] = False
    if n > 2 and small.any():
        given = lengths, params.object_border_radius, scene.model.pixel
        borders = borders_of_fragments(grid_borders(scene.grid, normals, label, small, *given), found, size)
        label, found = _joined(scene, label, found, unite_convex(borders, n, params.object_convexity))
        n = int(np.max(label)) + 1
    if params.object_vessels and n > 2:
        group = insides(found, openings(label, scene.grid.xyz, normals, n))
        label, found = _joined(scene, label, found, group)
    return label, found


def _joined(scene: Scene, label: Labels, found: Relations, group: IntArray) -> tuple[Labels, Relations]:
    """Return labels of which those of a `group` (L,) are one, and their relations, which are known if none changes."""
    if (group == np.arange(len(group))).all():
        return label, found
    label = united_labels(label, group)
    return label, relations_in(scene, label, int(np.max(label)) + 1)


def _sizes(label: Labels) -> IntArray:
    return sizes_of(label, int(np.max(label, initial=0)) + 1)


def _wide(scene: Scene, label: Labels, narrow: float) -> BoolArray:
    """Return which labels (L,) are wide, as if single pixels that the sensor lost were there."""
    height, width = scene.grid.height, scene.grid.width
    whole = bridged(label, scene.classes, height, width, LOST)
    return wide_labels(whole, height, width, int(np.max(label)) + 1, narrow)


def _spread(scene: Scene, normals: Single, label: Labels, free: BoolArray, rings: int) -> Labels:
    return spread_labels(scene.grid, normals, label, free, scene.model.noise, scene.model.pixel, rings)
