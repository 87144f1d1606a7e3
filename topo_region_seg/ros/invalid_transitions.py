# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Lifecycle transitions that the present state does not have: refused, where Jazzy's rclpy would end the process."""

from __future__ import annotations

from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode

from topo_region_seg.ros.rclpy_private import change_state_service, lifecycle_state


def refuse_invalid_transitions(node: LifecycleNode) -> None:
    """Let the node's service answer that a transition is not possible; rclpy's own lets the error end the process."""
    service = change_state_service(node)
    change_state = service.callback

    def answer(request: Any, response: Any) -> Any:
        try:
            return change_state(request, response)
        except rclpy_implementation.RCLError:
            node.get_logger().warning(f"transition refused: not possible in state '{lifecycle_state(node)}'")
            response.success = False
            return response

    service.callback = answer
