# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What a camera has sent at one moment: a cloud, or a depth image with what belongs to it."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

from topo_region_seg.cloud.depth_image import decode_depth
from topo_region_seg.cloud.layout import Warn
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.data import Cloud


@dataclass(frozen=True)
class Frame:
    """A message and when it arrived (monotonic clock, seconds); answers have its header."""

    msg: Any
    arrived: float = field(default_factory=time.monotonic)

    def decode(self, *, max_points: int, warn: Warn, needs_color: bool) -> Cloud:
        """Return the cloud; raises as :func:`topo_region_seg.cloud.pointcloud2.decode`."""
        return decode(self.msg, max_points=max_points, warn=warn, needs_color=needs_color)


@dataclass(frozen=True)
class DepthFrame(Frame):
    """A depth image, its camera_info and the color image that belongs to it, None for none.

    `rectified` tells whether a distortion of the camera has been taken off the image.
    """

    info: Any = None
    color: Any = None
    rectified: bool = False

    def decode(self, *, max_points: int, warn: Warn, needs_color: bool) -> Cloud:
        """Return the cloud; raises as :func:`topo_region_seg.cloud.depth_image.decode_depth`."""
        return decode_depth(
            self.msg,
            self.info,
            self.color,
            max_points=max_points,
            rectified=self.rectified,
            warn=warn,
            needs_color=needs_color,
        )
