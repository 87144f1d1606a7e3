# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What killed processes leave in the shared memory goes at the next start; what lives stays."""

from __future__ import annotations

import fcntl
import os
import re
import signal
import time
from pathlib import Path

import pytest

from topo_region_seg.ros import transport
from topo_region_seg.ros.dead_segments import YOUNG, remove_dead_segments
from topo_region_seg.ros.transport import VARIABLES, prepare_fast_dds

DEAD, ALIVE, NEW = "fastrtps_0123456789abcdef", "fastrtps_fedcba9876543210", "fastdds_00000000000000aa"
OTHERS = ["fastrtps_port7411", "fastrtps_port7411_el", "fastrtps_0123456789abcdeff_el", "sem.x_mutex", "mine_el"]


def made(folder: Path, name: str, age: float = 60.0) -> Path:
    """Make a segment of 8 KB and its lock file, as old as is said; return the lock file."""
    (folder / name).write_bytes(os.urandom(8192))
    lock = folder / f"{name}_el"
    lock.touch()
    os.utime(lock, (time.time() - age,) * 2)
    return lock


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_only_segments_that_nobody_holds_are_removed(tmp_path: Path) -> None:
    made(tmp_path, DEAD)
    alive = made(tmp_path, ALIVE)
    made(tmp_path, "fastrtps_1111111111111111").with_name("fastrtps_1111111111111111").unlink()
    for name in OTHERS:
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (0, 0))
    with alive.open() as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert remove_dead_segments(tmp_path) == (2, 8192)
        assert names(tmp_path) == {ALIVE, f"{ALIVE}_el", *OTHERS}
    assert remove_dead_segments(tmp_path) == (1, 8192), "its process has died"
    assert names(tmp_path) == set(OTHERS)


def test_one_that_has_just_been_made_is_not_taken_for_dead(tmp_path: Path) -> None:
    made(tmp_path, NEW, age=0.0)
    assert remove_dead_segments(tmp_path) == (0, 0)
    os.utime(tmp_path / f"{NEW}_el", (time.time() - 2 * YOUNG,) * 2)
    assert remove_dead_segments(tmp_path) == (1, 8192)


def test_a_segment_without_its_lock_file_and_a_link_stay(tmp_path: Path) -> None:
    made(tmp_path, DEAD).unlink()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.touch()
    os.utime(elsewhere, (0, 0))
    (tmp_path / f"{ALIVE}_el").symlink_to(elsewhere)
    before = names(tmp_path)
    assert remove_dead_segments(tmp_path) == (0, 0)
    assert names(tmp_path) == before


def test_without_shared_memory_nothing_happens(tmp_path: Path) -> None:
    assert remove_dead_segments(tmp_path / "none") == (0, 0)


def test_it_is_said_and_the_room_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transport, "SHARED_MEMORY", tmp_path)
    monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
    monkeypatch.delenv("RMW_IMPLEMENTATION", raising=False)
    made(tmp_path, DEAD)
    removed, left = prepare_fast_dds()
    assert removed == f"removed 1 segment(s) of dead processes from {tmp_path}, 0 MB"
    assert "FASTDDS_BUILTIN_TRANSPORTS is set" in left


def test_other_middlewares_are_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transport, "SHARED_MEMORY", tmp_path)
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    made(tmp_path, DEAD)
    assert prepare_fast_dds() == []
    assert not set(VARIABLES) & set(os.environ)
    assert f"{DEAD}_el" in names(tmp_path)


def test_what_a_killed_node_leaves_goes_at_the_next_start(ros_domain: int, tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")
    from ros_harness import NodeProcess, running_node

    def own_segments(node: NodeProcess) -> list[Path]:
        """Return the segments whose lock files the process holds; it maps those of others, too."""
        files = [os.readlink(link) for link in Path(f"/proc/{node.process.pid}/fd").iterdir()]
        return [
            Path(found[1]) for file in files if (found := re.fullmatch(r"(/dev/shm/fastrtps_[0-9a-f]{16})_el", file))
        ]

    killed = NodeProcess(ros_domain + 50, tmp_path / "killed.txt", "-p", "autostart:=false")
    killed.wait_for_log("autostart is off")
    with running_node(ros_domain + 50, tmp_path / "alive.txt", "-p", "autostart:=false") as alive:
        alive.wait_for_log("autostart is off")
        living, left = own_segments(alive), own_segments(killed)
        assert living and left and all(path.exists() for path in (*living, *left)), "or there is nothing to test"
        killed.process.send_signal(signal.SIGKILL)
        killed.process.wait()
        time.sleep(YOUNG)
        there = all(path.exists() for path in left)  # unless a node of another suite on this machine removed them
        with running_node(ros_domain + 50, tmp_path / "next.txt", "-p", "autostart:=false") as node:
            node.wait_for_log("autostart is off")
            assert not there or "segment(s) of dead processes" in node.log
            assert not [path for path in left if path.exists()]
            assert all(path.exists() for path in living)
