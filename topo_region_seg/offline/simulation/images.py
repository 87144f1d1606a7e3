# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What an RGB-D driver publishes beside its clouds: depth images, color images and camera_info."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags.image_topics import IMAGE, INFO
from topo_region_seg.offline.bags.types import typestore
from topo_region_seg.offline.simulation.camera import Camera

DEPTH_TOPIC = "/camera/depth/image_rect_raw"
INFO_TOPIC = "/camera/depth/camera_info"
COLOR_TOPIC = "/camera/color/image_raw"
IMAGE_TOPICS = {INFO_TOPIC: INFO, COLOR_TOPIC: IMAGE, DEPTH_TOPIC: IMAGE}
"""The topics of images and their types, in the order in which a frame is recorded."""
LARGEST = np.iinfo(np.uint16).max


def image_messages(header: Any, cloud: Cloud, camera: Camera, encoding: str = "16UC1") -> Iterator[tuple[str, Any]]:
    """Yield (topic, message of rosbags) for what a camera has seen as a cloud.

    Parameters
    ----------
    header : std_msgs/Header
        Of rosbags; used as it is.
    cloud : Cloud
        Organized, of the camera's size, in its frame; without color there is no color image.
    camera : Camera
        The camera.
    encoding : str
        Of the depth: "16UC1", millimetres, 0 where there is none, or "32FC1", metres, NaN.

    Raises
    ------
    ValueError
        If the cloud is not of the camera's size.
    """
    if (cloud.height, cloud.width) != (camera.height, camera.width):
        raise ValueError(
            f"a cloud of {cloud.width} x {cloud.height} points is not one of a camera of {camera.width} x "
            f"{camera.height} pixels"
        )
    yield INFO_TOPIC, camera_info(header, camera)
    if cloud.rgb is not None:
        yield COLOR_TOPIC, _image(header, cloud.rgb.reshape(cloud.height, -1), "rgb8", cloud)
    depth = cloud.xyz[:, 2].astype(np.float32)
    if encoding == "16UC1":
        millimetres = np.nan_to_num(np.round(1000.0 * depth), nan=0.0)
        depth = np.where(millimetres <= LARGEST, millimetres, 0.0).astype(np.uint16)
    yield DEPTH_TOPIC, _image(header, depth.reshape(cloud.height, -1), encoding, cloud)


def camera_info(header: Any, camera: Camera) -> Any:
    """Return the sensor_msgs/CameraInfo of a camera without distortion."""
    types = typestore().types
    fx, fy, cx, cy = camera.fx, camera.fy, camera.cx, camera.cy
    return types["sensor_msgs/msg/CameraInfo"](
        header=header,
        height=camera.height,
        width=camera.width,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=np.array([fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]),
        r=np.eye(3).ravel(),
        p=np.array([fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]),
        binning_x=0,
        binning_y=0,
        roi=types["sensor_msgs/msg/RegionOfInterest"](x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
    )


def _image(header: Any, rows: npt.NDArray[Any], encoding: str, cloud: Cloud) -> Any:
    data = np.ascontiguousarray(rows.astype(rows.dtype.newbyteorder("<"))).view(np.uint8)
    return typestore().types[IMAGE](
        header=header,
        height=cloud.height,
        width=cloud.width,
        encoding=encoding,
        is_bigendian=0,
        step=data.shape[1],
        data=data.reshape(-1),
    )
