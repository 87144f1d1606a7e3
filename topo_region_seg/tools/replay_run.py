# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The loop of a replay, and what it found out."""

from __future__ import annotations

import json
import time
import traceback
from collections import Counter
from dataclasses import dataclass
from typing import Any

from topo_region_seg.bags.clouds import decode_message
from topo_region_seg.bags.records import BagError, BagReader, Record, Topic
from topo_region_seg.params import Params
from topo_region_seg.pipeline import MissingColorError, Pipeline
from topo_region_seg.pointcloud2 import CloudFormatError, decode
from topo_region_seg.tools.console import Steps, note
from topo_region_seg.tools.interrupt import stop_request
from topo_region_seg.tools.replay_output import ReplayOutput

SHOWN_REJECTIONS = 10


@dataclass(frozen=True)
class Frame:
    """One segmented cloud; `stamp` in seconds, `ms` per stage with `total`."""

    stamp: float
    points: int
    regions: int
    ms: dict[str, float]


@dataclass(frozen=True)
class Rejection:
    """One cloud that could not be segmented; `stamp` in seconds (the log time where the message has none)."""

    stamp: float
    reason: str
    detail: str


class Replay:
    """Runs a recording's clouds through the pipeline, as the node does, but drops none.

    A cloud that cannot be segmented is noted in `rejected`, and the next one follows. After Ctrl-C the
    cloud at hand is finished, `interrupted` is true, and what was done until then stands.
    """

    def __init__(
        self, reader: BagReader, topic: Topic, params: Params, output: ReplayOutput, *, debug: bool = False
    ) -> None:
        self.reader = reader
        self.topic = topic
        self.frames: list[Frame] = []
        self.rejected: list[Rejection] = []
        self.interrupted = False
        self._pipeline = Pipeline(params)
        self._output = output
        self._debug = debug
        self._warned: set[str] = set()

    def run(self, step: Steps) -> None:
        """Process all clouds; `step` is called after each."""
        with stop_request() as stop:
            for record in self.reader.messages([self.topic.name]):
                self._process(record)
                step(f"{self.frames[-1].regions} regions" if self.frames else "")
                if stop.is_set():
                    self.interrupted = True
                    return

    def _process(self, record: Record) -> None:
        stamp = record.log_time * 1e-9
        try:
            started = time.perf_counter()
            msg = decode_message(record, self.topic)
            stamp = msg.header.stamp.sec + msg.header.stamp.nanosec * 1e-9
            cloud = decode(msg, max_points=self._pipeline.params.max_points, warn=self._warn_once)
            decoded = time.perf_counter()
            seg = self._pipeline.run(cloud)
            segmented = time.perf_counter()
            self._output.write(record, msg, cloud, seg)
        except CloudFormatError as error:
            self._reject(stamp, error.reason, error.detail)
        except MissingColorError as error:
            self._reject(stamp, "missing_color", str(error))
        except BagError:
            raise
        except Exception as error:  # one bad frame never ends a replay
            if self._debug:
                traceback.print_exc()
            self._reject(stamp, "internal_error", " ".join(f"{type(error).__name__}: {error}".split()))
        else:
            ms = {"decode": 1e3 * (decoded - started), **seg.ms, "total": 1e3 * (segmented - started)}
            self.frames.append(Frame(stamp, len(cloud), len(seg.regions), ms))

    def summary_line(self) -> str:
        """Say in one line how many clouds, regions and milliseconds there were."""
        done, failed = len(self.frames), len(self.rejected)
        parts = [f"{done} cloud{'' if done == 1 else 's'} segmented"]
        if failed:
            parts.append(f"{failed} rejected")
        if done:
            counts = sorted(frame.regions for frame in self.frames)
            total = sum(frame.ms["total"] for frame in self.frames) / done
            spread = f"{counts[0]}" if counts[0] == counts[-1] else f"{counts[0]} to {counts[-1]}"
            parts.append(f"{spread} region{'' if spread == '1' else 's'} a cloud")
            parts.append(f"{total:.0f} ms a cloud")
        return ", ".join(parts)

    def rejected_lines(self) -> list[str]:
        """Return a line for each of the first rejected clouds, and the counts of the rest by reason."""
        lines = [f"rejected: {r.stamp:.9f} s: {r.detail} ({r.reason})" for r in self.rejected[:SHOWN_REJECTIONS]]
        rest = Counter(rejection.reason for rejection in self.rejected[SHOWN_REJECTIONS:])
        return lines + [f"rejected: {count} more: {reason}" for reason, count in rest.items()]

    def json_text(self) -> str:
        """Return the summary for machines."""
        summary: dict[str, Any] = {
            "frames": [
                {"stamp": f.stamp, "points": f.points, "regions": f.regions, "ms": _rounded(f.ms)} for f in self.frames
            ],
            "rejected": [{"stamp": r.stamp, "reason": r.reason} for r in self.rejected],
            "truncated": self.reader.truncated,
            "params": self._pipeline.params.as_dict(),
        }
        return json.dumps(summary, indent=1) + "\n"

    def _reject(self, stamp: float, reason: str, detail: str) -> None:
        self.rejected.append(Rejection(stamp, reason, detail))

    def _warn_once(self, code: str, text: str) -> None:
        if code not in self._warned:
            self._warned.add(code)
            note(f"note: {text} ({code}; said once)")


def _rounded(ms: dict[str, float]) -> dict[str, float]:
    return {stage: round(value, 3) for stage, value in ms.items()}
