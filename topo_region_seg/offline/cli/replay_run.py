# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The loop of a replay, and its results."""

from __future__ import annotations

import json
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

from topo_region_seg.beyond.tracking.tracker import Tracker
from topo_region_seg.clock import cpu_seconds
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.cloud.stamp import stamp_of
from topo_region_seg.compiled.threads import at_most
from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags.clouds import cloud_records, decode_message
from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Topic
from topo_region_seg.offline.bags.sensor_frame import SensorFrame
from topo_region_seg.offline.cli.console import Steps, note
from topo_region_seg.offline.cli.interrupt import stop_request
from topo_region_seg.offline.cli.overlap import finish_behind, read_ahead
from topo_region_seg.offline.cli.replay_output import ReplayOutput
from topo_region_seg.offline.frames import INTERNAL_ERROR, FrameResult, Rejection, class_counts, rounded
from topo_region_seg.offline.sensor_figures import SensorFigures, sensor_figures
from topo_region_seg.offline.stamps import seconds
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.segmentation import Segmentation

SHOWN_REJECTIONS = 10
READ_AHEAD = 2
WRITE_BEHIND = 2
"""Clouds in memory besides the one that is segmented: enough to keep all three threads busy."""


@dataclass
class _Spent:
    """Milliseconds of one part of the work, and those of CPU time in the threads that worked at it."""

    ms: float = 0.0
    cpu_ms: float = 0.0

    @contextmanager
    def measured(self) -> Iterator[None]:
        start, spent = time.perf_counter(), cpu_seconds()
        yield
        self.ms, self.cpu_ms = 1e3 * (time.perf_counter() - start), 1e3 * (cpu_seconds() - spent)


@dataclass
class _Input:
    """A recorded message in progress; where it cannot be used, `cloud` stays None and `rejection` says why."""

    record: Record
    stamp: float
    msg: Any = None
    cloud: Cloud | None = None
    decode: _Spent = field(default_factory=lambda: _Spent())
    run: _Spent = field(default_factory=lambda: _Spent())
    rejection: Rejection | None = None


