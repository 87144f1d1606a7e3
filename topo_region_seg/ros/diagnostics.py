# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The statistics as a diagnostic_msgs/DiagnosticArray."""

from __future__ import annotations

from collections.abc import Mapping

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from topo_region_seg.ros.statistics import Snapshot

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
LIVE_MS = 60_000.0
"""Largest distance between a stamp and the clock that looks like a running camera."""


def diagnostics(
    stamp: Time, node: str, state: str, failure: str | None, now: Snapshot, before: Snapshot, input_timeout: float
) -> DiagnosticArray:
    """Return the node's diagnostics.

    Parameters
    ----------
    stamp : Time
        Time of the report.
    node : str
        Fully qualified name of the node.
    state : str
        Lifecycle state; only an active node is in error when no clouds come.
    failure : str or None
        Why the last transition failed, which is an error in every state.
    now, before : Snapshot
        Figures of this and of the last report; the level tells what happened in between.
    input_timeout : float
        Seconds without a cloud that are an error; 0 = none.
    """
    level, message = (ERROR, failure) if failure else _summary(state, now, before, input_timeout)
    status = DiagnosticStatus(
        level=level,
        name=f"{node.lstrip('/')}: segmentation",
        message=message,
        hardware_id="",
        values=[KeyValue(key=key, value=value) for key, value in _values(state, now).items()],
    )
    array = DiagnosticArray(status=[status])
    array.header.stamp = stamp
    return array


def _summary(state: str, now: Snapshot, before: Snapshot, input_timeout: float) -> tuple[bytes, str]:
    if state != "active":
        return OK, state
    rejected = sum(now.rejected.values()) - sum(before.rejected.values())
    processed = now.processed - before.processed
    dropped = now.dropped - before.dropped
    if 0 < input_timeout <= now.idle:
        deaf = f"; {now.incompatible} publishers with incompatible QoS" if now.incompatible else ""
        return ERROR, f"no clouds for {now.idle:.0f} s{deaf}"
    troubles = []
    if rejected:
        reasons = _grown(now.rejected, before.rejected)
        troubles.append(f"{rejected} clouds rejected ({', '.join(reasons)})")
    if dropped:
        troubles.append(f"{dropped} dropped for newer ones")
    troubles += [f"{code}: {now.notice_texts[code]}" for code in _grown(now.notices, before.notices)]
    if troubles:
        return WARN, f"{processed} clouds processed, {', '.join(troubles)}"
    if not now.received:
        return OK, "waiting for the first cloud"
    return OK, f"{now.output_hz:.1f} Hz, {now.regions} regions"


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
        "clouds lost in transport": str(now.lost),
        "clouds rejected": str(sum(now.rejected.values())),
        "publishers with incompatible QoS": str(now.incompatible),
    }
    values |= {f"rejected: {reason}": str(count) for reason, count in sorted(now.rejected.items())}
    values |= {f"notice: {code}": str(count) for code, count in sorted(now.notices.items())}
    values |= {"stamp (s)": now.stamp, "points": str(now.points), "regions": str(now.regions)}
    # The stamps of a recording tell nothing about the age of the data.
    live = now.stamp_age_ms is not None and abs(now.stamp_age_ms) < LIVE_MS
    values |= {f"latency, {name} (ms)": f"{ms:.1f}" for name, ms in now.latencies_ms.items()}
    if live:
        values["stamp age, median (ms)"] = f"{now.stamp_age_ms:.1f}"
    return values | {f"stage {stage}, median (ms)": f"{ms:.2f}" for stage, ms in now.stages_ms.items()}
