# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The node end to end: a camera at 30 Hz in one process, the node in another, a listener in this one, DDS between."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.child import ROOT, ChildError
from benchmarks.node_process import ACTIVE, NodeProcess, ros_is_there
from benchmarks.recordings import frames, source
from benchmarks.results import Result, Setting, Table
from topo_region_seg.offline.bags.clouds import POINT_CLOUD
from topo_region_seg.offline.bags.types import typestore

TITLE = "5. End to end over DDS"
HZ = 30.0
SLOWER_HZ = (15.0, 10.0)
FAST_DDS_DEFAULTS = {"FASTDDS_BUILTIN_TRANSPORTS": "DEFAULT"}
"""The environment of a camera whose Fast DDS is not set up for clouds."""
DROPS, LATENCY_MS = 0.02, 80.0
COUNTS = ("received", "processed", "dropped", "lost in transport", "rejected")
SETTLE = 3.0
"""Seconds until the node has published its last counts."""


def measure(setting: Setting) -> Result:
    """Publish VGA frames for a minute."""
    result = Result()
    seconds = setting.choose(60.0, 10.0)
    on = f"{source()} 640x480 frames at {HZ:g} Hz for {seconds:g} s"
    goals = (
        "frames in = frames out + drops",
        f"drops under {DROPS:.0%}",
        f"latency from stamp to labels, median under {LATENCY_MS:g} ms",
    )
    if not ros_is_there():
        for goal in goals:
            result.missing(goal, on, "rclpy is not installed: pip install '.[ros]'")
        return result
    whole = _run(setting.folder, HZ, seconds)
    result.at_most(f"{goals[0]}: frames unaccounted for", on, whole.unaccounted, 0, "", 0)
    result.at_most(goals[1], on, whole.dropped, 100.0 * DROPS, "%", 2)
    result.at_most(goals[2], on, whole.latency(0.5), LATENCY_MS, "ms")
    runs = [
        whole,
        _run(setting.folder, HZ, seconds / 3.0, FAST_DDS_DEFAULTS),
        *(_run(setting.folder, hz, seconds / 3.0) for hz in setting.choose(SLOWER_HZ, ())),
    ]
    rows = [["published", *(str(run.sent) for run in runs)]]
    rows += [[name, *(str(run.counts[name]) for run in runs)] for name in COUNTS]
    rows += [["labels heard", *(str(len(run.latencies)) for run in runs)]]
    rows += [["dropped (%)", *(f"{run.dropped:.1f}" for run in runs)]]
    rows += [
        [f"latency, {name} (ms)", *(f"{run.latency(q):.1f}" for run in runs)]
        for name, q in (("median", 0.5), ("95 %", 0.95))
    ]
    rows += [["node's use of processors (cores)", *(f"{run.cores:.2f}" for run in runs)]]
    columns = ["what", *(run.name for run in runs)]
    result.tables.append(Table("Frames on their way through the node", columns, rows))
    result.notes.append(
        "Drops are all frames that were published but not answered. The node does not know of frames that the camera "
        "replaced in its queue before the node took the first cloud."
    )
    result.notes.append(
        "Camera, node and listener share the machine's cores; clouds are 9.8 MB, published reliably. The camera has "
        "the transports of `topo_region_seg/ros/fastdds.xml`, as in [On a robot](robot.md#clouds-at-30-hz), unless "
        "the column says otherwise; node and player use them by themselves."
    )
    result.data = {
        run.name: {"sent": run.sent, **run.counts, "median_ms": run.latency(0.5), "cores": run.cores} for run in runs
    }
    return result


@dataclass(frozen=True)
class Run:
    """What became of the frames of a run: the node's counts, latencies (ms), and the cores that the node kept busy."""

    name: str
    sent: int
    counts: dict[str, int]
    latencies: list[float]
    cores: float

    @property
    def dropped(self) -> float:
        """Frames without an answer, in percent of those that were published."""
        return 100.0 * (self.sent - self.counts["processed"]) / self.sent

    @property
    def unaccounted(self) -> int:
        """Frames that the node received, but neither answered nor counted as dropped or rejected."""
        answered = self.counts["processed"] + self.counts["dropped"] + self.counts["rejected"]
        return abs(self.counts["received"] - answered)

    def latency(self, share: float) -> float:
        """Return the latency that a share of the answers stays below, ms."""
        return float(np.quantile(self.latencies, share)) if self.latencies else float("inf")


def _run(folder: Path, hz: float, seconds: float, camera_environment: Mapping[str, str] | None = None) -> Run:
    """Publish frames at a rate for some time."""
    from diagnostic_msgs.msg import DiagnosticArray
    from rclpy.serialization import deserialize_message

    from topo_region_seg.ros.listener import Listener

    domain = 1 + os.getpid() % 100
    latencies: list[float] = []
    counts: dict[str, int] = {}

    def hear(topic: str, data: bytes) -> None:
        if topic == "/labeled_points":
            sec, nanosec = struct.unpack_from("<iI", data, 4)
            latencies.append((time.time_ns() - sec * 1_000_000_000 - nanosec) * 1e-6)
            return
        status = deserialize_message(bytes(data), DiagnosticArray).status[0]
        values = {item.key: item.value for item in status.values}
        counts.update({name: int(values[f"clouds {name}"]) for name in COUNTS})

    topics = {"/labeled_points": POINT_CLOUD, "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray"}
    with NodeProcess(domain, folder / "node.log") as node, Listener(topics, domain, hear) as listener:
        node.wait_for(ACTIVE, 150.0)
        listener.spin(lambda: bool(counts) and listener.publishers("/labeled_points") > 0, 20.0)
        busy, started = node.cpu_seconds(), time.monotonic()
        with camera(folder, domain, round(seconds * hz), hz, camera_environment or {}) as publisher:
            listener.spin(lambda: publisher.poll() is not None, seconds + 60.0)
            cores = (node.cpu_seconds() - busy) / (time.monotonic() - started)
            listener.spin(lambda: False, SETTLE)
            output = publisher.communicate(timeout=10.0)[0]
        if publisher.returncode:
            raise ChildError(f"the camera ended with {publisher.returncode}; {output.strip()}")
    name = f"{hz:g} Hz, the camera's Fast DDS at its defaults" if camera_environment else f"{hz:g} Hz"
    return Run(name, int(output.split()[-1]), counts, latencies, cores)


@contextmanager
def camera(
    folder: Path, domain: int, count: int, hz: float, environment: Mapping[str, str]
) -> Iterator[subprocess.Popen[str]]:
    """Publish the frames over and over from a process of its own, its files in `folder`."""
    clouds = folder / "clouds"
    clouds.mkdir(exist_ok=True)
    for number, frame in enumerate(frames()):
        (clouds / f"{number:02}.cdr").write_bytes(typestore().serialize_cdr(frame.msg, POINT_CLOUD))
    ros = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    command = [sys.executable, "-m", "benchmarks.camera", str(clouds), str(count), str(hz)]
    env = {**os.environ, **ros, **environment}
    with subprocess.Popen(command, cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()
