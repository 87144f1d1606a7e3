# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The other side of the node in the soak test: sends clouds, hears labels and diagnostics, calls services."""

from __future__ import annotations

import struct
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo, Image, PointCloud2

from benchmarks.soak_frames import Frame
from benchmarks.tabletops import EYE, FRAME, camera

NODE = "/region_segmentation"
PATIENCE = 600.0
"""Seconds; the first start compiles the kernels."""
KINDS: dict[str, dict[str, Any]] = {
    "points": {"points": PointCloud2},
    "depth": {"depth/camera_info": CameraInfo, "color/image": Image, "depth/image": Image},
}
"""What a camera publishes."""
QUEUED = {"points": 1, "depth/image": 1, "depth/camera_info": 4, "color/image": 4}
"""Messages that it keeps for those that have not come in."""


class SoakClient:
    """A node with an executor on a thread of its own."""

    def __init__(self, domain: int, kind: str = "points") -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        self._node = rclpy.create_node("soak", context=self._context)
        self._kinds = KINDS[kind]
        self._publishers: dict[str, Publisher] = {}
        latched = QoSProfile(depth=20, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._transforms = self._node.create_publisher(TransformStamped, "/tf_standin", latched)
        self._sent_at: dict[int, float] = {}
        self._latencies: list[float] = []
        self._services: list[float] = []
        self._figures: dict[str, str] = {}
        self.answered: set[int] = set()
        # Labels are taken as bytes: only the stamp at their head is of interest.
        self._node.create_subscription(PointCloud2, "labeled_points", self._hear, QoSProfile(depth=10), raw=True)
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._note, 10)
        self._set = self._node.create_client(SetParametersAtomically, f"{NODE}/set_parameters_atomically")
        self._change = self._node.create_client(ChangeState, f"{NODE}/change_state")
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread and leave."""
        self._executor.shutdown()
        self._thread.join(10)
        rclpy.try_shutdown(context=self._context)

    def wait_for_node(self) -> None:
        """Wait for the node to be active."""
        _wait(lambda: self._figures.get("state") == "active", "the node to become active")

    def connect(self) -> None:
        """Create the publishers of a camera and wait until the node hears them."""
        for topic, kind in self._kinds.items():
            self._publishers[topic] = self._node.create_publisher(kind, topic, QoSProfile(depth=QUEUED[topic]))
        self.wait_until_matched()

    def wait_until_matched(self) -> None:
        """Wait until publisher and node know each other."""
        counting = list(self._publishers.values())[-1]  # color is not subscribed to where it does not count
        _wait(lambda: counting.get_subscription_count() == 1, "the node to subscribe")
        time.sleep(0.5)  # the other side may learn of it later

    def disconnect(self) -> None:
        """Destroy the publishers."""
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)
        self._publishers.clear()

    def send(self, number: int, frame: Frame) -> None:
        """Send a serialized frame with `number` for the seconds of its stamp."""
        self._sent_at[number] = time.monotonic()
        for topic, data in frame.items():
            self._publishers[topic].publish(data[:4] + struct.pack("<i", number) + data[8:])

    def place_camera(self, known: bool) -> None:
        """Say where the camera is, or have all transforms forgotten."""
        msg = TransformStamped(child_frame_id=FRAME if known else "clear")
        msg.header.frame_id = "base_link"
        turn, place = msg.transform.rotation, msg.transform.translation
        turn.x, turn.y, turn.z, turn.w = Rotation.from_matrix(camera(640, 480).rotation).as_quat().tolist()
        place.x, place.y, place.z = EYE
        self._transforms.publish(msg)

    def set_parameters(self, values: Mapping[str, Any]) -> bool:
        """Set parameters at once; return whether the node took them."""
        messages = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
        answer = self._call(self._set, SetParametersAtomically.Request(parameters=messages), timed=True)
        return bool(answer.result.successful)

    def change_state(self, transition: str) -> None:
        """Ask for a lifecycle transition; it must succeed."""
        request = ChangeState.Request()
        request.transition.id = {"configure": 1, "cleanup": 2, "activate": 3, "deactivate": 4}[transition]
        if not self._call(self._change, request, timed=False).success:
            raise RuntimeError(f"the transition {transition} failed")

    def final_figures(self) -> dict[str, str]:
        """Return the node's diagnostics once they stand still."""
        before: dict[str, str] = {}

        def still() -> bool:
            nonlocal before
            time.sleep(1.5)
            same = all(before.get(key) == value for key, value in self._figures.items() if key.startswith("clouds"))
            before = dict(self._figures)
            return same

        _wait(still, "the counts to stand still")
        return before

    def latencies(self) -> dict[str, float]:
        """Return percentiles of the time from sending a cloud to hearing its labels, ms."""
        return _percentiles(self._latencies)

    def service_times(self) -> dict[str, float]:
        """Return percentiles of the time that parameter services took, ms."""
        return _percentiles(self._services)

    def _hear(self, data: bytes) -> None:
        number = struct.unpack_from("<i", data, 4)[0]
        self.answered.add(number)
        self._latencies.append(1e3 * (time.monotonic() - self._sent_at.pop(number)))
        for old in [key for key in list(self._sent_at) if key < number]:  # another thread adds to it
            del self._sent_at[old]

    def _note(self, report: DiagnosticArray) -> None:
        self._figures = {item.key: item.value for item in report.status[0].values}

    def _call(self, client: Any, request: Any, *, timed: bool) -> Any:
        if not client.wait_for_service(PATIENCE):
            raise RuntimeError(f"service {client.srv_name} is missing")
        answered = threading.Event()
        started = time.monotonic()
        future = client.call_async(request)
        future.add_done_callback(lambda _: answered.set())
        if not answered.wait(PATIENCE):
            raise RuntimeError(f"no answer from {client.srv_name}")
        if timed:
            self._services.append(1e3 * (time.monotonic() - started))
        return future.result()


def _wait(condition: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise RuntimeError(f"waited {PATIENCE:.0f} s in vain for {what}")
        time.sleep(0.05)


def _percentiles(values: list[float]) -> dict[str, float]:
    if not values:
        return {}
    shares = {"median": 50, "95 %": 95, "99 %": 99, "max": 100}
    return {name: round(float(np.percentile(values, share)), 1) for name, share in shares.items()}
