# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Compiled kernels: on disk, and before the first frame."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

import topo_region_seg
from topo_region_seg.compiled import cache

RUN = """
import numpy as np
from topo_region_seg.steps.filtration.leaf_pairs import Edges
from topo_region_seg.steps.filtration.rips import Forest, unite_edges, __file__ as home
assert home.startswith({home!r})
two = np.arange(2)
forest = Forest(two.copy(), np.ones(2, np.int64), two.copy(), np.full(2, np.inf), two.copy(), two, two)
unite_edges(forest, Edges(np.array([4.0]), two[:1], two[1:]), two[:1])
print(forest.death[1])
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A copy of the package without compiled kernels."""
    home = Path(topo_region_seg.__file__).parent
    return shutil.copytree(home, tmp_path / "topo_region_seg", ignore=shutil.ignore_patterns("__pycache__"))


def death(package: Path, **environment: str) -> float:
    """Let the kernels of a package unite two points, in a process of its own."""
    home = package.parent
    run = subprocess.run(
        [sys.executable, "-c", RUN.format(home=str(home))],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": str(home), **environment},
        cwd=home,
    )
    return float(run.stdout)


def test_a_change_in_one_kernel_reaches_those_it_is_compiled_into(package: Path, tmp_path: Path) -> None:
    folder = tmp_path / "cache"
    assert death(package, NUMBA_CACHE_DIR=str(folder)) == 2.0
    (before,) = (folder / "topo_region_seg").iterdir()
    kernels = {path: path.stat().st_mtime_ns for path in before.rglob("*.nb?")}
    assert kernels
    source = package / "compiled" / "union_find.py"
    changed = source.read_text().replace("= scale", "= 7.0 * scale")
    assert changed != source.read_text()
    source.write_text(changed)
    assert death(package, NUMBA_CACHE_DIR=str(folder)) == 14.0
    # The new kernels have a folder of their own; the old ones have not been looked at.
    assert len(list((folder / "topo_region_seg").iterdir())) == 2
    assert {path: path.stat().st_mtime_ns for path in before.rglob("*.nb?")} == kernels


def test_kernels_are_compiled_without_a_cache_where_no_folder_can_be_written(package: Path, tmp_path: Path) -> None:
    no_folder = tmp_path / "file"
    no_folder.touch()
    (package / "__pycache__").touch()
    there = {path for path in tmp_path.rglob("*")}
    places = {"NUMBA_CACHE_DIR": str(no_folder), "XDG_CACHE_HOME": str(no_folder), "PYTHONDONTWRITEBYTECODE": "1"}
    assert death(package, **places) == 2.0
    assert {path for path in tmp_path.rglob("*")} == there


@pytest.mark.parametrize(
    ("chosen", "kept_days", "deleted_days"),
    [("", 0.5, 1.5), ("chosen", 20.0, 40.0)],
    ids=["beside the code", "in a chosen folder"],
)
def test_outdated_kernels_are_deleted(
    chosen: str, kept_days: float, deleted_days: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cache, "PACKAGE", tmp_path / "package")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / chosen) if chosen else "")
    place = tmp_path / chosen / "package" if chosen else tmp_path / "package" / "__pycache__"
    for name, days in {"kernels-kept": kept_days, "kernels-deleted": deleted_days, "else": deleted_days}.items():
        (place / name / "inside").mkdir(parents=True)
        used = time.time() - 24 * 3600 * days
        os.utime(place / name, (used, used))
    own = cache.cache_folder.__wrapped__()
    assert own is not None
    assert own.parent == place
    assert {path.name for path in place.iterdir()} == {"kernels-kept", "else", own.name}


def test_kernels_in_use_do_not_become_outdated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "PACKAGE", tmp_path / "package")
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    own = cache.cache_folder.__wrapped__()
    assert own is not None
    os.utime(own, (0.0, 0.0))
    cache.cache_folder.__wrapped__()
    assert own.stat().st_mtime > time.time() - 3600.0


def test_kernels_are_saved_one_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Numba gives what it saves the next free number: two that look at once would write one file."""
    fcntl = pytest.importorskip("fcntl")
    monkeypatch.setattr(cache, "cache_folder", lambda: tmp_path)
    saved: list[tuple[str, str]] = []

    def save(key: str, data: str) -> None:
        with open(tmp_path / "lock") as lock, pytest.raises(BlockingIOError):
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        saved.append((key, data))

    compiled = SimpleNamespace(_cache=SimpleNamespace(_cache_file=SimpleNamespace(save=save)))
    cache.save_one_at_a_time(compiled)
    for number in "12":
        compiled._cache._cache_file.save(number, "code")
    assert saved == [("1", "code"), ("2", "code")]
    cache.save_one_at_a_time(SimpleNamespace())  # what is not kept


WARM = """
import importlib, pathlib
import numpy as np, topo_region_seg as trs
from topo_region_seg.compiled.cache import PACKAGE, ROOMS

def compiled():
    paths = sorted(path for room in ROOMS for path in (PACKAGE / room).rglob("*.py"))
    names = [".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts) for path in paths]
    modules = [importlib.import_module(name.removesuffix(".__init__")) for name in names]
    return {(m.__name__, k): len(v.signatures) for m in modules for k, v in vars(m).items() if hasattr(v, "signatures")}

trs.warm_up()
before = compiled()
rng = np.random.default_rng(0)
xyz = rng.random((60000, 3)) * [0.6, 0.6, 0.2] + [0.0, 0.0, 0.8]
rgb = rng.integers(0, 256, xyz.shape).astype(np.uint8)
for changes in ({"voxel_size": 0.0}, {"features": "color"}, {"features": "normals"}, {"small_regions": "remove"},
                {"remove_floor": False}, {"crop_box": (0, 0, 0, 1, 1, 1)}, {"max_radius": 0.1, "normal_radius": 0.1},
                {"max_radius": "auto"}, {"output": "supervoxels"}):
    for dtype in (np.float32, np.float64):
        for n in (0, 1, 3000, 60000):
            trs.segment(xyz[:n].astype(dtype), rgb[:n], trs.Params(**changes))
print([name for name, count in compiled().items() if count != before[name]])
"""


def test_warming_up_compiles_what_any_parameters_need() -> None:
    run = subprocess.run([sys.executable, "-c", WARM], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
