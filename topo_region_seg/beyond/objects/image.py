# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The image of a camera that a cloud is, or came from, and what it tells of the sensor."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.selection import gather_columns
from topo_region_seg.data import Cloud, FloatArray, IntArray
from topo_region_seg.params import Params
from topo_region_seg.steps.crop import crop
from topo_region_seg.steps.sensor import Sensor, known_sensor, possible_axes
from topo_region_seg.steps.support.search import SAMPLE
from topo_region_seg.steps.view.camera import camera_axes
from topo_region_seg.steps.view.grid import ImageGrid, image_grid
from topo_region_seg.steps.view.model import SensorModel, sensor_model
from topo_region_seg.steps.view.placed import placed_points


class CameraImage(NamedTuple):
    """Points as their camera saw them.

    Parameters
    ----------
    grid : ImageGrid
        The pixels.
    axes : (3, 3) float64
        Rows: the image's right and down, and the middle of the view.
    sensor : Sensor or None
        Where the sensor is known to be; that is where a list of points is seen from if these lie on a grid of pixels.
    rows, pixel : (N,) int64
        The input rows of the points, and their pixels.
    xyz : (N, 3) float64
        Their positions, metres, the sensor at the origin.
    """

    grid: ImageGrid
    axes: FloatArray
    sensor: Sensor | None
    rows: IntArray
    pixel: IntArray
    xyz: FloatArray


def image_of(
    cloud: Cloud, rows: IntArray, xyz: FloatArray, params: Params, sensor: Sensor | None
) -> CameraImage | None:
    """Return the image of a cloud, organized or a list of points; None if its points are no camera's.

    Parameters
    ----------
    cloud : Cloud
        The cloud.
    rows, xyz : (N,) int64, (N, 3) float64
        The rows that are not cropped, and their positions, metres, the sensor at the origin.
    params : Params
        Uses `sensor_pose`.
    sensor : Sensor or None
        Where it is known to be.
    """
    placed = placed_points(cloud, rows, xyz, possible_axes(cloud, params))
    if placed is None:
        return None
    rows, pixel, xyz, height, width, axes = placed
    if axes is not None:
        sensor = Sensor(np.zeros(3) if sensor is None else sensor.position, axes)
    seen = None if sensor is None else sensor.axes
    if seen is None:
        seen = camera_axes(np.ascontiguousarray(xyz[:: max(1, len(xyz) // SAMPLE)]))
    if seen is None:
        return None
    return CameraImage(image_grid(xyz, pixel, height, width, seen[2]), seen, sensor, rows, pixel, xyz)


def sensor_model_of(cloud: Cloud, params: Params | None = None) -> SensorModel | None:
    """Return what a cloud tells of its sensor: the angle between pixels, noise by depth, share of valid pixels.

    Parameters
    ----------
    cloud : Cloud
        Organized, or a list of the points of an image.
    params : Params, optional
        Uses `sensor_pose` and what crops.

    Returns
    -------
    SensorModel or None
        None where the cloud is no image of a camera, or too sparse.
    """
    params = (params or Params()).replace(output="objects")
    known = known_sensor(cloud, params)
    sensor = np.zeros(3) if known is None else known.position
    rows = crop(cloud.xyz, sensor, params, base=cloud.base_pose)
    image = image_of(cloud, rows, gather_columns(cloud.xyz, rows, sensor), params, known)
    return None if image is None else sensor_model(image.grid)
