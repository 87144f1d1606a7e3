# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The evaluation of a recording, or of some of its clouds: the same decoder and pipeline as the node's."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from itertools import islice, pairwise
from typing import Any

import numpy as np

from topo_region_seg.beyond.tracking.tracker import Tracker
from topo_region_seg.cloud.pointcloud2 import CloudFormatError, decode
from topo_region_seg.cloud.stamp import stamp_of
from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import cloud_records, cloud_topic, decode_message
from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Topic
from topo_region_seg.offline.bags.sensor_frame import SensorFrame
from topo_region_seg.offline.evaluation.identity import IdentityMeter
from topo_region_seg.offline.evaluation.labels import labels_of
from topo_region_seg.offline.evaluation.measures import TruthReading, measure
from topo_region_seg.offline.evaluation.results import BagResult, MeasuredFrame
from topo_region_seg.offline.evaluation.source import Source, Task
from topo_region_seg.offline.evaluation.truth import TruthInOrder, find_truth
from topo_region_seg.offline.evaluation.version import program_version
from topo_region_seg.offline.frames import Rejection, rounded
from topo_region_seg.offline.stamps import seconds
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline, warm_up

LABELED_POINTS = "/labeled_points"
"""The topic of labels that the node and ``replay`` write."""

FRAMES_A_TASK = 50
MOST_TASKS = 8
"""Tasks of one recording; each of them has to read past the clouds of the tasks before it."""


