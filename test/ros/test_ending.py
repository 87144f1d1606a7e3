# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A signal ends the node with status 0 and without a traceback, whenever in its start it comes."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from places import ROOT

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from ros_harness import STARTUP, NodeProcess, until

SIGNALS = [signal.SIGTERM, signal.SIGINT]
MOMENTS = [0.0, 0.1, 0.3, 0.6, 1.0, 1.5, 2.2, 3.0]
"""Seconds after the process has begun to take signals, until after it is active on an idle machine."""


def takes_signals(process: NodeProcess) -> bool:
    """Whether the main thread has left the signals to the thread that waits for them."""
    status = Path(f"/proc/{process.process.pid}/status").read_text()
    found = re.search(r"^SigBlk:\s*(\w+)$", status, re.MULTILINE)
    return bool(found) and bool(int(found[1], 16) >> (signal.SIGTERM - 1) & 1)


@pytest.fixture
def node(ros_domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[NodeProcess]:
    started = NodeProcess(ros_domain + 50, tmp_path / "log.txt")
    yield started
    if started.process.poll() is None:
        started.process.kill()
        started.process.wait()
    print(started.log)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs Linux's /proc")
@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
def test_at_any_moment_of_the_start(node: NodeProcess, number: signal.Signals, moment: float) -> None:
    until(lambda: takes_signals(node), "signals to be taken", STARTUP)
    time.sleep(moment)
    assert node.process.poll() is None
    assert node.stop(number) == 0
    assert "Traceback" not in node.log
    assert "rror" not in node.log


def compilers(cache: Path) -> list[str]:
    """Return the processes that fill a cache."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if str(cache) in (process / "environ").read_text(errors="replace"):
                found.append((process / "cmdline").read_text().replace("\0", " "))
    return [command for command in found if "topo_region_seg.ros.kernels" in command]


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="needs Linux's /proc")
@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
def test_while_kernels_are_compiled(
    ros_domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "empty"))
    node = NodeProcess(ros_domain + 50, tmp_path / "log.txt")
    node.wait_for_log("compiling the kernels")
    assert compilers(tmp_path)
    assert node.stop(number) == 0
    assert "Traceback" not in node.log
    until(lambda: not compilers(tmp_path), "the end of the process that compiles")


PROGRAM = """
import os, signal, sys, threading
from topo_region_seg.ros.ending import Ending

ending = Ending()
calls, second = [], threading.Event()
if sys.argv[1] == "later":
    ending.by(lambda: calls.append(threading.current_thread().name))
for number in (signal.SIGINT, signal.SIGTERM, signal.SIGINT):
    os.kill(os.getpid(), number)
    ending.requested.wait(10)
    second.wait(0.2)
print(calls, flush=True)
sys.exit(7)
"""


def ended(when: str) -> tuple[int, str]:
    command = [sys.executable, "-c", PROGRAM, when]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert not done.stderr
    return done.returncode, done.stdout


def test_before_there_is_anything_to_clean_up_the_process_just_ends() -> None:
    assert ended("at once") == (0, "")


def test_afterwards_it_is_ended_once_and_on_another_thread() -> None:
    assert ended("later") == (7, "['signals']\n")
