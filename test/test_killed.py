# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""SIGKILL at random moments: no torn file, and the next start works. KILLS=50 tries harder (`make nightly`)."""

from __future__ import annotations

import os
import pickle
import pickletools
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from places import ROOT

from topo_region_seg.offline.bags import open_bag

BAG = ROOT / "bags" / "tabletop_sim"
KILLS = int(os.environ.get("KILLS", "5"))
MANY = KILLS >= 20

pytestmark = pytest.mark.timeout(180 + 15 * KILLS)


def killed(command: list[str], longest: float, moment: random.Random) -> bool:
    """Start a command and kill it after a random time up to `longest` seconds; return whether it had not ended."""
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(moment.uniform(0.0, longest))
    except subprocess.TimeoutExpired:
        process.kill()
    return process.wait() == -signal.SIGKILL


@pytest.mark.parametrize("name", ["out.mcap", "out"])
def test_a_replay_killed_at_any_moment_leaves_no_torn_recording(name: str, warm_kernels: None, tmp_path: Path) -> None:
    moment = random.Random(1)
    out, summary = tmp_path / name, tmp_path / "out.json"
    folder = name == "out"
    command = [sys.executable, "-m", "topo_region_seg", "replay", str(BAG), "-o", str(out), "--json", str(summary)]
    started = time.monotonic()
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    took = time.monotonic() - started
    whole, text_size = _size(out), summary.stat().st_size
    hits = 0
    for _ in range(KILLS):
        if folder:
            shutil.rmtree(out, ignore_errors=True)
        elif moment.random() < 0.5:
            out.unlink(missing_ok=True)
        hits += killed(command, 1.2 * took, moment)
        if out.exists():
            assert abs(_size(out) - whole) < 0.01 * whole
            with open_bag(out) as bag:
                assert sum(1 for _ in bag.messages(["/labeled_points"])) == 6
        assert abs(summary.stat().st_size - text_size) < 0.1 * text_size
    assert hits
    shutil.rmtree(out, ignore_errors=True)
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)


def _size(path: Path) -> int:
    return sum(file.stat().st_size for file in path.iterdir()) if path.is_dir() else path.stat().st_size


def test_a_compilation_killed_at_any_moment_leaves_no_torn_kernel(tmp_path: Path) -> None:
    moment = random.Random(2)
    cache = {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", "from topo_region_seg.pipeline import warm_up; warm_up()"]
    seen = 0
    for _ in range(KILLS):
        stored = len(list(tmp_path.rglob("*.nb*")))
        process = subprocess.Popen(command, cwd=ROOT, env={**os.environ, **cache})
        while len(list(tmp_path.rglob("*.nb*"))) == stored and process.poll() is None:
            time.sleep(0.005)
        time.sleep(moment.uniform(0.0, 0.3))  # kernels are stored one after the other from here on
        process.kill()
        process.wait()
        for index in tmp_path.rglob("*.nbi"):
            with index.open("rb") as file:
                pickle.load(file)  # numba's version
                _, overloads = pickle.loads(file.read())
            seen += len(overloads)
            for name in overloads.values():
                for _ in pickletools.genops((index.parent / name).read_bytes()):
                    pass  # raises if the file ends before the pickle does
    assert seen
    if MANY:
        subprocess.run(command, cwd=ROOT, check=True, env={**os.environ, **cache}, timeout=300)


def test_a_node_killed_at_any_moment_starts_again(ros_domain: int, tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")
    import clouds
    import numpy as np
    from ros_harness import Client, NodeProcess, cloud_message

    moment = random.Random(3)
    domain = ros_domain + 51
    command = [sys.executable, "-m", "topo_region_seg.ros.node"]
    client = Client(domain)
    try:
        msg = cloud_message(*clouds.scene(), height=48)
        for _ in range(KILLS):
            process = subprocess.Popen(
                command,
                cwd=tmp_path,
                env={**os.environ, "ROS_DOMAIN_ID": str(domain), "PYTHONPATH": str(ROOT)},
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            end = time.monotonic() + moment.uniform(0.0, 2.0)
            while time.monotonic() < end:
                client.publish(msg)  # so that some are killed in the middle of a cloud
                time.sleep(0.02)
            process.kill()
            assert process.wait() == -signal.SIGKILL
        node = NodeProcess(domain, tmp_path / "log.txt")
        try:
            node.wait_for_log("active: waiting")
            client.wait_for_node()
            assert np.frombuffer(client.ask(msg).data, np.uint8).size == 48 * 64 * 20
        finally:
            assert node.stop() == 0
    finally:
        client.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log.txt"]
