# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A message, its cloud and its segmentation: all that output messages are made from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from topo_region_seg.beyond.boxes.oriented import OrientedBoxes, oriented_boxes
from topo_region_seg.data import Cloud
from topo_region_seg.segmentation import Segmentation
from topo_region_seg.steps.sensor import up_direction


def _ignore(code: str, text: str) -> None:
    """Do nothing with a warning."""


@dataclass(frozen=True)
class Answer:
    """What is known of a frame; what several messages need is made once, when the first of them asks for it.

    Parameters
    ----------
    msg : sensor_msgs/PointCloud2
        The input; its header is that of all outputs.
    cloud : Cloud
        The cloud in it.
    seg : Segmentation
        The result.
    pass_fields : tuple of str
        Fields of the input that labeled clouds carry on.
    warn : callable
        Called with code and text where a message cannot be made as it was asked for.
    """

    msg: Any
    cloud: Cloud
    seg: Segmentation
    pass_fields: tuple[str, ...] = ()
    warn: Callable[[str, str], None] = _ignore

    @property
    def header(self) -> Any:
        """The input's header."""
        return self.msg.header

    @cached_property
    def boxes(self) -> OrientedBoxes:
        """The oriented boxes of the regions, upright where up is known."""
        return oriented_boxes(self.seg, up_direction(self.cloud, self.seg.params))
