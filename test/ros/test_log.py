# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings by reason, counted while they are held back; and where log files would go."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from topo_region_seg.ros import log as module
from topo_region_seg.ros.log import ReasonLog, unwritable_folder

PERIOD = 5.0


@given(st.lists(st.tuples(st.sampled_from("ab"), st.sampled_from([0.0, 1.0, 4.0, 5.0])), max_size=30))
def test_every_warning_is_written_or_counted_in_the_next(calls: list[tuple[str, float]]) -> None:
    lines: list[str] = []
    wanted: list[str] = []
    last: dict[str, float] = {}
    held: dict[str, int] = {}
    with pytest.MonkeyPatch.context() as patch:
        now = [0.0]
        patch.setattr(module, "time", SimpleNamespace(monotonic=lambda: now[0]))
        log = ReasonLog(SimpleNamespace(warning=lines.append), lambda: PERIOD)  # type: ignore[arg-type]
        for reason, later in calls:
            now[0] += later
            log.throttled(reason, "text")
            if reason in last and now[0] - last[reason] < PERIOD:
                held[reason] = held.get(reason, 0) + 1
                continue
            last[reason] = now[0]
            count = held.pop(reason, 0)
            wanted.append(f"[{reason}] text" + (f" (and {count} more since the last warning)" if count else ""))
    assert lines == wanted


def test_what_is_said_once_is_said_once() -> None:
    lines: list[str] = []
    log = ReasonLog(SimpleNamespace(warning=lines.append), lambda: 0.0)  # type: ignore[arg-type]
    for _ in range(3):
        log.once("a", "first")
        log.once("b", "second")
    assert lines == ["[a] first", "[b] second"]


@pytest.mark.parametrize(
    ("environment", "folder"),
    [
        ({"ROS_LOG_DIR": "logs", "ROS_HOME": "ros"}, "logs"),
        ({"ROS_HOME": "ros"}, "ros/log"),
        ({}, "home/.ros/log"),
        ({"ROS_LOG_DIR": "", "ROS_HOME": ""}, "home/.ros/log"),
        ({"ROS_LOG_DIR": "~/mine"}, "home/mine"),
    ],
)
def test_the_folder_is_that_of_rcl(
    environment: dict[str, str], folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    for name in ("ROS_LOG_DIR", "ROS_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert unwritable_folder() is None
    assert [path for path in tmp_path.rglob("*") if path.is_dir() and not any(path.iterdir())] == [tmp_path / folder]


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "file" / "logs"))
    (tmp_path / "file").touch()
    assert unwritable_folder() == f"{tmp_path / 'file' / 'logs'}: Not a directory"
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "logs"))
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK)
    assert unwritable_folder() == f"{tmp_path / 'logs'}: not writable"
