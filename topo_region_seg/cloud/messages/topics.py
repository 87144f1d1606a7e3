# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of outputs: their names, their types, and how each is made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.detections import detections, surfaces
from topo_region_seg.cloud.messages.label_image import label_image
from topo_region_seg.cloud.messages.labeled import foreground_points, labeled_points, region_colors
from topo_region_seg.cloud.messages.markers import region_markers
from topo_region_seg.cloud.messages.tables import barcode, region_count, regions
from topo_region_seg.cloud.messages.types import MessageTypes


@dataclass(frozen=True)
class Output:
    """One output topic.

    Parameters
    ----------
    name : str
        Relative name.
    kind : str
        Type, such as ``std_msgs/msg/UInt32``.
    make : callable
        Makes the message; None where a frame has none.
    """

    name: str
    kind: str
    make: Callable[[MessageTypes, Answer], Any]

    def message_class(self, types: MessageTypes) -> Any:
        """Return the class of the messages, None where its package is missing."""
        return getattr(types, self.kind.rpartition("/")[2])


_CLOUD, _DETECTIONS = "sensor_msgs/msg/PointCloud2", "vision_msgs/msg/Detection3DArray"
OUTPUTS = (
    Output("labeled_points", _CLOUD, labeled_points),
    Output("region_count", "std_msgs/msg/UInt32", region_count),
    Output("regions", _CLOUD, regions),
    Output("barcode", _CLOUD, barcode),
    Output("region_markers", "visualization_msgs/msg/MarkerArray", region_markers),
    Output("region_colors", _CLOUD, region_colors),
    Output("detections", _DETECTIONS, detections),
    Output("surfaces", _DETECTIONS, surfaces),
    Output("label_image", "sensor_msgs/msg/Image", label_image),
    Output("foreground_points", _CLOUD, foreground_points),
)
CLOUDS = tuple(output.name for output in OUTPUTS if output.kind == _CLOUD)
"""Outputs that are clouds themselves."""
