# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The node sends through shared memory that a cloud fits into, unless somebody has chosen otherwise."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest

from topo_region_seg.ros import transport
from topo_region_seg.ros.transport import PROFILES, SEGMENT, TRANSPORTS, VARIABLES, use_shared_memory_for_clouds


@pytest.fixture(autouse=True)
def room(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "statvfs", lambda _: SimpleNamespace(f_bavail=2 * SEGMENT >> 12, f_frsize=1 << 12))


def test_the_file_asks_for_the_segment_that_is_said() -> None:
    sizes = [int(e.text or 0) for e in ElementTree.parse(PROFILES).iter() if e.tag.endswith("segment_size")]
    assert sizes == [SEGMENT]


def test_as_many_processes_are_found_as_without_it() -> None:
    peers = [int(e.text or 0) for e in ElementTree.parse(PROFILES).iter() if e.tag.endswith("maxInitialPeersRange")]
    assert peers == [32, 32], "what rmw_fastrtps_cpp takes; Fast DDS itself takes 4"


@pytest.mark.parametrize(
    ("library", "variable"), [("libfastrtps.so.2.14", VARIABLES[0]), ("libfastdds.so.3.2", VARIABLES[1])]
)
def test_it_is_used_where_nothing_else_is_chosen(
    library: str, variable: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "other"))
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / library).touch()
    given = {"AMENT_PREFIX_PATH": os.pathsep.join([str(tmp_path / "none"), str(tmp_path)])}
    environment = dict(given)
    assert use_shared_memory_for_clouds(environment) is None
    assert environment == {**given, variable: str(PROFILES)}


@pytest.mark.parametrize("name", [*VARIABLES, TRANSPORTS])
def test_what_the_user_has_set_stays(name: str) -> None:
    environment = {name: "mine"}
    assert name in str(use_shared_memory_for_clouds(environment))
    assert environment == {name: "mine"}


@pytest.mark.parametrize("name", ["DEFAULT_FASTRTPS_PROFILES.xml", "DEFAULT_FASTDDS_PROFILES.xml"])
def test_the_profiles_of_the_folder_stay(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("<dds/>")
    environment: dict[str, str] = {}
    assert str(tmp_path) in str(use_shared_memory_for_clouds(environment))
    assert environment == {}


def test_a_container_with_little_shared_memory_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "statvfs", lambda _: SimpleNamespace(f_bavail=(2 * SEGMENT >> 12) - 1, f_frsize=1 << 12))
    environment: dict[str, str] = {}
    assert f"{(2 * SEGMENT >> 20) - 1} MB left" in str(use_shared_memory_for_clouds(environment))
    assert environment == {}


def test_a_machine_without_shared_memory_is_left_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.undo()
    monkeypatch.setattr(transport, "SHARED_MEMORY", tmp_path / "none")
    environment: dict[str, str] = {}
    assert "none" in str(use_shared_memory_for_clouds(environment))
    assert environment == {}


@pytest.mark.parametrize("chosen", [None, "DEFAULT"])
def test_the_node_has_the_segment(
    chosen: str | None, ros_domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")
    from ros_harness import running_node

    monkeypatch.undo()
    free = os.statvfs("/dev/shm")
    if free.f_bavail * free.f_frsize < 2 * SEGMENT:
        pytest.skip("less than 64 MB are left in /dev/shm")
    if chosen:
        monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", chosen)
    with running_node(ros_domain, tmp_path / "log.txt", "-p", "autostart:=false") as node:
        node.wait_for_log("autostart is off")
        maps = Path(f"/proc/{node.process.pid}/maps").read_text()
        mapped = re.findall(r"^(\w+)-(\w+) .*/dev/shm/fast(?:rtps|dds)_\w+", maps, re.MULTILINE)
        largest = max(int(end, 16) - int(start, 16) for start, end in mapped)
        assert (largest >= SEGMENT) == (chosen is None)
        assert ("transports of Fast DDS left as they are" in node.log) == (chosen is not None)


def test_a_player_among_many_processes_is_heard(
    ros_domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")
    from ros_harness import ROOT, Client, running_node, until

    monkeypatch.undo()
    domain = ros_domain + 50
    clients = [Client(domain) for _ in range(6)]
    play = [sys.executable, "-m", "topo_region_seg", "play", str(ROOT / "bags" / "tabletop_sim"), "--loop"]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), "PYTHONPATH": str(ROOT)}
    try:
        with running_node(domain, tmp_path / "log.txt"), subprocess.Popen(play, env=environment) as player:
            until(lambda: clients[-1].labeled, "labels")
            player.send_signal(signal.SIGINT)
    finally:
        for client in clients:
            client.close()
