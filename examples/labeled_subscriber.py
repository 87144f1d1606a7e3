# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A node that reads `labeled_points` and says where the largest region is. Needs rclpy and numpy."""

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2

TYPES = {7: "<f4", 6: "<u4"}  # PointField.FLOAT32 and UINT32


class LabeledSubscriber(Node):
    """Logs one line for each labeled cloud."""

    def __init__(self) -> None:
        super().__init__("labeled_subscriber")
        self.create_subscription(PointCloud2, "labeled_points", self.on_cloud, 1)

    def on_cloud(self, msg: PointCloud2) -> None:
        """Read the columns by name, whatever their order."""
        fields = {f.name: (TYPES[f.datatype], f.offset) for f in msg.fields if f.datatype in TYPES}
        formats, offsets = zip(*fields.values(), strict=True)
        layout = {"names": list(fields), "formats": formats, "offsets": offsets, "itemsize": msg.point_step}
        points = np.frombuffer(msg.data, np.dtype(layout))
        largest = points[points["label"] == 1]  # 0 = no region, 1 = the largest
        center = [float(np.mean(largest[axis])) for axis in "xyz"] if len(largest) else "nowhere"
        self.get_logger().info(f"{points['label'].max(initial=0)} regions; {len(largest)} points around {center}")


if __name__ == "__main__":
    try:
        rclpy.init()
        rclpy.spin(LabeledSubscriber())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass  # Ctrl-C, or told to stop
