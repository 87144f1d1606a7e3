# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The quality of service with which the input hears every publisher, and as well as it can.

A reliable subscription does not hear best-effort publishers; a best-effort one hears everybody, but Fast DDS then
loses most clouds of a megabyte and more. A volatile subscription gets nothing that was published before it was there,
such as the one cloud of a publisher that latches; a transient-local one does not hear volatile publishers. So the
subscription is reliable until a best-effort publisher appears, and transient local while all publishers are.
"""

from __future__ import annotations

from dataclasses import dataclass

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy

from topo_region_seg.ros.qos_overrides import name_of
from topo_region_seg.ros.rclpy_private import given_parameters

FOLLOWED = (QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY)


@dataclass(frozen=True)
class Quality:
    """The policies of a subscription that follow the publishers."""

    reliability: ReliabilityPolicy
    durability: DurabilityPolicy

    def profile(self, depth: int = 1) -> QoSProfile:
        """Return a profile of some depth."""
        return QoSProfile(depth=depth, reliability=self.reliability, durability=self.durability)

    def __str__(self) -> str:
        return f"{self.reliability.name}, {self.durability.name}".lower()


class InputQuality:
    """Say what quality the subscription to a topic is to have at present.

    Parameters
    ----------
    node : Node
        The node that subscribes.
    topic : str
        Full name.
    reliability : str
        "auto" follows the publishers; "best_effort" and "reliable" stay. A QoS override goes before either.

    Attributes
    ----------
    publishers : int
        How many there were when :meth:`wanted` was last asked.
    followed : set of QoSPolicyKind
        Policies that neither a parameter nor an override holds.
    overridable : list of QoSPolicyKind
        Policies to be declared as overrides: those that are followed are not, as a declared one holds the value of the
        first subscription for good.
    """

    def __init__(self, node: Node, topic: str, reliability: str) -> None:
        self._node = node
        self._topic = topic
        self.publishers = 0
        overridden = {kind for kind in FOLLOWED if self.override(kind) in given_parameters(node)}
        self.overridable = [QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, *sorted(overridden)]
        self.followed = set(FOLLOWED) - overridden
        self._reliability = ReliabilityPolicy.RELIABLE
        if reliability != "auto":
            self.followed.discard(QoSPolicyKind.RELIABILITY)
            self._reliability = ReliabilityPolicy[reliability.upper()]

    def override(self, kind: QoSPolicyKind) -> str:
        """Return the name of the parameter that overrides a policy."""
        return name_of(self._topic, "subscription", kind.name.lower())

    def wanted(self) -> Quality:
        """Return what hears all publishers that are there."""
        profiles = [info.qos_profile for info in self._node.get_publishers_info_by_topic(self._topic)]
        self.publishers = len(profiles)
        reliability, durability = self._reliability, DurabilityPolicy.VOLATILE
        if QoSPolicyKind.RELIABILITY in self.followed:
            modest = any(profile.reliability == ReliabilityPolicy.BEST_EFFORT for profile in profiles)
            reliability = ReliabilityPolicy.BEST_EFFORT if modest else ReliabilityPolicy.RELIABLE
        if QoSPolicyKind.DURABILITY in self.followed and profiles:
            latched = all(profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for profile in profiles)
            durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        return Quality(reliability, durability)
