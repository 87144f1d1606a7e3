# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The statistics as a diagnostic_msgs/DiagnosticArray."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from topo_region_seg.ros.node_params import NodeParams
from topo_region_seg.ros.statistics import RATE_SECONDS, Snapshot
from topo_region_seg.steps.view.model import SensorModel

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
LIVE_MS = 60_000.0
"""Largest distance between a stamp and the clock that looks like a running camera."""


@dataclass(frozen=True)
class Condition:
    """How the node is, beside the figures.

    Parameters
    ----------
    state : str
        Lifecycle state; only an active node is in error when no clouds come.
    params : NodeParams
        What is too much or too little.
    failure : str or None
        Why the last transition failed, which is an error in every state.
    asleep : str or None
        Why an active node takes no clouds at present.
    overdue : float
        Seconds for which it has not been active although nobody took it down; 0 where that is as it should be.
    latched : bool
        Whether a publisher that owes no second cloud has been heard.
    """

    state: str
    params: NodeParams
    failure: str | None = None
    asleep: str | None = None
    overdue: float = 0.0
    latched: bool = False

    def silent(self, now: Snapshot) -> bool:
        """Whether clouds are due and none come."""
        due = self.state == "active" and self.asleep is None and not self.latched
        return due and 0 < self.params.input_timeout <= now.idle


def diagnostics(
    stamp: Time, node: str, condition: Condition, now: Snapshot, before: Snapshot, earlier: Snapshot | None = None
) -> DiagnosticArray:
    """Return the node's diagnostics.

    Parameters
    ----------
    stamp : Time
        Time of the report.
    node : str
        Fully qualified name of the node.
    condition : Condition
        How the node is.
    now, before : Snapshot
        Figures of this and of the last report; the level tells what happened in between.
    earlier : Snapshot, optional
        Figures of some time ago, since which the share of drops is taken; those of the last report unless given.
    """
    level, message = _summary(condition, now, before, earlier or before)
    status = DiagnosticStatus(
        level=level,
        name=f"{node.lstrip('/')}: segmentation",
        message=message,
        hardware_id=condition.params.hardware_id or now.frame_id,
        values=[KeyValue(key=key, value=value) for key, value in _values(condition.state, now).items()],
    )
    array = DiagnosticArray(status=[status])
    array.header.stamp = stamp
    return array


def _summary(condition: Condition, now: Snapshot, before: Snapshot, earlier: Snapshot) -> tuple[bytes, str]:
    if condition.failure:
        return ERROR, condition.failure
    if condition.state != "active":
        if condition.overdue > 0.0:
            text = f"{condition.state} for {condition.overdue:.0f} s: activate the node, or set inactive_timeout to 0"
            return ERROR, text
        return OK, condition.state
    if condition.asleep is not None:
        return OK, condition.asleep
    if condition.silent(now):
        deaf = f"; {now.incompatible} publishers with incompatible QoS" if now.incompatible else ""
        return ERROR, f"no clouds for {now.idle:.0f} s{deaf}"
    troubles = _troubles(condition, now, before, earlier)
    if troubles:
        return WARN, f"{now.processed - before.processed} clouds processed, {', '.join(troubles)}"
    if not now.received:
        return OK, "waiting for the first cloud"
    return OK, f"{now.output_hz:.1f} Hz, {now.regions} regions"


def _troubles(condition: Condition, now: Snapshot, before: Snapshot, earlier: Snapshot) -> list[str]:
    params, troubles = condition.params, []
    rejected = sum(now.rejected.values()) - sum(before.rejected.values())
    if rejected:
        reasons = _grown(now.rejected, before.rejected)
        troubles.append(f"{rejected} clouds rejected ({', '.join(reasons)})")
    dropped, received = now.dropped - earlier.dropped, now.received - earlier.received
    if dropped > 1 and 100.0 * dropped > params.max_dropped * received:
        troubles.append(f"{dropped} of {received} dropped for newer ones")
    latency = now.latencies_ms.get("median", 0.0)
    if 0.0 < params.max_latency < latency:
        troubles.append(f"latency {latency:.0f} ms, above {params.max_latency:g}")
    # A rate takes its time to be known.
    if not condition.latched and now.stretch >= RATE_SECONDS and now.input_hz < params.min_input_rate:
        troubles.append(f"{now.input_hz:.1f} clouds a second, below {params.min_input_rate:g}")
    return troubles + [f"{code}: {now.notice_texts[code]}" for code in _grown(now.notices, before.notices)]


def _grown(now: Mapping[str, int], before: Mapping[str, int]) -> list[str]:
    return sorted(code for code, count in now.items() if count > before.get(code, 0))


def _values(state: str, now: Snapshot) -> dict[str, str]:
    values = {
        "state": state,
        "input rate (Hz)": f"{now.input_hz:.2f}",
        "output rate (Hz)": f"{now.output_hz:.2f}",
        "clouds received": str(now.received),
        "clouds processed": str(now.processed),
        "clouds dropped": str(now.dropped),
        "clouds passed over": str(sum(now.passed_over.values())),
        "clouds lost in transport": str(now.lost),
        "clouds rejected": str(sum(now.rejected.values())),
        "publishers with incompatible QoS": str(now.incompatible),
    }
    values |= {f"rejected: {reason}": str(count) for reason, count in sorted(now.rejected.items())}
    values |= {f"passed over: {reason}": str(count) for reason, count in sorted(now.passed_over.items())}
    values |= {f"notice: {code}": str(count) for code, count in sorted(now.notices.items())}
    values |= {"stamp (s)": now.stamp, "points": str(now.points), "regions": str(now.regions)}
    values |= {} if now.sensor is None else _camera(now.sensor)
    # The stamps of a recording tell nothing about the age of the data.
    live = now.stamp_age_ms is not None and abs(now.stamp_age_ms) < LIVE_MS
    values |= {f"latency, {name} (ms)": f"{ms:.1f}" for name, ms in now.latencies_ms.items()}
    if live:
        values["stamp age, median (ms)"] = f"{now.stamp_age_ms:.1f}"
    values |= {f"stage {stage}, median (ms)": f"{ms:.2f}" for stage, ms in now.stages_ms.items()}
    return values | {f"stage {stage}, median CPU time (ms)": f"{ms:.2f}" for stage, ms in now.stages_cpu_ms.items()}


def _camera(sensor: SensorModel) -> dict[str, str]:
    """Return what the last cloud tells of its camera."""
    middle = np.array([sensor.middle])
    noise, step = float(sensor.noise_at(middle)[0]), float(sensor.step_at(middle)[0])
    return {
        "camera: angle between pixels (deg)": f"{math.degrees(sensor.pixel):.4f}",
        "camera: valid pixels (%)": f"{100.0 * sensor.valid:.1f}",
        "camera: median depth (m)": f"{sensor.middle:.3f}",
        "camera: noise of that depth (mm)": f"{1e3 * noise:.2f}",
        "camera: step of that depth (mm)": f"{1e3 * step:.2f}" if math.isfinite(step) else "none that can be told",
    }
