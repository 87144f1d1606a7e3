# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The user's `qos_overrides.*`: rclpy does not name one that is wrong, and ignores one that is misspelled."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSPolicyEnum, QoSPolicyKind, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

from topo_region_seg.parameter_table import ParameterError
from topo_region_seg.ros.rclpy_private import declared_parameters, given_parameters

PREFIX = "qos_overrides."
OF_EVERY_NODE = ("/parameter_events", "/rosout", "/clock")
"""Topics whose overrides other client libraries declare, so that a file for several nodes may hold them."""
WORDS: dict[str, type[QoSPolicyEnum]] = {
    "history": HistoryPolicy,
    "reliability": ReliabilityPolicy,
    "durability": DurabilityPolicy,
}
DEFAULT_KINDS = tuple(QoSOverridingOptions.with_default_policies().policy_kinds)


def name_of(topic: str, entity: str, policy: str) -> str:
    """Return the name of the parameter for a policy of a topic's "publisher" or "subscription"."""
    return f"{PREFIX}{topic}.{entity}.{policy}"


def overriding(
    node: Node, topic: str, entity: str, kinds: Sequence[QoSPolicyKind] = DEFAULT_KINDS
) -> QoSOverridingOptions:
    """Return the options with which rclpy applies the overrides of a topic, which are checked.

    Raises
    ------
    ParameterError
        A value is not one of its policy.
    """
    for kind in kinds:
        policy = kind.name.lower()
        name = name_of(node.resolve_topic_name(topic), entity, policy)
        if (given := given_parameters(node).get(name)) is None:
            continue
        if policy in WORDS:
            words = [word for word in WORDS[policy].short_keys() if word != "unknown"]
            if not isinstance(given.value, str) or given.value.lower() not in words:
                raise ParameterError(f"{name} = {given.value!r}: must be one of {', '.join(words)}")
        elif given.type_ != Parameter.Type.INTEGER or given.value < 0:
            raise ParameterError(f"{name} = {given.value!r}: must be a whole number")
    return QoSOverridingOptions(kinds)


def unused(node: Node, possible: Sequence[str]) -> list[str]:
    """Return a line for each override given at start that no topic of the node has declared.

    `possible` are names beside those declared that would be: some are declared only where they are given.
    """
    declared = [*possible, *(name for name in declared_parameters(node) if name.startswith(PREFIX))]
    lines = []
    for name in sorted(given_parameters(node)):
        elsewhere = name.startswith(tuple(f"{PREFIX}{topic}." for topic in OF_EVERY_NODE))
        if not name.startswith(PREFIX) or name in declared or elsewhere:
            continue
        near = difflib.get_close_matches(name, declared, n=1, cutoff=0.5)
        lines.append(f"unknown parameter '{name}' ignored" + (f"; did you mean '{near[0]}'?" if near else ""))
    return lines
