# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The true labels of a recording's clouds, found by stamp."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import Any

import numpy as np

from topo_region_seg.cloud.pointcloud2 import CloudFormatError
from topo_region_seg.data import LabelArray
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import POINT_CLOUD, decode_message
from topo_region_seg.offline.bags.records import BagError, BagReader, Topic
from topo_region_seg.offline.evaluation.labels import has_labels, labels_of
from topo_region_seg.offline.evaluation.source import Source

TRUTH_TOPIC = "/ground_truth/labels"
"""Where truth is looked for unless a topic is asked for."""


class RecordedTruth:
    """The true labels of one topic, by stamp. They are kept compressed: to a hundredth, as a rule.

    Attributes
    ----------
    rejected : list of (int, str, str)
        Stamp or log time in nanoseconds, reason code and text of every truth that cannot be read.
    problems : list of str
        A line for each damaged part of the recording that the truth was read from.
    """

    def __init__(self, reader: BagReader, topic: Topic, max_points: int) -> None:
        self.topic = topic.name
        self.rejected: list[tuple[int, str, str]] = []
        self._labels: dict[int, bytes] = {}
        for record in reader.messages([topic.name]):
            stamp = record.log_time
            try:
                msg = decode_message(record, topic)
                stamp = stamp_of(msg)
                self._labels[stamp] = zlib.compress(labels_of(msg, max_points=max_points), 1)
            except CloudFormatError as error:
                self.rejected.append((stamp, error.reason, f"truth on {topic.name}: {error.detail}"))
        self.problems = list(reader.problems)
        if reader.truncated:
            self.problems.append(f"{reader.path}: is cut short; the truth behind that is missing")

    def __len__(self) -> int:
        return len(self._labels)

    def of(self, msg: Any) -> LabelArray | None:
        """Return the true labels of the points of a cloud, (N,) uint32; None where there is none of its stamp."""
        packed = self._labels.get(stamp_of(msg))
        return None if packed is None else np.frombuffer(zlib.decompress(packed), np.uint32)


class CarriedTruth:
    """The true labels that the clouds carry themselves, in their field `label`."""

    topic = "the field 'label' of the clouds"

    def __init__(self, max_points: int) -> None:
        self.rejected: list[tuple[int, str, str]] = []
        self.problems: list[str] = []
        self._max_points = max_points

    def of(self, msg: Any) -> LabelArray | None:
        """Return the true labels of the points of a cloud, (N,) uint32; None for a cloud without the field."""
        return labels_of(msg, max_points=self._max_points) if has_labels(msg) else None


Truth = RecordedTruth | CarriedTruth


def find_truth(reader: BagReader, source: Source, max_points: int) -> Truth:
    """Return the truth of a recording: of the topic asked for, else of the usual one, else what the clouds carry.

    Raises
    ------
    BagError
        The topic asked for is not there, or there is no truth but the labels that are to be measured.
    """
    if source.truth_bag is None:
        return _in(reader, source, max_points)
    with open_bag(Path(source.truth_bag)) as other:
        return _in(other, source, max_points)


def stamp_of(msg: Any) -> int:
    """Return the stamp of a message, nanoseconds."""
    return int(msg.header.stamp.sec) * 10**9 + int(msg.header.stamp.nanosec)


def seconds(stamp: int) -> float:
    """Return nanoseconds in seconds, as the summary of a replay has them."""
    return stamp // 10**9 + stamp % 10**9 * 1e-9


def _in(reader: BagReader, source: Source, max_points: int) -> Truth:
    wanted = source.truth_topic or TRUTH_TOPIC
    clouds = [topic for topic in reader.topics if topic.type == POINT_CLOUD and topic.count]
    for topic in clouds:
        if topic.name.lstrip("/") == wanted.lstrip("/"):
            return RecordedTruth(reader, topic, max_points)
    if source.truth_topic is None and source.truth_bag is None and not source.recorded:
        return CarriedTruth(max_points)
    names = ", ".join(topic.name for topic in clouds) or "none"
    raise BagError(f"{reader.path}: has no truth on {wanted}; give --truth-topic (its topics of clouds: {names})")
