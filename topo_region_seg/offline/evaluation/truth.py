# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The true labels of a recording's clouds, found by stamp."""

from __future__ import annotations

import zlib
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from topo_region_seg.cloud.pointcloud2 import CloudFormatError
from topo_region_seg.cloud.stamp import stamp_of
from topo_region_seg.data import LabelArray
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import POINT_CLOUD, cloud_records, decode_message
from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Topic
from topo_region_seg.offline.evaluation.labels import has_labels, labels_of
from topo_region_seg.offline.evaluation.source import Source
from topo_region_seg.offline.frames import Rejection
from topo_region_seg.offline.stamps import seconds

TRUTH_TOPIC = "/ground_truth/labels"
"""Where truth is looked for unless a topic is asked for."""


class RecordedTruth:
    """The true labels of one topic, by stamp. They are kept compressed, usually to a hundredth of their size.

    Attributes
    ----------
    topic : str
        Its name.
    rejected : list of Rejection
        Truth messages that cannot be read.
    problems : list of str
        A line for each damaged part of the recording that the truth was read from.
    repeats : bool
        Whether any two truth messages have the same stamp.
    """

    def __init__(self, reader: BagReader, topic: Topic, max_points: int) -> None:
        self.topic = topic.name
        self.rejected: list[Rejection] = []
        self._labels: dict[int, list[bytes | None]] = defaultdict(list)  # None: cannot be read
        for record in reader.messages([topic.name]):
            stamp = None
            try:
                msg = decode_message(record, topic)
                stamp = stamp_of(msg)
                packed = zlib.compress(labels_of(msg, max_points=max_points), 1)
            except CloudFormatError as error:
                when = seconds(record.log_time if stamp is None else stamp)
                self.rejected.append(Rejection(when, error.reason, f"truth on {topic.name}: {error.detail}"))
                packed = None
            if stamp is not None:
                self._labels[stamp].append(packed)
        self.repeats = any(len(known) > 1 for known in self._labels.values())
        self.problems = list(reader.problems)
        if reader.truncated:
            self.problems.append(f"{reader.path}: is cut short; the truth after that point is missing")

    def __len__(self) -> int:
        return sum(len(known) for known in self._labels.values())

    def of(self, stamp: int, place: int = 0, clouds: int | None = None) -> LabelArray | None:
        """Return the true labels of the points of a cloud, (N,) uint32; None where there is none of its stamp.

        Parameters
        ----------
        stamp : int
            Of the cloud, nanoseconds.
        place : int
            Number of clouds of the same stamp before it: the second cloud goes with the second truth.
        clouds : int, optional
            Number of clouds of the stamp in all, where it is known.

        Raises
        ------
        CloudFormatError
            `repeated_stamp`: the stamp has other numbers of clouds and of truths, so the pairs are not known.
        """
        known = self._labels.get(stamp)
        if not known:
            return None
        if place >= len(known) or (clouds is not None and clouds != len(known)):
            count = f"at least {place + 1}" if clouds is None else f"{clouds}"
            raise CloudFormatError(
                "repeated_stamp",
                f"clouds of this stamp: {count}, truths: {len(known)}, so which belong together is not known",
            )
        packed = known[place]
        return None if packed is None else np.frombuffer(zlib.decompress(packed), np.uint32)


class CarriedTruth:
    """The true labels in the field `label` of the clouds themselves."""

    topic = "the field 'label' of the clouds"

    def __init__(self, max_points: int) -> None:
        self.rejected: list[Rejection] = []
        self.problems: list[str] = []
        self._max_points = max_points

    def of(self, msg: Any) -> LabelArray | None:
        """Return the true labels of the points of a cloud, (N,) uint32; None for a cloud without the field."""
        return labels_of(msg, max_points=self._max_points) if has_labels(msg) else None


Truth = RecordedTruth | CarriedTruth


class TruthInOrder:
    """The truth of a recording's clouds, which are asked for or passed over one after the other.

    Parameters
    ----------
    truth : RecordedTruth or CarriedTruth
        Where the truth is. If stamps repeat in it, the clouds are read once more beforehand to count theirs.
    reader : BagReader
        The recording of the clouds.
    topic : Topic
        Their topic.

    Attributes
    ----------
    repeated : int
        Number of clouds so far that were paired by their order, as other clouds have the same stamp.
    """

    def __init__(self, truth: Truth, reader: BagReader, topic: Topic) -> None:
        self._truth, self._topic = truth, topic
        self._before: Counter[int] = Counter()
        self._clouds: Counter[int] | None = None
        self.repeated = 0
        if isinstance(truth, RecordedTruth) and truth.repeats:
            records = cloud_records(reader, topic)
            self._clouds = Counter(stamp for record in records if (stamp := self._stamp(record)) is not None)

    def of(self, msg: Any) -> LabelArray | None:
        """Return the true labels of the next cloud, (N,) uint32; None where there are none.

        Raises
        ------
        CloudFormatError
            Other clouds have the same stamp, and it is not known which truth belongs to which.
        """
        if isinstance(self._truth, CarriedTruth):
            return self._truth.of(msg)
        stamp = stamp_of(msg)
        place, clouds = self._before[stamp], None if self._clouds is None else self._clouds[stamp]
        self._before[stamp] += 1
        found = self._truth.of(stamp, place, clouds)
        self.repeated += clouds is not None and clouds > 1
        return found

    def skip(self, record: Record) -> None:
        """Pass over the next cloud."""
        if isinstance(self._truth, RecordedTruth) and (stamp := self._stamp(record)) is not None:
            self._before[stamp] += 1

    def _stamp(self, record: Record) -> int | None:
        try:
            return stamp_of(decode_message(record, self._topic))
        except CloudFormatError:
            return None


def find_truth(reader: BagReader, source: Source, max_points: int) -> Truth:
    """Return the truth of a recording: on the topic asked for, else on the usual one, else in the clouds themselves.

    Raises
    ------
    BagError
        The topic asked for is not there, or the only labels are those that are to be measured.
    """
    if source.truth_bag is None:
        return _in(reader, source, max_points)
    with open_bag(Path(source.truth_bag)) as other:
        return _in(other, source, max_points)


def _in(reader: BagReader, source: Source, max_points: int) -> Truth:
    wanted = source.truth_topic or TRUTH_TOPIC
    clouds = [topic for topic in reader.topics if topic.type == POINT_CLOUD and topic.count]
    for topic in clouds:
        if topic.name.lstrip("/") == wanted.lstrip("/"):
            return RecordedTruth(reader, topic, max_points)
    if source.truth_topic is None and source.truth_bag is None and not source.recorded:
        return CarriedTruth(max_points)
    raise no_truth(reader, wanted, clouds)


def no_truth(reader: BagReader, wanted: str, clouds: list[Topic]) -> BagError:
    """Return the error of a recording without the truth asked for; it lists the available topics of clouds."""
    names = ", ".join(topic.name for topic in clouds) or "none"
    return BagError(f"{reader.path}: has no truth on {wanted}; give --truth-topic (its topics of clouds: {names})")
