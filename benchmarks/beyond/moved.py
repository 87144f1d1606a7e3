# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether the regions of a scene stay the same when the camera moves away from it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.recordings import FIRST_OBJECT, PER_OBJECT
from topo_region_seg.data import FloatArray, IntArray, LabelArray
from topo_region_seg.offline.evaluation.measures import measure
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.frame import SimulatedFrame

REFERENCE = 1.0
"""Distance with whose regions the others are compared, metres."""
TARGET = np.array(Camera.kinect().target)
SAME_FACE = math.cos(math.radians(30.0))
"""Least cosine between the true normals of a point and of its counterpart."""


class View(NamedTuple):
    """A frame, and how far the camera is from the middle of the table, metres."""

    frame: SimulatedFrame
    distance: float


def camera_at(distance: float) -> Camera:
    """Return the camera at a distance (m) from the middle of the table, always on the same side."""
    camera = Camera.kinect()
    away = np.array(camera.eye) - TARGET
    x, y, z = (TARGET + away * (distance / float(np.linalg.norm(away)))).tolist()
    return camera.look((x, y, z))


def seen_from(scene: int, distance: float, noisy: bool) -> View:
    """Return a tabletop from a distance (m) of its middle, from the same side."""
    camera = camera_at(distance)
    seen = simulate(tabletop(scene), camera, scene) if noisy else simulate(tabletop(scene), camera, scene, None)
    return View(seen, distance)


def agreement(one: View, labels: LabelArray, other: View, other_labels: LabelArray) -> float:
    """Return how much the regions of two views of a scene are the same: weighted overlap, the mean of both ways.

    On the points of objects that both views see: each of the farther view with its counterpart in the nearer one, which
    is the nearest true point there, if it is within a pixel and on the same face of the same object.
    """
    if one.distance < other.distance:
        return agreement(other, other_labels, one, labels)
    (rows, mine, normals, objects), (there, theirs, their_normals, their_objects) = _on_objects(one), _on_objects(other)
    apart, nearest = cKDTree(theirs).query(mine)
    both = (
        (apart < one.frame.xyz[rows, 2] / Camera.kinect().fx)
        & (np.einsum("ij,ij->i", normals, their_normals[nearest]) > SAME_FACE)
        & (objects == their_objects[nearest])
    )
    here, counterparts = labels[rows[both]], other_labels[there[nearest[both]]]
    return (_overlap(here, counterparts) + _overlap(counterparts, here)) / 2.0


def regions_on_objects(frame: SimulatedFrame, labels: LabelArray) -> int:
    """Return the number of regions that cover objects."""
    return len(np.unique(labels[(frame.labels >= FIRST_OBJECT) & (labels > 0)]))


def _on_objects(view: View) -> tuple[IntArray, FloatArray, FloatArray, LabelArray]:
    """Return the pixels of objects, their true points and normals beside the table, and their objects."""
    frame, camera = view.frame, camera_at(view.distance)
    rows = np.flatnonzero((frame.labels >= FIRST_OBJECT) & np.isfinite(frame.cloud.xyz).all(axis=1))
    turn = camera.rotation.T
    objects = (frame.labels[rows] - FIRST_OBJECT) // PER_OBJECT
    return rows, frame.xyz[rows] @ turn + np.array(camera.eye), frame.normals[rows] @ turn, objects


def _overlap(truth: LabelArray, labels: LabelArray) -> float:
    segments = np.where(truth > 0, truth + FIRST_OBJECT, 0).astype(np.uint32)
    return measure(segments, labels, np.ones(len(labels), np.bool_))["wov"] or 0.0
