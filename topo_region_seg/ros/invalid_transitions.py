# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Lifecycle transitions that the present state does not have: refused, where rclpy would end the process."""

from __future__ import annotations

from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode


def refuse_invalid_transitions(node: LifecycleNode) -> None:
    """Let the node's service answer that a transition is not possible; rclpy's own lets the error end the process."""
    service = node._service_change_state
    change_state = service.callback

    def answer(request: Any, response: Any) -> Any:
        try:
            return change_state(request, response)
        except rclpy_implementation.RCLError:
            state = node._state_machine.current_state[1]
            node.get_logger().warning(f"transition refused: not possible in state '{state}'")
            response.success = False
            return response

    service.callback = answer
