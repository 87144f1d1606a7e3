# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One topic of clouds in a recording: all messages are read, some clouds are measured."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from topo_region_seg.cloud.layout import COORDINATES
from topo_region_seg.cloud.pointcloud2 import CloudFormatError, decode
from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags.clouds import cloud_records, decode_message
from topo_region_seg.offline.bags.records import BagReader, Topic
from topo_region_seg.offline.bags.sensor_frame import SensorFrame
from topo_region_seg.offline.inspection.points import PointFigures, point_figures
from topo_region_seg.offline.inspection.suggest import Advice, suggest
from topo_region_seg.offline.sensor_figures import SensorFigures, sensor_figures
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.steps.view.resection import camera_pose

TYPES = {1: "i8", 2: "u8", 3: "i16", 4: "u16", 5: "i32", 6: "u32", 7: "f32", 8: "f64"}
NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class Layout:
    """The layout of a cloud in its message; `fields` such as "x f32 at 0"."""

    fields: tuple[str, ...]
    point_step: int
    height: int
    width: int
    is_dense: bool
    is_bigendian: bool
    frame_id: str


@dataclass
class TopicReport:
    """The findings on a topic.

    Parameters
    ----------
    topic : Topic
        Name, type and count according to the recording.
    layouts : Counter of Layout
        Number of clouds of each layout.
    unreadable : Counter of str
        Number of clouds that cannot be decoded, by reason.
    out_of_order : int
        Number of clouds with an earlier stamp than the cloud before.
    log_times : list of int
        Log times in recorded order, nanoseconds.
    figures : list of PointFigures
        Measurements of some clouds.
    advice : Advice or None
        Suggested parameters; None if the clouds have too few points.
    color : bool
        Whether the measured clouds have color.
    notices : dict of str to str
        What segmenting the measured clouds says of them, by code.
    sensor : SensorFigures or None
        What the first measured cloud that is a camera's image tells of the sensor.
    """

    topic: Topic
    layouts: Counter[Layout] = field(default_factory=Counter)
    unreadable: Counter[str] = field(default_factory=Counter)
    out_of_order: int = 0
    log_times: list[int] = field(default_factory=list)
    figures: list[PointFigures] = field(default_factory=list)
    advice: Advice | None = None
    color: bool = False
    notices: dict[str, str] = field(default_factory=dict)
    sensor: SensorFigures | None = None

    def rate(self) -> float | None:
        """Return clouds per second, from the median interval; None for fewer than two clouds."""
        steps = np.diff(np.sort(np.array(self.log_times, np.float64)))
        middle = float(np.median(steps)) if len(steps) else 0.0
        return NANOSECONDS / middle if middle > 0.0 else None


class TopicInspector:
    """Reads the messages of one topic and measures some of them.

    Parameters
    ----------
    topic : Topic
        The topic.
    samples : int
        Number of clouds to measure, spread evenly over the topic.
    """

    def __init__(self, topic: Topic, samples: int) -> None:
        self._topic = topic
        self._wanted = set(np.linspace(0, max(topic.count - 1, 0), max(samples, 1)).round().astype(int).tolist())
        self._report = TopicReport(topic)
        self._clouds: list[Cloud] = []
        self._last_stamp: tuple[int, int] | None = None

    def look(self, reader: BagReader) -> TopicReport:
        """Read all messages and return the findings."""
        sensor = SensorFrame(reader)
        for number, record in enumerate(cloud_records(reader, self._topic)):
            self._report.log_times.append(record.log_time)
            try:
                msg = decode_message(record, self._topic)
                self._report.layouts[layout_of(msg)] += 1
                self._order(msg.header.stamp)
                if {f.name for f in msg.fields}.issuperset(
                    COORDINATES
                ):  # others, such as truth, are not clouds to segment
                    cloud = decode(msg, max_points=Params().max_points)
                    self._clouds += [sensor.place(cloud, msg)] if number in self._wanted else []
            except CloudFormatError as error:
                self._report.unreadable[error.reason] += 1
        if sensor.note:
            self._report.notices["sensor_frame"] = sensor.note
        return self._measured()

    def _order(self, stamp: Any) -> None:
        now = int(stamp.sec), int(stamp.nanosec)
        if self._last_stamp is not None and now < self._last_stamp:
            self._report.out_of_order += 1
        self._last_stamp = now

    def _measured(self) -> TopicReport:
        report = self._report
        report.figures = [point_figures(cloud) for cloud in self._clouds]
        report.color = any(cloud.rgb is not None and len(cloud) > 0 for cloud in self._clouds)
        for cloud in self._clouds:
            features = "normals" if cloud.rgb is None else Params().features
            seg = Pipeline(Params(features=features)).run(cloud, lambda code, text: None)
            report.notices |= {notice.code: notice.text for notice in seg.notices}
            report.sensor = report.sensor or sensor_figures(cloud)
            camera = None if cloud.sensor_pose else camera_pose(cloud)
            if camera is not None:
                place = ", ".join(f"{value:.3f}" for value in camera.center)
                report.notices["camera_found"] = (
                    f"the clouds are in another frame than the camera's, which the image grid shows at ({place}) m; "
                    "the pipeline takes it from there, so sensor_pose need not be set"
                )
        report.advice = suggest(self._clouds, report.figures) if self._clouds else None
        return report


def layout_of(msg: Any) -> Layout:
    """Return the layout of a message."""
    return Layout(
        fields=tuple(_field(f) for f in msg.fields),
        point_step=int(msg.point_step),
        height=int(msg.height),
        width=int(msg.width),
        is_dense=bool(msg.is_dense),
        is_bigendian=bool(msg.is_bigendian),
        frame_id=str(msg.header.frame_id),
    )


def _field(point_field: Any) -> str:
    kind = TYPES.get(int(point_field.datatype), f"datatype {int(point_field.datatype)}")
    count = int(point_field.count)
    return f"{point_field.name} {kind}{f'[{count}]' if count != 1 else ''} at {int(point_field.offset)}"
