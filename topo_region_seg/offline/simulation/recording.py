# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of clouds or images with their truth, in the layout of an RGB-D driver."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from topo_region_seg.cloud.pointcloud2 import encode
from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.bags.clouds import POINT_CLOUD
from topo_region_seg.offline.bags.types import bag_types
from topo_region_seg.offline.bags.writer import BagWriter
from topo_region_seg.offline.simulation.camera import Camera
from topo_region_seg.offline.simulation.images import IMAGE_TOPICS, image_messages

CLOUD_TOPIC = "/camera/depth/points"
TRUTH_TOPIC = "/ground_truth/labels"
FRAME_ID = "camera_depth_optical_frame"
START = 1_700_000_000 * 10**9  # nanoseconds

# The layout of depth_image_proc: x0 y4 z8 rgb16 in steps of 32 bytes.
_POINT = np.dtype([("xyz", "<f4", 3), ("padding", "u1", 4), ("bgr", "u1", 3), ("more_padding", "u1", 13)])


def write_recording(
    path: str | Path,
    frames: Iterable[tuple[Cloud, LabelArray]],
    *,
    period: float = 0.1,
    start: int = START,
    frame_id: str = FRAME_ID,
    camera: Camera | None = None,
    clouds: bool = True,
    depth_encoding: str = "16UC1",
) -> int:
    """Write clouds, or the images of a camera, and the true labels of their points to a recording.

    Parameters
    ----------
    path : str or Path
        Output: ``NAME.mcap`` gives one file, any other name a rosbag2 folder.
    frames : iterable of (Cloud, (N,) uint32)
        Colored clouds with the true label of every point.
    period : float
        Time between frames, seconds.
    start : int
        Stamp of the first frame, nanoseconds.
    frame_id : str
        The sensor's frame.
    camera : Camera, optional
        Also write the depth images, color images and camera_info of this camera, which has seen all frames.
    clouds : bool
        Whether to write the clouds.
    depth_encoding : str
        "16UC1" or "32FC1".

    Returns
    -------
    int
        The number of frames.

    Raises
    ------
    BagError
        If the recording cannot be written.
    """
    count = 0
    with BagWriter(path) as bag:
        if clouds:
            bag.add_topic(CLOUD_TOPIC, POINT_CLOUD)
        for topic, kind in IMAGE_TOPICS.items() if camera else ():
            bag.add_topic(topic, kind)
        bag.add_topic(TRUTH_TOPIC, POINT_CLOUD)
        for count, (cloud, labels) in enumerate(frames, start=1):
            stamp = start + round((count - 1) * period * 1e9)
            header = make_header(stamp, frame_id)
            truth = encode(
                bag_types(), header, {"label": labels}, height=cloud.height, width=cloud.width, is_dense=True
            )
            if clouds:
                bag.write(CLOUD_TOPIC, stamp, camera_cloud(header, cloud))
            if camera:
                for topic, image in image_messages(header, cloud, camera, depth_encoding):
                    bag.write(topic, stamp, image)
            bag.write(TRUTH_TOPIC, stamp, truth)
    return count


def make_header(stamp: int, frame_id: str) -> Any:
    """Return a std_msgs/Header of rosbags for a stamp in nanoseconds."""
    types = bag_types()
    return types.Header(stamp=types.Time(sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id=frame_id)


def camera_cloud(header: Any, cloud: Cloud) -> Any:
    """Return the cloud as a sensor_msgs/PointCloud2 of rosbags in the layout of depth_image_proc.

    Raises
    ------
    ValueError
        If the cloud has no color.
    """
    if cloud.rgb is None:
        raise ValueError("the cloud has no color, which a camera's cloud must have")
    types = bag_types()
    points = np.zeros(len(cloud), dtype=_POINT)
    points["xyz"] = cloud.xyz
    points["bgr"] = cloud.rgb[:, ::-1]
    fields = [
        types.PointField(name=name, offset=offset, datatype=7, count=1)
        for name, offset in (("x", 0), ("y", 4), ("z", 8), ("rgb", 16))
    ]
    return types.PointCloud2(
        header=header,
        height=cloud.height,
        width=cloud.width,
        fields=fields,
        is_bigendian=False,
        point_step=_POINT.itemsize,
        row_step=_POINT.itemsize * cloud.width,
        data=points.view(np.uint8).reshape(-1),
        is_dense=False,
    )
