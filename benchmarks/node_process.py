# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The node in a process of its own, as a robot starts it, and what its log says when."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.child import ROOT, ChildError

ACTIVE = "active: waiting for clouds"
COMPILING = "compiling the kernels"
PATIENCE = 10.0
PR_CAPBSET_DROP, CAP_DAC_OVERRIDE = 24, 1  # of linux/prctl.h and linux/capability.h


def ros_is_there() -> bool:
    """Whether rclpy can be imported; also lets the wheels of PyPI find their own messages."""
    os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)
    try:
        import rclpy  # noqa: F401
    except ImportError:
        return False
    return True


def _give_up_overriding() -> None:
    """Drop CAP_DAC_OVERRIDE from what the program that is started next may have."""
    if ctypes.CDLL(None, use_errno=True).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "root's right to write anywhere cannot be given up")


class NodeProcess:
    """`region_segmentation_node`; a context manager that ends it.

    Parameters
    ----------
    domain : int
        Its ROS domain, on this machine alone.
    log : Path
        File for its output.
    environment : mapping, optional
        What differs from this process's.
    folder : Path
        Where it runs.
    modest : bool
        Take from root the right to write to what is read-only.
    arguments : sequence of str
        What follows ``--ros-args``.
    """

    def __init__(
        self,
        domain: int,
        log: Path,
        environment: Mapping[str, str] | None = None,
        folder: Path = ROOT,
        modest: bool = False,
        arguments: Sequence[str] = (),
    ) -> None:
        self._log = log
        ros = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "PYTHONUNBUFFERED": "1"}
        self._started = time.monotonic()
        with log.open("w", encoding="utf-8") as stream:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "topo_region_seg.ros.node", "--ros-args", *arguments],
                cwd=folder,
                env={**os.environ, **ros, **(environment or {})},
                stdout=stream,
                stderr=subprocess.STDOUT,
                preexec_fn=_give_up_overriding if modest and os.geteuid() == 0 else None,
            )

    @property
    def log(self) -> str:
        """What it has said so far."""
        return self._log.read_text(encoding="utf-8", errors="replace")

    def wait_for(self, text: str, timeout: float) -> float:
        """Wait until the log holds `text`; return the seconds since the process was started."""
        while text not in self.log:
            if self.process.poll() is not None or time.monotonic() - self._started > timeout:
                raise ChildError(f"the node did not say '{text}' within {timeout:.0f} s: {self.log[-800:]}")
            time.sleep(0.01)
        return time.monotonic() - self._started

    def cpu_seconds(self) -> float:
        """Return the processor time that it has used."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def __enter__(self) -> NodeProcess:
        return self

    def __exit__(self, *_: object) -> None:
        for number in (signal.SIGINT, signal.SIGKILL):
            if self.process.poll() is None:
                self.process.send_signal(number)
                try:
                    self.process.wait(PATIENCE)
                except subprocess.TimeoutExpired:
                    continue
