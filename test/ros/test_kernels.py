# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Kernels are compiled in a process of their own, once, and it ends when nobody wants them any more."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from topo_region_seg.ros import kernels

SOUGHT = "import os, pathlib; pathlib.Path(os.environ['FOUND']).write_text(os.environ['PYTHONPATH'])"


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(kernels, "cache_folder", lambda: tmp_path)
    monkeypatch.setenv("FOUND", str(tmp_path / "found"))
    monkeypatch.setattr(kernels, "COMPILE", (sys.executable, "-c", SOUGHT))
    return tmp_path


def test_a_process_that_finds_the_package_fills_an_empty_cache(cache: Path) -> None:
    kernels.fill_cache(lambda: True)
    assert str(Path(kernels.__file__).parents[2]) in (cache / "found").read_text()


def test_a_full_cache_is_left_alone(cache: Path) -> None:
    (cache / kernels.COMPLETE).touch()
    kernels.fill_cache(lambda: True)
    assert not (cache / "found").exists()


def test_without_a_cache_nothing_is_compiled_that_could_not_be_kept(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kernels, "cache_folder", lambda: None)
    kernels.fill_cache(lambda: True)
    assert not (cache / "found").exists()


def test_it_is_ended_when_nobody_wants_it(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    slow = f"import time; time.sleep(20)\n{SOUGHT}"
    monkeypatch.setattr(kernels, "COMPILE", (sys.executable, "-c", slow))
    kernels.fill_cache(lambda: False)
    assert not (cache / "found").exists()


def test_what_cannot_be_started_does_no_harm(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels, "COMPILE", (str(cache / "missing"),))
    kernels.fill_cache(lambda: True)


def test_loading_them_marks_the_cache(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[str] = []
    for name in ("warm_up", "warm_up_boxes", "warm_up_surfaces"):
        monkeypatch.setattr(kernels, name, lambda name=name: loaded.append(name))
    kernels.load_kernels()
    assert sorted(loaded) == ["warm_up", "warm_up_boxes", "warm_up_surfaces"]
    assert (cache / kernels.COMPLETE).exists()
