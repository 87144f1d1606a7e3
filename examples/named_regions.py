# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Joins `label_image` with the masks of a detector such as YOLO: which label is what. Needs rclpy and numpy."""

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Image


class NamedRegions(Node):
    """`masks` (mono8) has the number of an instance in each pixel, 0 for none; size and stamp are those of labels."""

    def __init__(self) -> None:
        super().__init__("named_regions")
        self.masks: dict[tuple[int, int], np.ndarray] = {}
        self.create_subscription(Image, "masks", self.on_masks, 5)
        self.create_subscription(Image, "label_image", self.on_labels, 5)

    def on_masks(self, msg: Image) -> None:
        """Keep those of the last ten frames: a detector may be quicker than the segmentation."""
        self.masks[msg.header.stamp.sec, msg.header.stamp.nanosec] = np.frombuffer(msg.data, "u1")
        self.masks = dict(list(self.masks.items())[-10:])

    def on_labels(self, msg: Image) -> None:
        """Say which label covers most of each instance."""
        masks = self.masks.get((msg.header.stamp.sec, msg.header.stamp.nanosec), np.zeros(msg.height * msg.width))
        for instance in np.unique(masks[masks > 0]):
            inside = np.frombuffer(msg.data, "<u2")[masks == instance]
            label = np.bincount(inside).argmax()
            self.get_logger().info(f"instance {instance}: label {label}, {np.mean(inside == label):.0%} of its pixels")


try:
    rclpy.init()
    rclpy.spin(NamedRegions())
except (KeyboardInterrupt, ExternalShutdownException):
    pass  # Ctrl-C, or told to stop
