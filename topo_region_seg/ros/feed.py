# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Whose frames are taken and answered: what all parts of the way of one camera's frames share."""

from __future__ import annotations

from dataclasses import dataclass, field

from rclpy.lifecycle import LifecycleNode

from topo_region_seg.ros.log import ReasonLog
from topo_region_seg.ros.statistics import Statistics


@dataclass(frozen=True)
class Feed:
    """The frames of one camera.

    Parameters
    ----------
    node : LifecycleNode
        The node that takes and answers them.
    log : ReasonLog
        For what is wrong with them, or with who publishes them.
    name : str
        What the topics of the camera begin with; empty where the node has one camera.
    statistics : Statistics
        Counts and times them.
    """

    node: LifecycleNode
    log: ReasonLog
    name: str = ""
    statistics: Statistics = field(default_factory=Statistics)

    def topic(self, name: str) -> str:
        """Return a name as it is for this camera, before remapping."""
        return f"{self.name}/{name}" if self.name else name
