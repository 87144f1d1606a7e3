# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The node end to end: a camera at 30 Hz in one process, the node in another, a listener in this one, DDS between."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from benchmarks.child import ROOT, ChildError
from benchmarks.node_process import ACTIVE, NodeProcess, ros_is_there
from benchmarks.recordings import frames, source
from benchmarks.results import Result, Setting, Table
from topo_region_seg.bags.clouds import POINT_CLOUD
from topo_region_seg.bags.types import typestore

TITLE = "5. End to end over DDS"
HZ = 30.0
DROPS, LATENCY_MS = 0.02, 80.0
COUNTS = ("received", "processed", "dropped", "lost in transport", "rejected")
SETTLE = 3.0
"""Seconds until the node has told its last counts."""


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
    sent, counts, latencies, cores = _run(setting.folder, seconds)
    answered = counts["processed"] + counts["dropped"] + counts["rejected"]
    dropped = sent - counts["processed"]
    median = float(np.median(latencies)) if latencies else float("inf")
    unaccounted = abs(counts["received"] - answered)
    result.at_most(f"{goals[0]}: frames unaccounted for", on, unaccounted, 0, "", 0)
    result.at_most(goals[1], on, 100.0 * dropped / sent, 100.0 * DROPS, "%", 2)
    result.at_most(goals[2], on, median, LATENCY_MS, "ms")
    p95 = float(np.quantile(latencies, 0.95)) if latencies else float("inf")
    rows = [["published", str(sent)], *([name, str(counts[name])] for name in COUNTS)]
    rows += [["labels heard", str(len(latencies))], ["latency, median", f"{median:.1f} ms"]]
    rows += [["latency, 95 %", f"{p95:.1f} ms"], ["node's use of processors", f"{cores:.2f} cores"]]
    result.tables.append(Table("Frames and their way through the node", ["what", "figure"], rows))
    result.notes.append(
        "Drops are all frames that were published and not answered. What the camera replaces in its queue before the "
        "node has taken the first cloud is unknown to the node."
    )
    result.notes.append("Camera, node and listener share the machine's cores; clouds are 9.8 MB, published reliably.")
    result.data = {"sent": sent, **counts, "median_ms": median, "p95_ms": p95, "cores": cores}
    return result


def _run(folder: Path, seconds: float) -> tuple[int, dict[str, int], list[float], float]:
    """Return how many frames were sent, the node's counts, the latencies (ms) and the cores that the node kept busy."""
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
        with _camera(folder, domain, round(seconds * HZ)) as camera:
            listener.spin(lambda: camera.poll() is not None, seconds + 60.0)
            cores = (node.cpu_seconds() - busy) / (time.monotonic() - started)
            listener.spin(lambda: False, SETTLE)
            output = camera.communicate(timeout=10.0)[0]
        if camera.returncode:
            raise ChildError(f"the camera ended with {camera.returncode}; {output.strip()}")
    return int(output.split()[-1]), counts, latencies, cores


@contextmanager
def _camera(folder: Path, domain: int, count: int) -> Iterator[subprocess.Popen[str]]:
    clouds = folder / "clouds"
    clouds.mkdir(exist_ok=True)
    for number, frame in enumerate(frames()):
        (clouds / f"{number:02}.cdr").write_bytes(typestore().serialize_cdr(frame.msg, POINT_CLOUD))
    ros = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    command = [sys.executable, "-m", "benchmarks.camera", str(clouds), str(count), str(HZ)]
    with subprocess.Popen(command, cwd=ROOT, env={**os.environ, **ros}, stdout=subprocess.PIPE, text=True) as camera:
        try:
            yield camera
        finally:
            if camera.poll() is None:
                camera.kill()
