# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What the node counts and times; written by the executor and the worker, read by the diagnostics."""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from statistics import median

from topo_region_seg.steps.view.model import SensorModel

WINDOW = 200
"""Frames over which medians and percentiles are taken."""

PERCENTILES = {"median": 0.5, "95 %": 0.95, "99 %": 0.99, "max": 1.0}
"""What is reported of the latencies, and the share of frames that are as quick."""

RATE_SECONDS = 5.0
"""Time over which rates are taken."""


@dataclass(frozen=True)
class Snapshot:
    """The figures at one moment; counts since the node was started, times over the last frames.

    Every cloud in `received` is in the end `processed`, `dropped` (for a newer one, or because it waited when the
    node was deactivated), `rejected` or `passed_over`, as nobody wanted it. `latencies_ms` holds percentiles.
    `stretch` is the time since :meth:`Statistics.restart`, `idle` that since the last cloud or, if later, since that.
    `stamp` and `frame_id` are those of the last answered cloud, the former in seconds. `incompatible` counts publishers
    whose QoS does not match. `notices` counts, by code, what was said of clouds that were answered, and `notice_texts`
    holds what was said last. `sensor` is what the last answered cloud told of its camera, if it did.
    """

    received: int
    processed: int
    dropped: int
    lost: int
    rejected: dict[str, int]
    passed_over: dict[str, int]
    input_hz: float
    output_hz: float
    stages_ms: dict[str, float]
    stages_cpu_ms: dict[str, float]
    latencies_ms: dict[str, float]
    stamp_age_ms: float | None
    points: int
    regions: int
    stamp: str
    frame_id: str
    sensor: SensorModel | None
    stretch: float
    idle: float
    incompatible: int
    notices: dict[str, int]
    notice_texts: dict[str, str]


class Statistics:
    """Thread-safe counters and timings of the frames."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._received = 0
        self._processed = 0
        self._displaced = 0
        self._skipped = 0
        self._lost = 0
        self._incompatible = 0
        self._rejected: Counter[str] = Counter()
        self._passed_over: Counter[str] = Counter()
        self._notices: Counter[str] = Counter()
        self._notice_texts: dict[str, str] = {}
        self._points = 0
        self._regions = 0
        self._stamp = self._frame_id = ""
        self._sensor: SensorModel | None = None
        self.restart()

    def restart(self) -> None:
        """Begin a new stretch of input: rates, times and idle time start afresh, counts go on."""
        with self._lock:
            self._since = time.monotonic()
            self._last_input = self._since
            self._inputs: deque[float] = deque()
            self._outputs: deque[float] = deque()
            self._stages: dict[str, deque[float]] = {}
            self._cpu_stages: dict[str, deque[float]] = {}
            self._latencies: deque[float] = deque(maxlen=WINDOW)
            self._ages: deque[float] = deque(maxlen=WINDOW)

    def received(self, displaced: bool, skipped: int) -> None:
        """Count a cloud taken from the middleware.

        Parameters
        ----------
        displaced : bool
            Whether it took the place of one that was waiting for the worker.
        skipped : int
            How many were published since the last one taken, but never taken themselves.
        """
        with self._lock:
            self._received += 1
            self._displaced += displaced
            self._skipped += skipped
            self._last_input = time.monotonic()
            self._inputs.append(self._last_input)

    def dropped(self) -> None:
        """Count a cloud that waited for the worker when the input was closed."""
        with self._lock:
            self._displaced += 1

    def incompatible(self, count: int) -> None:
        """Count publishers that cannot be heard because of their QoS."""
        with self._lock:
            self._incompatible += count

    def lost(self, count: int) -> None:
        """Count clouds that the middleware reports as lost on the way."""
        with self._lock:
            self._lost += count

    def rejected(self, reason: str) -> None:
        """Count a cloud that could not be processed."""
        with self._lock:
            self._rejected[reason] += 1

    def passed_over(self, reason: str) -> None:
        """Count a cloud that is not processed because nobody wants it."""
        with self._lock:
            self._passed_over[reason] += 1

    def noticed(self, code: str, text: str) -> None:
        """Count something that is to be known of a cloud that is answered, such as why it has no regions."""
        with self._lock:
            self._notices[code] += 1
            self._notice_texts[code] = text

    def processed(
        self,
        stages_ms: Mapping[str, float],
        latency_ms: float,
        stamp_age_ms: float,
        points: int,
        regions: int,
        stamp: str,
        frame_id: str = "",
        cpu_ms: Mapping[str, float] | None = None,
        sensor: SensorModel | None = None,
    ) -> None:
        """Count an answered cloud; `cpu_ms` is the CPU time of its stages, `sensor` what it tells of its camera."""
        with self._lock:
            self._processed += 1
            self._outputs.append(time.monotonic())
            for kept, times in ((self._stages, stages_ms), (self._cpu_stages, cpu_ms or {})):
                for stage, ms in times.items():
                    kept.setdefault(stage, deque(maxlen=WINDOW)).append(ms)
            self._latencies.append(latency_ms)
            self._ages.append(stamp_age_ms)
            self._points, self._regions, self._stamp, self._frame_id = points, regions, stamp, frame_id
            self._sensor = sensor

    def snapshot(self) -> Snapshot:
        """Return the figures of this moment."""
        with self._lock:
            now = time.monotonic()
            span = min(RATE_SECONDS, now - self._since)
            # What was skipped was either lost on the way or displaced in the middleware's queue of depth 1.
            replaced = max(0, self._skipped - self._lost)
            return Snapshot(
                received=self._received + replaced,
                processed=self._processed,
                dropped=self._displaced + replaced,
                lost=self._lost,
                rejected=dict(self._rejected),
                passed_over=dict(self._passed_over),
                input_hz=_rate(self._inputs, now, span),
                output_hz=_rate(self._outputs, now, span),
                stages_ms={stage: median(times) for stage, times in self._stages.items()},
                stages_cpu_ms={stage: median(times) for stage, times in self._cpu_stages.items()},
                latencies_ms=_percentiles(self._latencies),
                stamp_age_ms=median(self._ages) if self._ages else None,
                points=self._points,
                regions=self._regions,
                stamp=self._stamp,
                frame_id=self._frame_id,
                sensor=self._sensor,
                stretch=now - self._since,
                incompatible=self._incompatible,
                notices=dict(self._notices),
                notice_texts=dict(self._notice_texts),
                idle=now - self._last_input,
            )


def _percentiles(values: deque[float]) -> dict[str, float]:
    """Return the least values that the wanted shares of all do not exceed."""
    ranked = sorted(values)
    return {name: ranked[max(0, ceil(share * len(ranked)) - 1)] for name, share in PERCENTILES.items() if ranked}


def _rate(times: deque[float], now: float, span: float) -> float:
    while times and times[0] < now - RATE_SECONDS:
        times.popleft()
    return len(times) / span if span > 0 else 0.0
