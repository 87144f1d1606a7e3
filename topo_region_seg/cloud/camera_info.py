# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs/CameraInfo -> the camera of an image, as image_geometry's pinhole model reads it.

For images without distortion that is the projection matrix P, of which a region of interest and binning are taken off.
For images that are not rectified yet, although D holds a distortion, it is K and D.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from topo_region_seg.cloud.compressed_images import is_compressed, packed_size
from topo_region_seg.cloud.layout import CloudFormatError
from topo_region_seg.cloud.stamp import stamp_of

MODELS = {"plumb_bob": 5, "rational_polynomial": 8}
"""Distortions that are taken back, and how many coefficients they have."""
_FX, _CX, _FY, _CY = (0, 0), (0, 2), (1, 1), (1, 2)


@dataclass(frozen=True)
class Camera:
    """A pinhole camera and its lens.

    Parameters
    ----------
    fx, fy, cx, cy : float
        Focal lengths and principal point of the image, pixels.
    distortion : tuple of 8 floats
        k1, k2, p1, p2, k3, k4, k5, k6 of OpenCV's model; empty where the image has no distortion.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()


def is_rectified(topic: str) -> bool:
    """Return whether an image's topic says that its distortion was taken off, as image_proc names it: `image_rect`.

    CameraInfo does not: it is the same message for the image before and after.
    """
    return not {"rect", "rectified"}.isdisjoint(re.split(r"[/_]", topic))


def image_size(image: Any) -> tuple[int, int] | None:
    """Return (height, width) that a depth Image or CompressedImage says it has; None where it does not."""
    if is_compressed(image):
        return packed_size(image)
    return int(image.height), int(image.width)


def info_size(info: Any) -> tuple[int, int]:
    """Return (height, width) of the images that a CameraInfo describes; (0, 0) if it does not say."""
    roi = info.roi
    height = int(roi.height) or int(info.height)
    width = int(roi.width) or int(info.width)
    return height // max(1, int(info.binning_y)), width // max(1, int(info.binning_x))


def choose_info(infos: Sequence[Any], image: Any) -> Any | None:
    """Return the CameraInfo that is of an image: the one with its stamp, else the last one that fits its size.

    `infos` are in the order in which they came. None if none fits.
    """
    size = image_size(image)
    fitting = [info for info in infos if size is None or info_size(info) == size or not all(info_size(info))]
    exact = [info for info in fitting if stamp_of(info) == stamp_of(image)]
    return (exact or fitting or [None])[-1]


def camera_of(info: Any, height: int, width: int, *, rectified: bool) -> Camera:
    """Return the camera of an image of `height` x `width` pixels.

    Parameters
    ----------
    info : sensor_msgs/CameraInfo
        Of rclpy, rosbags of ROS 2 or rosbags of ROS 1.
    height, width : int
        Size of the image.
    rectified : bool
        Whether its distortion, if there is any, was taken off already.

    Raises
    ------
    CloudFormatError
        It describes images of another size, no calibrated camera, or a lens of another kind.
    """
    described = info_size(info)
    if all(described) and described != (height, width):
        raise CloudFormatError(
            "camera_info_size",
            f"camera_info describes images of {described[1]} x {described[0]} pixels, the depth image has {width} x "
            f"{height}; remap to the camera_info of the same images",
        )
    coefficients = tuple(float(number) for number in _field(info, "d"))
    distorted = any(coefficients) and not rectified
    full = _matrix(info, "p", 4)
    if distorted or not full[0][0]:
        full = _matrix(info, "k", 3)
    numbers = [full[row][column] for row, column in (_FX, _FY, _CX, _CY)]
    if not all(map(math.isfinite, numbers)) or not (numbers[0] > 0.0 and numbers[1] > 0.0):
        raise CloudFormatError(
            "camera_info_uncalibrated",
            f"camera_info has focal lengths {numbers[0]:g} and {numbers[1]:g}: calibrate the camera, or let its driver "
            "publish the calibration that it was made with",
        )
    fx, fy, cx, cy = numbers
    cx, cy = cx - int(info.roi.x_offset), cy - int(info.roi.y_offset)
    # Products with the inverse, as image_geometry has them: quotients may differ in the last bit.
    across, down = 1.0 / max(1, int(info.binning_x)), 1.0 / max(1, int(info.binning_y))
    lens = _lens(str(info.distortion_model), coefficients) if distorted else ()
    return Camera(fx * across, fy * down, cx * across, cy * down, lens)


def _lens(model: str, given: tuple[float, ...]) -> tuple[float, ...]:
    """Return eight coefficients."""
    known = MODELS.get(model, 8 if not model else 0)
    if not known or any(given[known:]) or not all(map(math.isfinite, given)):
        what = f"'{model}' with {len(given)} coefficients" if known else f"'{model[:40]}'"
        raise CloudFormatError(
            "camera_info_distortion",
            f"the depth image is not rectified, and the distortion {what} of its camera_info is not one of "
            f"{', '.join(MODELS)}; rectify the image first, as image_proc does, to a topic with 'rect' in its name",
        )
    return tuple([*given, *([0.0] * 8)][:8])


def _field(info: Any, name: str) -> Any:
    """Return a field that ROS 2 writes small and ROS 1 large."""
    return getattr(info, name, None) if hasattr(info, name) else getattr(info, name.upper())


def _matrix(info: Any, name: str, columns: int) -> list[list[float]]:
    values = [float(number) for number in _field(info, name)]
    if len(values) != 3 * columns:
        raise CloudFormatError("camera_info_uncalibrated", f"{name.upper()} of camera_info has {len(values)} numbers")
    return [values[row * columns : (row + 1) * columns] for row in range(3)]
