# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Listens to topics and hands on the messages as they come over the wire."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from types import TracebackType
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile

OnMessage = Callable[[str, bytes], None]
"""Called with the topic and the CDR bytes."""

DEPTH = 50


class Listener:
    """A node that subscribes to topics, serialized messages wanted; a context manager.

    Parameters
    ----------
    topics : mapping of str to str
        Absolute names and types, such as ``/region_count`` and ``std_msgs/msg/UInt32``.
    domain : int
        The ROS domain.
    on_message : callable
        Called from :meth:`spin` for every message.
    """

    def __init__(self, topics: Mapping[str, str], domain: int, on_message: OnMessage) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        self._node = rclpy.create_node("topo_region_seg_listener", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        for topic, kind in topics.items():
            self._node.create_subscription(
                message_class(kind), topic, partial(on_message, topic), QoSProfile(depth=DEPTH), raw=True
            )

    def spin(self, until: Callable[[], bool], timeout: float) -> bool:
        """Hand on messages until the condition holds; return whether it does, False after `timeout` seconds."""
        end = time.monotonic() + timeout
        while not until():
            if time.monotonic() > end:
                return False
            self._executor.spin_once(timeout_sec=0.05)
        return True

    def publishers(self, topic: str) -> int:
        """Return how many publishers of a topic are known."""
        return int(self._node.count_publishers(topic))

    def __enter__(self) -> Listener:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)


def message_class(name: str) -> Any:
    """Return the class of a type such as ``std_msgs/msg/UInt32``."""
    package, folder, kind = name.split("/")
    return getattr(import_module(f"{package}.{folder}"), kind)
