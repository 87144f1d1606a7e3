# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""All that is used of rclpy and is not public there, as nothing public says it; Jazzy and Kilted have the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.parameter import Parameter


def given_parameters(node: Node) -> dict[str, Parameter]:
    """Return the parameters given at start by name, declared or not; values put there count when one is declared."""
    found: dict[str, Parameter] = node._parameter_overrides
    return found


def declared_parameters(node: Node) -> Mapping[str, Parameter]:
    """Return all parameters that have been declared, those of rclpy's own included."""
    found: Mapping[str, Parameter] = node._parameters
    return found


def lifecycle_state(node: LifecycleNode) -> str:
    """Return the label of the present state."""
    return str(node._state_machine.current_state[1])


def change_state_service(node: LifecycleNode) -> Any:
    """Return the service that asks for transitions; its `callback` may be replaced."""
    return node._service_change_state
