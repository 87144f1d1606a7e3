# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The command that fills the cache of kernels: what it runs, what it says, and how it fails."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from topo_region_seg import pipeline
from topo_region_seg.beyond.boxes import oriented, surfaces
from topo_region_seg.offline.cli import compile as command
from topo_region_seg.offline.cli.main import main
from topo_region_seg.warming import OUTPUTS


def test_all_outputs_are_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[str] = []
    monkeypatch.setattr(pipeline, "warm_up", lambda outputs=OUTPUTS: done.extend(outputs))
    names = {"pipeline": pipeline, "oriented": SimpleNamespace(warm_up_boxes=lambda: done.append("boxes"))}
    names["surfaces"] = SimpleNamespace(warm_up_surfaces=lambda: done.append("surfaces"))
    for calls in command.PROCESSES:
        for call in calls:
            eval(call, dict(names))
    assert sorted(done) == sorted([*OUTPUTS, "boxes", "surfaces"])
    done.clear()
    for call in command.LAST:
        eval(call, dict(names))
    assert tuple(done) == OUTPUTS
    assert callable(oriented.warm_up_boxes) and callable(surfaces.warm_up_surfaces)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache; what is to be compiled takes no time."""
    monkeypatch.setattr(command, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(command, "IMPORTS", "")
    monkeypatch.setattr(command, "PROCESSES", (("int()",), ("int()", "int()")))
    monkeypatch.setattr(command, "LAST", ("int()",))
    return tmp_path


def test_it_says_what_it_has_compiled(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["compile"]) == 0
    assert capsys.readouterr().out == f"all kernels are in {folder}\n"
    made: Callable[..., object] = command._child

    def child(calls: tuple[str, ...]) -> object:
        (folder / f"{len(calls)}.1.nbc").touch()
        return made(calls)

    monkeypatch.setattr(command, "_child", child)
    monkeypatch.setattr(command, "cores", lambda: 2)
    assert main(["compile"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("2 kernels compiled in ") and said.endswith(f" s into {folder}\n")


@pytest.mark.usefixtures("folder")
def test_what_fails_is_said_in_one_line(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "LAST", ("nothing()",))
    assert main(["compile"]) == 2
    assert capsys.readouterr().err == (
        "topo_region_seg compile: error: the kernels cannot be compiled: NameError: name 'nothing' is not defined\n"
    )


def test_without_a_folder_it_names_the_variable(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "cache_folder", lambda: None)
    assert main(["compile"]) == 2
    assert "set NUMBA_CACHE_DIR" in capsys.readouterr().err