class Replay:
    """Runs a recording's clouds through the pipeline as the node does, but drops none.

    A cloud that cannot be segmented goes to `rejected`. After Ctrl-C the current cloud is finished, `interrupted` is
    true, and the results so far are kept. `sensor` is what the first segmented cloud tells of its camera.
    """

    def __init__(
        self, reader: BagReader, topic: Topic, params: Params, output: ReplayOutput, *, debug: bool = False
    ) -> None:
        self.reader = reader
        self.topic = topic
        self.frames: list[FrameResult] = []
        self.rejected: list[Rejection] = []
        self.interrupted = False
        self.sensor: SensorFigures | None = None
        self._pipeline = Pipeline(params)
        self._tracker = Tracker()
        self._output = output
        self._debug = debug
        self._warned: set[str] = set()
        self._sensor = SensorFrame(reader)

    def run(self, step: Steps) -> None:
        """Process all clouds: one is segmented while the next is read and the previous one is written.

        `step` is called after each cloud, from the thread that writes.
        """
        with (
            stop_request() as stop,
            read_ahead(self._inputs(), READ_AHEAD) as inputs,
            finish_behind(WRITE_BEHIND) as finish,
        ):
            for given in inputs:
                finish(partial(self._finish, given, self._segment(given), step))
                if stop.is_set():
                    self.interrupted = True
                    return

    def _inputs(self) -> Iterator[_Input]:
        for record in cloud_records(self.reader, self.topic):
            yield self._decode(record)

    def _decode(self, record: Record) -> _Input:
        given = _Input(record, seconds(record.log_time))
        with at_most(self._pipeline.params.threads), given.decode.measured(), self._rejections(given):
            given.msg = decode_message(record, self.topic)
            given.stamp = seconds(stamp_of(given.msg))
            cloud = decode(
                given.msg,
                max_points=self._pipeline.params.point_limit,
                warn=self._warn_once,
                needs_color=self._pipeline.needs_color,
            )
            given.cloud = self._sensor.place(cloud, given.msg)
            if self._sensor.note:
                self._warn_once("sensor_frame", self._sensor.note)
        return given

    def _segment(self, given: _Input) -> Segmentation | None:
        seg = None
        if given.cloud is not None:
            with given.run.measured(), self._rejections(given):
                seg = self._tracker.follow(
                    given.cloud,
                    self._pipeline.run(given.cloud, self._warn_once),
                    given.stamp,
                    given.msg.header.frame_id,
                    self._warn_once,
                )
        return seg

    def _finish(self, given: _Input, seg: Segmentation | None, step: Steps) -> None:
        if given.cloud is not None and seg is not None:
            with self._rejections(given):
                self._output.write(given.record, given.msg, given.cloud, seg, self._warn_once)
        if given.rejection:
            self.rejected.append(given.rejection)
        elif given.cloud is not None and seg is not None:
            decode, run = given.decode, given.run
            ms = {"decode": decode.ms, **seg.ms, "total": decode.ms + run.ms}
            cpu_ms = {"decode": decode.cpu_ms, **seg.cpu_ms, "total": decode.cpu_ms + run.cpu_ms}
            if not self.frames:
                self.sensor = sensor_figures(given.cloud, self._pipeline.params)
            counts, classes = (len(given.cloud), len(seg.regions)), class_counts(seg)
            result = FrameResult(given.stamp, *counts, rounded(ms), cpu_ms=rounded(cpu_ms), classes=classes)
            self.frames.append(result)
        step(f"{self.frames[-1].regions} regions" if self.frames else "")

    @contextmanager
    def _rejections(self, given: _Input) -> Iterator[None]:
        """Record why a cloud cannot be used; a bad cloud never ends a replay."""
        try:
            yield
        except BagError:
            raise
        except Exception as error:
            given.rejection = Rejection.of(given.stamp, error)
            if self._debug and given.rejection.reason == INTERNAL_ERROR:
                traceback.print_exc()

    def summary_line(self) -> str:
        """Return the numbers of clouds, regions and milliseconds in one line."""
        done, failed = len(self.frames), len(self.rejected)
        parts = [f"{done} cloud{'' if done == 1 else 's'} segmented"]
        if failed:
            parts.append(f"{failed} rejected")
        if done:
            counts = sorted(frame.regions for frame in self.frames)
            total = sum(frame.ms["total"] for frame in self.frames) / done
            spread = f"{counts[0]}" if counts[0] == counts[-1] else f"{counts[0]} to {counts[-1]}"
            parts.append(f"{spread} region{'' if spread == '1' else 's'} a cloud")
            cpu = sum(frame.cpu_ms["total"] for frame in self.frames) / done
            parts.append(f"{total:.0f} ms a cloud ({cpu:.0f} ms of CPU time)")
        return ", ".join(parts)

    def rejected_lines(self) -> list[str]:
        """Return a line for each of the first rejected clouds, and one for each reason of the others."""
        lines = [f"rejected: {r.stamp:.9f} s: {r.detail} ({r.reason})" for r in self.rejected[:SHOWN_REJECTIONS]]
        rest = Counter(rejection.reason for rejection in self.rejected[SHOWN_REJECTIONS:])
        return lines + [f"rejected: {count} more: {reason}" for reason, count in rest.items()]

    def json_text(self) -> str:
        """Return the summary as JSON."""
        summary: dict[str, Any] = {
            "frames": [asdict(frame) for frame in self.frames],
            "rejected": [{"stamp": r.stamp, "reason": r.reason} for r in self.rejected],
            "truncated": self.reader.truncated,
            "params": self._pipeline.params.as_dict(),
        }
        return json.dumps(summary, indent=1) + "\n"

    def _warn_once(self, code: str, text: str) -> None:
        if code not in self._warned:
            self._warned.add(code)
            note(f"note: {text} ({code}; shown once)")
