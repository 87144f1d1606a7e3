# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The node's answers, received over DDS: recorded as they arrive, and reported frame by frame."""

from __future__ import annotations

import statistics
import struct
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from topo_region_seg.data import LabelArray
from topo_region_seg.offline.bags import BagWriter
from topo_region_seg.offline.bags.clouds import POINT_CLOUD
from topo_region_seg.offline.bags.types import typestore

CLOUDS = "/camera/depth/points"
LABELED = "/labeled_points"
COUNT = "/region_count"
TOPICS = {CLOUDS: POINT_CLOUD, LABELED: POINT_CLOUD, COUNT: "std_msgs/msg/UInt32"}


@dataclass(frozen=True)
class Labels:
    """The labels (N,) of the cloud with a stamp in nanoseconds."""

    stamp: int
    labels: LabelArray


@dataclass(frozen=True)
class Answer:
    """The node's answer to one cloud; `ms` is the time from the cloud to its labels, both as seen over DDS."""

    stamp: str
    points: int
    labeled: int
    regions: int
    ms: float | None


class AnswerRecorder:
    """Receives serialized messages and records the node's answers; a context manager that finishes the recording.

    Parameters
    ----------
    path : Path
        File of the labeled recording.
    report : callable
        Called with each answer as it arrives.
    """

    def __init__(self, path: Path, report: Callable[[Answer], None]) -> None:
        self.answers: list[Answer] = []
        self.last: Labels | None = None
        self._report = report
        self._sent: dict[int, float] = {}
        self._bag = BagWriter(path)
        for topic in (LABELED, COUNT):
            self._bag.add_topic(topic, TOPICS[topic])

    def __call__(self, topic: str, data: bytes) -> None:
        """Receive a message."""
        now = time.monotonic()
        if topic == CLOUDS:
            self._sent[_stamp(data)] = now
            return
        self._bag.write(topic, time.time_ns(), bytes(data))
        if topic == LABELED:
            self._answered(data, now)

    def _answered(self, data: bytes, now: float) -> None:
        message: Any = typestore().deserialize_cdr(data, POINT_CLOUD)
        labels = labels_of(message)
        stamp = _stamp(data)
        sent = self._sent.get(stamp)
        answer = Answer(
            stamp=f"{stamp // 10**9}.{stamp % 10**9:09d}",
            points=len(labels),
            labeled=int(np.count_nonzero(labels)),
            regions=int(np.max(labels, initial=0)),
            ms=None if sent is None else round((now - sent) * 1e3, 1),
        )
        self.answers.append(answer)
        self.last = Labels(stamp, labels)
        self._report(answer)

    def summary(self) -> dict[str, Any]:
        """Return the figures of all answers, see :mod:`topo_region_seg.offline.demo.report`."""
        times = [answer.ms for answer in self.answers if answer.ms is not None]
        return {
            "frames_labeled": len(self.answers),
            "points": max((answer.points for answer in self.answers), default=0),
            "regions": statistics.median_low([answer.regions for answer in self.answers] or [0]),
            "ms_median": statistics.median(times) if times else None,
            "frames": [asdict(answer) for answer in self.answers],
        }

    def __enter__(self) -> AnswerRecorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self._bag.close()
        else:
            self._bag.discard()


def labels_of(message: Any) -> LabelArray:
    """Return the labels of a labeled cloud, (N,) uint32."""
    offset = next(field.offset for field in message.fields if field.name == "label")
    table = np.frombuffer(message.data, np.uint8).reshape(-1, message.point_step)
    labels: LabelArray = table[:, offset : offset + 4].copy().view("<u4")[:, 0]
    return labels


def _stamp(data: bytes) -> int:
    """Return the header's stamp in nanoseconds, which comes first, after 4 bytes of encapsulation."""
    sec, nanosec = struct.unpack_from("<iI" if data[1] & 1 else ">iI", data, 4)
    return int(sec * 10**9 + nanosec)