def tasks_of(source: Source, params: Params) -> list[Task]:
    """Return the tasks that make up the evaluation of a recording, wherever they will run.

    Raises
    ------
    BagError
        The recording cannot be opened or has no such clouds.
    """
    with open_bag(source.path) as reader:
        count = _topic(reader, source).count
    parts = 1 if _labels_go_on(source, params) else min(-(-count // FRAMES_A_TASK), MOST_TASKS)
    bounds = [count * part // parts for part in range(parts + 1)]
    version = program_version()
    return [
        Task(source, params, version, first, None if end == count else end, end - first)
        for first, end in pairwise(bounds)
    ]


def evaluate(
    task: Task, step: Callable[[], None] = lambda: None, stopped: Callable[[], bool] = lambda: False
) -> BagResult:
    """Measure the clouds of a task; the result also says what could not be measured.

    Parameters
    ----------
    task : Task
        The clouds and parameters.
    step : callable
        Called after each cloud.
    stopped : callable
        Called before each cloud; once it returns true, the result is that of the clouds so far.
    """
    result = BagResult(task.source.bag)
    if task.version != program_version():
        result.error = (
            f"{task.source.bag}: the worker has topo_region_seg {program_version()}, not {task.version}; "
            "install the same version on all machines"
        )
        return result
    try:
        with open_bag(task.source.path) as reader:
            _evaluate(task, reader, result, step, stopped)
            result.problems += [problem for problem in dict.fromkeys(reader.problems) if problem not in result.problems]
            result.truncated = reader.truncated
    except BagError as error:
        result.error = str(error)
    return result


def _evaluate(
    task: Task, reader: BagReader, result: BagResult, step: Callable[[], None], stopped: Callable[[], bool]
) -> None:
    source, limit = task.source, task.params.point_limit
    topic = _topic(reader, source)
    truth = find_truth(reader, source, limit)
    result.topic, result.truth = topic.name, truth.topic  # both stay empty where there is nothing to measure
    if source.truth_bag is not None:
        result.problems += truth.problems
    if task.first == 0:
        result.rejected += truth.rejected
    if not source.recorded:
        load_kernels()
    sensor = SensorFrame(reader)
    label = _Recorded(limit) if source.recorded else _Segmented(task.params, result)
    meter = IdentityMeter(source.reading) if _labels_go_on(source, task.params) else None
    ordered = TruthInOrder(truth, reader, topic)
    records = cloud_records(reader, topic)
    for record in islice(records, task.first):
        ordered.skip(record)
    for record in islice(records, None if task.end is None else task.end - task.first):
        if stopped():
            break
        _measure(record, topic, ordered, sensor, label, limit, source.reading, meter, result)
        step()
    result.repeated = ordered.repeated
    result.identity = meter.identity() if meter and result.frames else None
    if sensor.note:
        result.notices.setdefault("sensor_frame", sensor.note)


def _measure(
    record: Record,
    topic: Topic,
    truth: TruthInOrder,
    sensor: SensorFrame,
    label: _Recorded | _Segmented,
    limit: int,
    reading: TruthReading,
    meter: IdentityMeter | None,
    result: BagResult,
) -> None:
    stamp = record.log_time
    try:
        started = time.perf_counter()
        msg = decode_message(record, topic)
        read = time.perf_counter() - started
        stamp = stamp_of(msg)
        true_labels = truth.of(msg)
        if true_labels is None:
            result.without_truth += 1
            if label.needs_all:
                with suppress(Exception):  # a bad cloud is already counted, as one without truth
                    cloud = decode(msg, max_points=limit, needs_color=label.needs_color)
                    label(msg, sensor.place(cloud, msg))
            return
        started = time.perf_counter() - read
        cloud = sensor.place(decode(msg, max_points=limit, needs_color=label.needs_color), msg)
        decoded = time.perf_counter()
        labels, stages = label(msg, cloud)
        done = time.perf_counter()
        if len(true_labels) != len(cloud):
            raise CloudFormatError("truth_size", f"{len(true_labels)} true labels for {len(cloud)} points")
        valid = np.isfinite(cloud.xyz).all(axis=1)
        measures = measure(true_labels, labels, valid, cloud.height, cloud.width, reading)
        if meter:
            meter.add(true_labels, labels, valid, cloud.height, cloud.width)
    except Exception as error:  # one bad frame never ends an evaluation
        result.rejected.append(Rejection.of(seconds(stamp), error))
    else:
        ms = {"decode": 1e3 * (decoded - started), **stages, "total": 1e3 * (done - started)}
        regions = len(np.unique(labels[labels > 0]))
        result.frames.append(MeasuredFrame(seconds(stamp), len(cloud), regions, rounded(ms), measures))


def _labels_go_on(source: Source, params: Params) -> bool:
    """Whether labels are meant to stay from frame to frame, so that all clouds are needed in order."""
    return source.recorded or params.track_regions


class _Segmented:
    """Labels a stream's clouds as the node does."""

    def __init__(self, params: Params, result: BagResult) -> None:
        self.needs_all = params.track_regions
        self._pipeline, self._tracker, self._result = Pipeline(params), Tracker(), result
        self.needs_color = self._pipeline.needs_color

    def __call__(self, msg: Any, cloud: Cloud) -> tuple[LabelArray, dict[str, float]]:
        seg = self._pipeline.run(cloud, self._warn)
        header = msg.header
        stamp = header.stamp.sec + header.stamp.nanosec * 1e-9
        seg = self._tracker.follow(cloud, seg, stamp, header.frame_id, self._warn)
        return seg.labels, seg.ms

    def _warn(self, code: str, text: str) -> None:
        self._result.notices.setdefault(code, text)


class _Recorded:
    """Takes the labels that the clouds carry."""

    needs_all = False
    needs_color = False

    def __init__(self, limit: int) -> None:
        self._limit = limit

    def __call__(self, msg: Any, cloud: Cloud) -> tuple[LabelArray, dict[str, float]]:
        return labels_of(msg, max_points=self._limit), {}


def _topic(reader: BagReader, source: Source) -> Topic:
    """Return the topic of the clouds; for recorded labels, that of the node if there is one."""
    topic = source.topic
    if topic is None and source.recorded and reader.count(LABELED_POINTS):
        topic = LABELED_POINTS
    return cloud_topic(reader, topic)


@lru_cache(maxsize=1)
def load_kernels() -> None:
    """Load the kernels, once per process and before anything is timed; the first run on a machine compiles them."""
    warm_up()
