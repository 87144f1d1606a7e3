# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Detections as boxes in MoveIt's planning scene, those that have gone taken out. Needs vision_msgs and moveit_msgs."""

import rclpy
from geometry_msgs.msg import Pose
from moveit_msgs.msg import CollisionObject
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from shape_msgs.msg import SolidPrimitive
from vision_msgs.msg import Detection3DArray


class CollisionObjects(Node):
    """Publishes to `collision_object`, which move_group reads; start the segmentation with track_regions."""

    def __init__(self) -> None:
        super().__init__("collision_objects")
        self.there: set[str] = set()
        self.publisher = self.create_publisher(CollisionObject, "collision_object", 100)
        self.create_subscription(Detection3DArray, "detections", self.on_detections, 1)

    def on_detections(self, msg: Detection3DArray) -> None:
        """Add what is seen, or replace it; remove what is not."""
        seen = {f"object_{found.id}": found.bbox for found in msg.detections}
        for name in sorted(self.there | set(seen)):
            thing = CollisionObject(header=msg.header, id=name, operation=CollisionObject.REMOVE)
            if box := seen.get(name):
                size = [max(value, 0.001) for value in (box.size.x, box.size.y, box.size.z)]
                thing.operation, thing.pose, thing.primitive_poses = CollisionObject.ADD, box.center, [Pose()]
                thing.primitives = [SolidPrimitive(type=SolidPrimitive.BOX, dimensions=size)]
            self.publisher.publish(thing)
        self.there = set(seen)


try:
    rclpy.init()
    rclpy.spin(CollisionObjects())
except (KeyboardInterrupt, ExternalShutdownException):
    pass  # Ctrl-C, or told to stop
