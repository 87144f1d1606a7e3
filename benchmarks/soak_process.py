# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The node's process in the soak test, and what the kernel says of its memory, threads and descriptors."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from types import TracebackType
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
STANDIN = ROOT / "test" / "standin"
"""Where tf2_ros is looked for first: what the tests have in its place forgets transforms when it is told to."""
WARM = 0.2
"""Share of the run after which buffers and pools have found their size."""
SPAN = 0.1
"""Share of the run over which the figures at its start and end are taken."""


class NodeUnderWatch:
    """`region_segmentation_node` as a child, sampled while it runs; a context manager."""

    def __init__(self, domain: int, log_file: Path, *parameters: str) -> None:
        self._log_file = log_file
        path = os.pathsep.join([str(STANDIN), str(ROOT)])
        env = {**os.environ, "ROS_DOMAIN_ID": str(domain), "PYTHONPATH": path}
        command = [sys.executable, "-m", "topo_region_seg.ros.node", "--ros-args"]
        command += [text for parameter in parameters for text in ("-p", parameter)]
        with log_file.open("w") as log:
            self._process = subprocess.Popen(command, cwd=log_file.parent, env=env, stdout=log, stderr=log)
        self._samples: list[tuple[float, float]] = []
        self._idle: list[tuple[int, int]] = []

    def sample(self, every: float) -> None:
        """Note the memory (MB), at most once in `every` seconds."""
        now = time.monotonic()
        if not self._samples or now - self._samples[-1][0] >= every:
            self._samples.append((now, int(self._status()["VmRSS"].split()[0]) / 1024))

    def sample_idle(self) -> None:
        """Note threads and descriptors, of which there are more while a cloud is processed."""
        descriptors = len(list((self._home / "fd").iterdir()))
        self._idle.append((int(self._status()["Threads"]), descriptors))

    def summary(self) -> dict[str, Any]:
        """Return memory (medians), threads and descriptors near the start, after warming up, and at the end."""
        count = len(self._samples)
        span = max(1, int(SPAN * count))
        early = self._samples[int(WARM * count) : int(WARM * count) + span]
        late = self._samples[-span:]
        found: dict[str, Any] = {
            name: {"start": self._idle[0][i], "end": self._idle[-1][i]}
            for i, name in enumerate(("threads", "descriptors"))
        }
        memory: dict[str, Any] = {"start": median(s[1] for s in early), "end": median(s[1] for s in late)}
        memory["growth_percent"] = round(100 * (memory["end"] / memory["start"] - 1), 2)
        memory["peak"] = max(s[1] for s in self._samples)
        step = max(1, count // 60)
        memory["course"] = [round(s[1], 1) for s in self._samples[::step]]
        memory["start"], memory["end"], memory["peak"] = (round(memory[key], 1) for key in ("start", "end", "peak"))
        return {"memory_mb": memory, **found}

    def stop(self, number: signal.Signals) -> int:
        """Send a signal; return the exit status."""
        self._process.send_signal(number)
        return self._process.wait(30)

    @property
    def _home(self) -> Path:
        if self._process.poll() is not None:
            raise RuntimeError(f"the node ended with status {self._process.returncode}:\n{self.log[-4000:]}")
        return Path("/proc") / str(self._process.pid)

    def _status(self) -> dict[str, str]:
        return dict(line.split(":", 1) for line in (self._home / "status").read_text().splitlines())

    @property
    def log(self) -> str:
        """What the node wrote."""
        return self._log_file.read_text()

    def __enter__(self) -> NodeUnderWatch:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
