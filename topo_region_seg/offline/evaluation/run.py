# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The evaluation of a recording, or of some of its clouds: the same decoder and pipeline as the node's."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache
from itertools import islice, pairwise
from typing import Any

import numpy as np

from topo_region_seg.cloud.pointcloud2 import CloudFormatError, decode
from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message
from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Topic
from topo_region_seg.offline.evaluation.labels import labels_of
from topo_region_seg.offline.evaluation.measures import measure
from topo_region_seg.offline.evaluation.results import BagResult, FrameResult, Rejected
from topo_region_seg.offline.evaluation.source import Source, Task
from topo_region_seg.offline.evaluation.truth import Truth, find_truth, seconds, stamp_of
from topo_region_seg.offline.evaluation.version import program_version
from topo_region_seg.params import Params
from topo_region_seg.pipeline import MissingColorError, Pipeline, warm_up

LABELED_POINTS = "/labeled_points"
"""Where the node and the replay put their labels."""

FRAMES_A_TASK = 50
MOST_TASKS = 8
"""Tasks of one recording: each of them reads past the clouds of those before it."""


def tasks_of(source: Source, params: Params) -> list[Task]:
    """Return the tasks that make up the evaluation of a recording; they do not depend on who does them.

    Raises
    ------
    BagError
        The recording cannot be opened or has no such clouds.
    """
    with open_bag(source.path) as reader:
        count = _topic(reader, source).count
    parts = min(-(-count // FRAMES_A_TASK), MOST_TASKS)
    bounds = [count * part // parts for part in range(parts + 1)]
    version = program_version()
    return [
        Task(source, params, version, first, None if end == count else end, end - first)
        for first, end in pairwise(bounds)
    ]


def evaluate(
    task: Task, step: Callable[[], None] = lambda: None, stopped: Callable[[], bool] = lambda: False
) -> BagResult:
    """Measure the clouds of a task; what cannot be measured is noted in the result.

    Parameters
    ----------
    task : Task
        What to do.
    step : callable
        Called after each cloud.
    stopped : callable
        Asked before each cloud; once it says true, the result is that of the clouds until then.
    """
    result = BagResult(task.source.bag)
    if task.version != program_version():
        result.error = (
            f"{task.source.bag}: the worker has topo_region_seg {program_version()}, not {task.version}; "
            "install the same on all machines"
        )
        return result
    try:
        with open_bag(task.source.path) as reader:
            _evaluate(task, reader, result, step, stopped)
            result.problems += reader.problems
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
    result.topic, result.truth = topic.name, truth.topic  # empty where there is nothing to measure
    if source.truth_bag is not None:
        result.problems += truth.problems
    if task.first == 0:
        result.rejected += [Rejected(seconds(stamp), reason, text) for stamp, reason, text in truth.rejected]
    if not source.recorded:
        load_kernels()
    pipeline = Pipeline(task.params)
    for record in islice(reader.messages([topic.name]), task.first, task.end):
        if stopped():
            return
        _measure(record, topic, truth, pipeline, source.recorded, result)
        step()


def _measure(record: Record, topic: Topic, truth: Truth, pipeline: Pipeline, recorded: bool, result: BagResult) -> None:
    stamp = record.log_time
    try:
        started = time.perf_counter()
        msg = decode_message(record, topic)
        read = time.perf_counter() - started
        stamp = stamp_of(msg)
        true_labels = truth.of(msg)
        if true_labels is None:
            result.without_truth += 1
            return
        started = time.perf_counter() - read
        cloud = decode(msg, max_points=pipeline.params.point_limit)
        if len(true_labels) != len(cloud):
            raise CloudFormatError("truth_size", f"{len(true_labels)} true labels for {len(cloud)} points")
        decoded = time.perf_counter()
        labels, stages = _recorded(msg, pipeline) if recorded else _segmented(cloud, pipeline)
        done = time.perf_counter()
        valid = np.isfinite(cloud.xyz).all(axis=1)
        measures = measure(true_labels, labels, valid, cloud.height, cloud.width)
    except CloudFormatError as error:
        result.rejected.append(Rejected(seconds(stamp), error.reason, error.detail))
    except MissingColorError as error:
        result.rejected.append(Rejected(seconds(stamp), "missing_color", str(error)))
    except Exception as error:  # one bad frame never ends an evaluation
        text = " ".join(f"{type(error).__name__}: {error}".split())
        result.rejected.append(Rejected(seconds(stamp), "internal_error", text))
    else:
        ms = {"decode": 1e3 * (decoded - started), **stages, "total": 1e3 * (done - started)}
        regions = len(np.unique(labels[labels > 0]))
        rounded = {stage: round(value, 3) for stage, value in ms.items()}
        result.frames.append(FrameResult(seconds(stamp), len(cloud), regions, measures, rounded))


def _segmented(cloud: Cloud, pipeline: Pipeline) -> tuple[LabelArray, dict[str, float]]:
    seg = pipeline.run(cloud)
    return seg.labels, seg.ms


def _recorded(msg: Any, pipeline: Pipeline) -> tuple[LabelArray, dict[str, float]]:
    return labels_of(msg, max_points=pipeline.params.point_limit), {}


def _topic(reader: BagReader, source: Source) -> Topic:
    """Return the topic of the clouds; for recorded labels that of the node, if it is there."""
    topic = source.topic
    if topic is None and source.recorded and reader.count(LABELED_POINTS):
        topic = LABELED_POINTS
    return cloud_topic(reader, topic)


@lru_cache(maxsize=1)
def load_kernels() -> None:
    """Load the kernels, once in a process and before anything is timed; the first time on a machine compiles them."""
    warm_up()
