# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The package builds as on a robot, and what is installed runs."""

from __future__ import annotations

import importlib.util
import os
import queue
import signal
import subprocess
import sys
import sysconfig
import threading
import time
from pathlib import Path

import pytest
from places import ROOT

from topo_region_seg.ros.transport import PROFILES

PACKAGE = "topo_region_seg"
COLCON = Path(sysconfig.get_path("scripts")) / "colcon"
START_SECONDS = 150
"""The installed copy compiles its kernels itself."""

pytestmark = [
    pytest.mark.timeout(300),
    pytest.mark.skipif(not COLCON.exists(), reason="colcon is not installed beside this Python"),
]


def build(folder: Path, *options: str) -> Path:
    """Build into `folder` with colcon; return the package's install prefix."""
    command = [COLCON, "--log-base", folder / "log", "build", "--paths", ROOT, *options]
    command += ["--build-base", folder / "build", "--install-base", folder / "install"]
    environment = {**os.environ, "AMENT_PREFIX_PATH": sys.prefix}
    result = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "1 package finished" in result.stdout + result.stderr
    return folder / "install" / PACKAGE


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("colcon"))


def assert_layout(prefix: Path) -> None:
    for executable in ("region_segmentation_node", PACKAGE):
        assert os.access(prefix / "lib" / PACKAGE / executable, os.X_OK)
    share = prefix / "share"
    assert (share / "ament_index" / "resource_index" / "packages" / PACKAGE).is_file()
    assert (share / PACKAGE / "package.xml").is_file()
    for folder in ("launch", "config", "rviz", "foxglove", "security"):
        installed = {path.name for path in (share / PACKAGE / folder).iterdir()}
        given = {path.name for path in (ROOT / folder).iterdir() if path.is_file()}
        assert installed == given | ({PROFILES.name} if folder == "config" else set())
        assert installed
    # Made by colcon for ament packages only: without them `ros2 run` would not find the package.
    assert (share / PACKAGE / "hook" / "ament_prefix_path.dsv").is_file()


def test_build_lays_out_a_ros_package(prefix: Path) -> None:
    assert_layout(prefix)


def test_build_with_links_lays_out_the_same(tmp_path: Path) -> None:
    assert_layout(build(tmp_path, "--symlink-install"))


def sourced(prefix: Path, command: str, domain: int) -> subprocess.Popen[str]:
    """Start `command` as a user would, after sourcing the workspace."""
    setup = prefix.parent / "setup.bash"
    environment = {**os.environ, "AMENT_PREFIX_PATH": sys.prefix, "ROS_DOMAIN_ID": str(domain)}
    environment.pop("PYTHONPATH", None)
    return subprocess.Popen(
        ["bash", "-c", f'source "{setup}" && exec {command}'],
        cwd=prefix,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


@pytest.mark.skipif(importlib.util.find_spec("rclpy") is None, reason="rclpy cannot be imported")
def test_installed_node_starts_and_stops(prefix: Path) -> None:
    domain = 1 + os.getpid() % 100
    process = sourced(prefix, f'"{prefix}/lib/{PACKAGE}/region_segmentation_node"', domain)
    try:
        lines = wait_for_line(process, "active: waiting for clouds")
        assert nodes_seen(domain) >= {"region_segmentation"}, lines
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=20) == 0, lines
    finally:
        process.kill()
        process.wait()


def test_installed_tool_is_the_installed_copy(prefix: Path) -> None:
    where = sourced(prefix, f'{sys.executable} -c "import {PACKAGE}; print({PACKAGE}.__file__)"', 0)
    assert Path(where.communicate(timeout=60)[0].strip()).is_relative_to(prefix)
    tool = sourced(prefix, f'"{prefix}/lib/{PACKAGE}/{PACKAGE}" --help', 0)
    assert "segment" in tool.communicate(timeout=60)[0]
    assert tool.returncode == 0


def wait_for_line(process: subprocess.Popen[str], text: str) -> list[str]:
    """Read the output of `process` until a line contains `text`; return what came."""
    assert process.stdout
    arriving: queue.Queue[str] = queue.Queue()
    stdout = process.stdout
    threading.Thread(target=lambda: [arriving.put(line) for line in stdout], daemon=True).start()
    lines: list[str] = []
    deadline = time.monotonic() + START_SECONDS
    while time.monotonic() < deadline:
        try:
            lines.append(arriving.get(timeout=0.2))
        except queue.Empty:
            assert process.poll() is None, "".join(lines)
            continue
        if text in lines[-1]:
            return lines
    pytest.fail(f"no '{text}' within {START_SECONDS} s:\n{''.join(lines)}")


def nodes_seen(domain: int) -> set[str]:
    """Return the names of the nodes that another process discovers over DDS."""
    code = """
import time, rclpy
rclpy.init()
node = rclpy.create_node("observer")
deadline = time.monotonic() + 15
while node.get_node_names() == ["observer"] and time.monotonic() < deadline:
    time.sleep(0.1)
print(*node.get_node_names())
"""
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), "AMENT_PREFIX_PATH": sys.prefix}
    result = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True, timeout=60
    )
    return set(result.stdout.split())
