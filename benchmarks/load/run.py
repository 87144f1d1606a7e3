# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One run: the node, cameras and a listener, each in a process of its own, and what the node did and took."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.child import ROOT, ChildError
from benchmarks.node_process import NodeProcess
from topo_region_seg.cloud.messages.topics import OUTPUTS

KINDS = {output.name: output.kind for output in OUTPUTS}
SETTLE = 2.0
"""Seconds before and after the frames."""
PATIENCE = 600.0


@dataclass(frozen=True)
class Load:
    """What a node is given to do.

    Parameters
    ----------
    name : str
        For the table.
    input : str
        "points" or "depth".
    width, height : int
        Pixels of a frame.
    hz : float
        Frames a second of each camera.
    outputs : tuple of str
        Topics that are listened to; the latency is that of the first.
    arguments : mapping of str to str
        Parameters of the node.
    goals : mapping of str to float
        What is not to be exceeded.
    cameras : tuple of str
        What the topics of each camera begin with; one process of the node takes all.
    """

    name: str
    input: str
    width: int
    height: int
    hz: float
    outputs: tuple[str, ...]
    arguments: Mapping[str, str]
    goals: Mapping[str, float] = field(default_factory=dict)
    cameras: tuple[str, ...] = ("",)


@dataclass(frozen=True)
class Figures:
    """What came of it.

    Parameters
    ----------
    sent, answered : int
        Frames of all cameras, and those of them whose first output was heard.
    latencies : list of float
        From stamp to the first output, ms.
    cpu_seconds, seconds : float
        Processor time of the node while frames came, and that time.
    memory : dict
        Resident memory of the node at the end, MB: "all" and by kind.
    """

    sent: int
    answered: int
    latencies: list[float]
    cpu_seconds: float
    seconds: float
    memory: dict[str, float]

    @property
    def dropped(self) -> float:
        """Frames without an answer, percent."""
        return 100.0 * (self.sent - self.answered) / max(self.sent, 1)

    @property
    def cores(self) -> float:
        """Processors that the node kept busy."""
        return self.cpu_seconds / self.seconds

    @property
    def cpu_ms(self) -> float:
        """Processor time of the node for each answer, ms."""
        return 1e3 * self.cpu_seconds / max(self.answered, 1)

    def latency(self, share: float) -> float:
        """Return the latency that a share of the answers stays below, ms."""
        return float(np.quantile(self.latencies, share)) if self.latencies else float("inf")


def interfaces() -> dict[str, str]:
    """Return the environment in which vision_msgs is found, if the tests have built it; else an empty one."""
    built = sorted((Path(sys.prefix) / "test_interfaces").glob("*/share/vision_msgs"), key=os.path.getmtime)
    if not built:
        return {}
    prefix = built[-1].parents[1]
    python = Path(sysconfig.get_path("purelib")).relative_to(sys.prefix)
    return {
        "PYTHONPATH": os.pathsep.join([str(ROOT), str(prefix / python)]),
        "LD_LIBRARY_PATH": os.pathsep.join(filter(None, [str(prefix / "lib"), os.environ.get("LD_LIBRARY_PATH")])),
        "AMENT_PREFIX_PATH": os.pathsep.join([str(prefix), sys.prefix]),
    }


def measure(load: Load, frames: Path, folder: Path, seconds: float, domain: int) -> Figures:
    """Have the node work on the frames of a folder for so long."""
    found = interfaces()
    ros = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", **found}
    env = {**os.environ, "AMENT_PREFIX_PATH": sys.prefix, **ros}
    parameters = {"input": load.input, **load.arguments}
    if load.cameras != ("",):
        parameters["cameras"] = f"[{', '.join(name.strip('/') for name in load.cameras)}]"
    arguments = [text for name, value in parameters.items() for text in ("-p", f"{name}:={value}")]
    outputs = [output for output in load.outputs if found or "vision_msgs" not in KINDS[output]]
    count, heard = round(seconds * load.hz), folder / "heard.json"
    topics = [f"/{camera}{output}={KINDS[output]}" for camera in load.cameras for output in outputs]
    with ExitStack() as stack:
        node = stack.enter_context(NodeProcess(domain, folder / "node.log", ros, arguments=arguments))
        node.wait_for("active: waiting", PATIENCE)
        listener = _child(stack, "benchmarks.load.hear", [str(domain), str(heard), *topics], env)
        assert listener.stdout is not None
        listener.stdout.readline()
        time.sleep(SETTLE)
        cpu, started = node.cpu_seconds(), time.monotonic()
        cameras = [
            _child(stack, "benchmarks.load.camera", [str(frames), load.input, str(count), str(load.hz), prefix], env)
            for prefix in load.cameras
        ]
        said = [camera.communicate(timeout=seconds + PATIENCE)[0] for camera in cameras]
        used, passed = node.cpu_seconds() - cpu, time.monotonic() - started
        memory = _memory(node.process.pid)
        time.sleep(SETTLE)
        listener.communicate(timeout=PATIENCE)
        log = node.log
    for camera, text in zip(cameras, said, strict=True):
        if camera.returncode:
            raise ChildError(f"the camera ended with {camera.returncode}; {text.strip()}; the node says: {log[-800:]}")
    latencies = json.loads(heard.read_text(encoding="utf-8"))["latencies"]
    answers = [ms for camera in load.cameras for ms in latencies[f"/{camera}{outputs[0]}"]]
    return Figures(sum(int(text.split()[-1]) for text in said), len(answers), answers, used, passed, memory)


def _child(stack: ExitStack, module: str, arguments: Sequence[str], env: Mapping[str, str]) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", module, *arguments]
    pipe = subprocess.PIPE
    child = stack.enter_context(subprocess.Popen(command, cwd=ROOT, env=env, stdin=pipe, stdout=pipe, text=True))
    stack.callback(lambda: child.poll() is None and child.kill())
    return child


def _memory(pid: int) -> dict[str, float]:
    """Return the resident memory of a process, MB: all, its own, that of files, and that shared with others."""
    status = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text("ascii").splitlines())
    kinds = {"all": "VmRSS", "own": "RssAnon", "files": "RssFile", "shared": "RssShmem"}
    return {kind: int(status[name].split()[0]) / 1024 for kind, name in kinds.items()}
