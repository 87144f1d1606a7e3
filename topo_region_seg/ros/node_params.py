# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the node alone, beside those of the segmentation; no ROS import, so that the docs can list them."""

from __future__ import annotations

import re
from dataclasses import dataclass

from topo_region_seg.parameter_table import ParameterError, ParameterTable, parameter

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True)
class NodeParams(ParameterTable):
    """Parameters of `region_segmentation_node` that do not change what a cloud's labels are."""

    autostart: bool = parameter(
        True, "configure and activate the node at start; false = wait for the lifecycle services", live=False
    )
    cameras: tuple[str, ...] = parameter(
        (),
        "names of several cameras, read when the node is configured: the topics of each, and its service, begin with "
        "its name, as in `left/points`; empty = one camera, whose topics begin with nothing",
        texts=True,
    )
    input: str = parameter(
        "points",
        "what the node subscribes to, read at activation: clouds on `points`, or depth images on `depth/image` with "
        "`depth/camera_info` and, where color counts, `color/image`",
        choices=("points", "depth"),
    )
    depth_transport: str = parameter(
        "raw",
        "how depth images come, read at activation: as they are, or packed on `depth/image/compressedDepth`",
        choices=("raw", "compressedDepth"),
    )
    color_transport: str = parameter(
        "raw",
        "how color images come, read at activation: as they are, or packed on `color/image/compressed`",
        choices=("raw", "compressed"),
    )
    on_request: bool = parameter(
        False, "clouds are processed only when the service ~/segment_once asks for it, not for who subscribes"
    )
    request_timeout: float = parameter(
        5.0, "longest wait of ~/segment_once for the next cloud and its result", unit="s", low=0.1, high=600.0
    )
    rate_limit: float = parameter(
        0.0, "clouds processed a second at the most; 0 = all that can be", unit="Hz", low=0.0, high=1000.0
    )
    pass_fields: tuple[str, ...] = parameter(
        (), "other fields of the input to pass on in labeled_points and foreground_points", texts=True
    )
    input_reliability: str = parameter(
        "auto",
        "QoS reliability of the input, read at activation; auto = reliable until a best-effort publisher appears",
        choices=("auto", "best_effort", "reliable"),
    )
    input_timeout: float = parameter(
        5.0,
        "an active node without clouds for this long warns and reports an error; 0 = never",
        unit="s",
        low=0.0,
        high=3600.0,
    )
    sensor_frame: str = parameter(
        "",
        "frame of the sensor, for clouds in another frame: its place comes from TF, read at activation; needs tf2_ros; "
        "empty = sensor_pose, or as the cloud shows",
    )
    base_frame: str = parameter(
        "",
        "frame of the robot, from TF, read at activation: `up` (by default its z) and `crop_box` are in it; "
        "empty = they are in the frame of the clouds",
    )
    output_frame: str = parameter(
        "",
        "frame that clouds are moved to by TF before all else, and that all output is in, read at activation; "
        "empty = that of the input",
    )
    transform_timeout: float = parameter(
        0.1,
        "how long a frame waits for its transforms before it is rejected, read at activation",
        unit="s",
        low=0.0,
        high=1.0,
    )
    inactive_timeout: float = parameter(
        120.0,
        "a node that is not active for this long, and that nobody deactivated, reports an error; 0 = never",
        unit="s",
        low=0.0,
        high=86_400.0,
    )
    max_dropped: float = parameter(
        10.0,
        "share of clouds dropped for newer ones, over ten seconds, above which the diagnostics warn; 100 = never",
        unit="%",
        low=0.0,
        high=100.0,
    )
    max_latency: float = parameter(
        0.0,
        "median time from arrival to labels above which the diagnostics warn; 0 = never",
        unit="ms",
        low=0.0,
        high=60_000.0,
    )
    min_input_rate: float = parameter(
        0.0, "clouds a second below which the diagnostics warn; 0 = never", unit="Hz", low=0.0, high=1000.0
    )
    hardware_id: str = parameter(
        "", "what the diagnostics call the device, such as the serial number of the camera; empty = the clouds' frame"
    )
    warning_period: float = parameter(
        5.0, "warnings with the same reason are logged at most once in this time", unit="s", low=0.0, high=3600.0
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in self.cameras:
            if not NAME.fullmatch(name):
                raise ParameterError(f"cameras: {name!r} is no name for topics: letters, digits and _, no digit first")
            if self.cameras.count(name) > 1:
                raise ParameterError(f"cameras: {name!r} is there twice")
