# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A depth image, its camera and a registered color image -> :class:`~topo_region_seg.data.Cloud`.

The cloud is the one that `depth_image_proc` would publish of the same messages, to the last bit, so that labels are the
same whichever way a camera's data come.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.camera_info import Camera, camera_of
from topo_region_seg.cloud.images import DepthPixels, color_pixels, depth_pixels, read_only
from topo_region_seg.cloud.layout import CloudFormatError, Warn, ignore
from topo_region_seg.cloud.pixels import points_on_columns, points_on_rays, read_colors
from topo_region_seg.cloud.rays import undistorted_rays
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.data import Cloud

MILLIMETRE = np.float32(0.001)
METRE = np.float32(1.0)
PARTS = 4


def decode_depth(
    depth: Any,
    info: Any,
    color: Any = None,
    *,
    max_points: int,
    rectified: bool = False,
    warn: Warn | None = None,
    needs_color: bool = True,
) -> Cloud:
    """Read an organized cloud from a depth image; messages are not modified.

    Parameters
    ----------
    depth : sensor_msgs/Image or CompressedImage
        16UC1 (millimetres) or 32FC1 (metres), of rclpy or rosbags.
    info : sensor_msgs/CameraInfo
        Of the camera that the depth image is of.
    color : sensor_msgs/Image or CompressedImage, optional
        The same view in color, of the same size.
    max_points : int
        Images with more pixels are refused.
    rectified : bool
        Whether a distortion in `info` has been taken off the image; else it is taken off the rays.
    warn : callable, optional
        Called with (code, text) for input that is readable but odd.
    needs_color : bool
        Whether a color image that cannot be read is a reason to refuse the frame, or to read it without.

    Returns
    -------
    Cloud
        A point a pixel, row by row; `xyz` (N, 3) float32, metres, in the camera's optical frame, NaN where the depth is
        0, negative or not finite; `rgb` (N, 3) uint8, or None without a color image.

    Raises
    ------
    CloudFormatError
        A message contradicts itself or another one, is of a kind that is not known, or is too large.
    """
    warn = warn or ignore
    pixels = depth_pixels(depth, max_points=max_points, warn=warn)
    height, width = pixels.height, pixels.width
    if height * width == 0:
        return Cloud(np.empty((0, 3), np.float32), np.empty((0, 3), np.uint8), height, width)
    camera = camera_of(info, height, width, rectified=rectified)
    if camera.distortion:
        warn(
            "depth_not_rectified",
            "camera_info has a distortion, and no 'rect' in the topic's name says that the depth image has none: it is "
            "taken off the rays of the pixels",
        )
    rgb = None
    if color is not None:
        frames = [str(image.header.frame_id).lstrip("/") for image in (depth, color)]
        if frames[0] != frames[1]:
            warn(
                "color_frame",
                f"depth images are in the frame '{frames[0]}', color images in '{frames[1]}': colors lie beside things "
                "unless the driver has registered the one to the other",
            )
        try:
            rgb = color_pixels(color, height, width, max_points=max_points, warn=warn)
        except CloudFormatError as error:
            if needs_color:
                raise
            warn("color_unreadable", f"{error.detail}; read without color")
    return Cloud(points_of(pixels, camera), rgb, height, width)


def points_of(pixels: DepthPixels, camera: Camera) -> npt.NDArray[np.float32]:
    """Return what a camera sees, (N, 3) float32, metres."""
    height, width = pixels.height, pixels.width
    xyz = np.empty((height * width, 3), np.float32)
    metres = MILLIMETRE if pixels.values.dtype.kind == "u" else METRE
    rows = in_parts(height, PARTS)
    if camera.distortion:
        rays = undistorted_rays(camera, height, width)
        side_by_side(points_on_rays, [(pixels.values, *some, pixels.stride, width, rays, metres, xyz) for some in rows])
        return xyz
    with np.errstate(over="ignore"):  # absurd cameras see invalid points
        across = np.arange(width, dtype=np.float32) - np.float32(camera.cx)
        down = np.arange(height, dtype=np.float32) - np.float32(camera.cy)
        constants = np.float32(float(metres) / camera.fx), np.float32(float(metres) / camera.fy), metres
    side_by_side(
        points_on_columns, [(pixels.values, *some, pixels.stride, across, down, constants, xyz) for some in rows]
    )
    return xyz


def warm_up() -> None:
    """Compile the kernels of depth images, or load them from the cache."""
    lens = (0.01, *[0.0] * 7)
    for kind in (np.uint16, np.float32):
        pixels = DepthPixels(read_only(np.ones(4, kind)), 2, 2, 2)
        for distortion in ((), lens):
            points_of(pixels, Camera(1.0, 1.0, 0.5, 0.5, distortion))
    read_colors(read_only(np.zeros(12, np.uint8)), 0, 2, 2, 6, 3, (0, 1, 2), np.empty((4, 3), np.uint8))
