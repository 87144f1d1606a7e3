# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot set up by rosdep and colcon has no package that only pip brings: commands work without it, or name it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from bag_maker import cloud_entries, write_mcap
from clouds import scene
from places import ROOT

from topo_region_seg.cloud.files import write_labeled_cloud
from topo_region_seg.data import Cloud
from topo_region_seg.offline.cli.main import COMMANDS, main
from topo_region_seg.offline.cli.packages import PIP_NAMES

RUNNER = """
import contextlib, importlib.machinery, io, json, sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in sys.argv[1].split(","):
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)

sys.meta_path.insert(0, Missing())
from topo_region_seg.offline.cli.main import main
found = []
for line in json.loads(sys.argv[2]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main(line)
    found.append([status, out.getvalue(), err.getvalue()])
print(json.dumps(found))
"""
TAKES_PARAMETERS = {"yaml"}  # which rosdep brings, too
READS_BAGS = {"rosbags", "mcap", "lz4", "zstandard", "yaml"}
DRAWS = {"matplotlib", "PIL"}
TABLES = {"rich"}


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a cloud in both formats, a recording and a run."""
    folder = tmp_path_factory.mktemp("given")
    xyz, rgb = scene()
    for name in ("in.ply", "in.pcd"):
        write_labeled_cloud(folder / name, Cloud(xyz, rgb, 48, 64), np.zeros(len(xyz), np.uint32))
    write_mcap(folder / "in.mcap", cloud_entries(2))
    assert main(["replay", str(folder / "in.mcap"), "-o", str(folder / "run.mcap")]) == 0
    return folder


def lines_of(folder: Path) -> dict[str, tuple[list[str], set[str]]]:
    """Command lines by name, each with the packages that it cannot do without."""
    bag, run, out = str(folder / "in.mcap"), str(folder / "run.mcap"), str(folder / "out")
    return {
        "version": (["--version"], set()),
        "help": (["--help"], set()),
        "segment": (["segment", str(folder / "in.ply"), "-o", f"{out}.ply"], TAKES_PARAMETERS),
        "segment PCD": (["segment", str(folder / "in.pcd")], TAKES_PARAMETERS | {"lzf"}),
        "segment to PCD": (
            ["segment", str(folder / "in.ply"), "-o", f"{out}.pcd"],
            TAKES_PARAMETERS | {"pypcd4", "lzf"},
        ),
        "segment and draw": (["segment", str(folder / "in.ply"), "--barcode", f"{out}.png"], TAKES_PARAMETERS | DRAWS),
        "compile": (["compile", "--help"], set()),
        "inspect": (["inspect", bag], READS_BAGS | TABLES),
        "replay": (["replay", bag], READS_BAGS | TABLES),
        "evaluate": (["evaluate", bag, "--recorded-labels", "--truth-bag", bag], READS_BAGS | TABLES),
        "sweep": (["sweep", bag, "--cache", f"{out}.cache"], READS_BAGS | TABLES),
        "report": (["report", run, "-o", f"{out}.html"], READS_BAGS | {"PIL", "jinja2"}),
        "compare": (["compare", run, run], READS_BAGS | TABLES),
        "compare and draw": (["compare", run, run, "--picture", f"{out}.png"], READS_BAGS | TABLES | DRAWS),
        "play": (["play", bag, "--wait-timeout", "0.1"], READS_BAGS),
    }


def run_without(packages: set[str], lines: list[list[str]]) -> list[tuple[int, str, str]]:
    """Run command lines in a process that cannot import some packages; return status, output and errors of each."""
    code = [sys.executable, "-c", RUNNER, ",".join(sorted(packages)), json.dumps(lines)]
    done = subprocess.run(code, cwd=ROOT, capture_output=True, text=True, timeout=150)
    assert done.returncode == 0, done.stderr
    return [tuple(found) for found in json.loads(done.stdout.splitlines()[-1])]


@pytest.mark.parametrize("package", sorted(PIP_NAMES))
def test_commands_work_without_a_package_or_name_it(package: str, given: Path, warm_kernels: None) -> None:
    lines = lines_of(given)
    assert {line[0] for line, _ in lines.values()} >= set(COMMANDS)
    found = run_without({package}, [line for line, _ in lines.values()])
    for (name, (_, needed)), (status, out, err) in zip(lines.items(), found, strict=True):
        assert "Traceback" not in err and "internal error" not in err, f"{name}: {err}"
        if package in needed:
            assert status == 2 and err.count("\n") == 1 and not out, f"{name}: {status} {out} {err}"
            assert f"pip install {PIP_NAMES[package]}\n" in err, f"{name}: {err}"
        else:
            assert "pip install" not in err.replace("pip install '.[ros]'", ""), f"{name}: {err}"


def test_all_missing_packages_are_named_at_once(given: Path, warm_kernels: None) -> None:
    lines = lines_of(given)
    names = ("version", "help", "segment", "replay")
    version, help_text, segment, replay = run_without(set(PIP_NAMES) - {"yaml"}, [lines[name][0] for name in names])
    assert version[0] == help_text[0] == segment[0] == 0
    assert "2 regions" in segment[1] and "persistence (mm)" in segment[1]
    assert replay[0] == 2 and replay[2].count("\n") == 1
    every = " ".join(sorted(pip for module, pip in PIP_NAMES.items() if module != "yaml"))
    assert f"pip install {every}" in replay[2]


def test_every_package_that_pip_brings_is_known() -> None:
    setup = (ROOT / "setup.py").read_text(encoding="utf-8")
    listed = setup.partition("install_requires=[")[2].partition("],")[0]
    names = {line.strip().strip('"').partition(">")[0] for line in listed.splitlines() if line.strip().startswith('"')}
    assert names - {"numpy", "scipy", "numba"} == set(PIP_NAMES.values())
