# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the sensor is, from where distances, the near side of a plane and normals are seen, and which way is up."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from topo_region_seg.data import Cloud, FloatArray
from topo_region_seg.params import Params
from topo_region_seg.steps.view.resection import camera_pose

NEAR = 0.05
"""Distance, metres, up to which a pose and the camera that an image grid shows are of one sensor."""
MAP = 10.0
"""Extents of a cloud from its nearest edge beyond which the origin is no place from which a sensor saw it."""


class Sensor(NamedTuple):
    """Where the sensor is in the frame of a cloud.

    Parameters
    ----------
    position : (3,) float64
        Metres.
    axes : (3, 3) float64 or None
        Rows: the image's right and down, and the middle of the view; None where they are not known.
    """

    position: FloatArray
    axes: FloatArray | None


def known_sensor(cloud: Cloud, params: Params) -> Sensor | None:
    """Return where the sensor is in the frame of a cloud; None where that is not known.

    As the parameter says, else the file or recording; else where the image grid of an organized cloud shows the camera
    to be, if it is not at the origin. Which way it looks matters where lengths follow the camera.
    """
    pose = params.sensor_pose or cloud.sensor_pose
    follows = params.output == "objects" or params.max_radius == "auto"
    camera = camera_pose(cloud) if pose is None or follows else None
    if pose is not None and np.isfinite(pose[:3]).all():
        position = np.array(pose[:3], np.float64)
        there = camera is not None and float(np.linalg.norm(camera.center - position)) < NEAR
        return Sensor(position, camera.axes if camera is not None and there else None)
    return None if camera is None else Sensor(camera.center, camera.axes)


def possible_axes(cloud: Cloud, params: Params) -> list[FloatArray]:
    """Return the axes (3, 3) that a camera may have: those of the frame, and of the sensor's pose where that is known.

    Rows: the image's right and down, and the middle of the view. A pose may be that of a camera, which looks along z,
    or of a body, which looks along x with z up.
    """
    pose = params.sensor_pose or cloud.sensor_pose
    found = [np.eye(3)]
    if pose is not None and np.isfinite(pose).all():
        turned = np.ascontiguousarray(_turn_of_any(pose).as_matrix().T)
        found += [turned, np.array([-turned[1], -turned[2], turned[0]])]
    return found


def up_direction(cloud: Cloud, params: Params) -> FloatArray | None:
    """Return the unit vector (3,) of up in the frame of a cloud; None if it is not known.

    Where the base frame is known the parameter is a direction in it, by default its z.
    """
    if not params.up and cloud.base_pose is None:
        return None
    up = np.array(params.up or (0.0, 0.0, 1.0), np.float64)
    up /= float(np.linalg.norm(up))
    return up if cloud.base_pose is None else turn_of(cloud.base_pose).apply(up)


def _turn_of_any(pose: tuple[float, ...]) -> Rotation:
    return Rotation.from_euler("xyz", pose[3:]) if len(pose) == 6 else turn_of(pose)


def turn_of(pose: tuple[float, ...]) -> Rotation:
    """Return the rotation of a pose x, y, z, w, x, y, z."""
    w, x, y, z = pose[3:]
    return Rotation.from_quat([x, y, z, w])


def position_above_map(xyz: FloatArray) -> FloatArray | None:
    """Return a place to see a map from, (3,), metres: above its middle. None if the points (N, 3) are no map.

    A map, such as one in UTM coordinates, lies many times its own extent from the origin; z is up in it.
    """
    if len(xyz) == 0:
        return None
    low, high = np.percentile(xyz, [1.0, 99.0], axis=0)
    extent = float(np.linalg.norm(high - low))
    outside = np.maximum(np.maximum(low, -high), 0.0)
    if float(np.linalg.norm(outside)) <= MAP * extent:
        return None
    place: FloatArray = (low + high) / 2.0 + np.array([0.0, 0.0, max(extent, 1.0)])
    return place
