# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The input that the parameters ask for."""

from __future__ import annotations

from topo_region_seg.pipeline import Pipeline
from topo_region_seg.ros.depth_input import DepthInput
from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.input import FrameSource, Input
from topo_region_seg.ros.node_params import NodeParams
from topo_region_seg.ros.processor import FrameProcessor


def open_input(feed: Feed, processor: FrameProcessor, settings: NodeParams) -> FrameSource:
    """Subscribe to clouds or depth images; raises ParameterError for an invalid QoS override."""
    if settings.input == "depth":
        return DepthInput(feed, processor.process, settings, lambda: color_counts(processor.pipeline))
    return Input(feed, processor.process, settings.input_reliability)


def color_counts(pipeline: Pipeline) -> bool | None:
    """Return whether labels depend on color (True), it is of use, as for the mean colors of objects (None), or not."""
    if pipeline.needs_color:
        return True
    return None if pipeline.params.output == "objects" else False
