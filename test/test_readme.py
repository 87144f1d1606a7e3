# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What README.md and the other documents say is there, is there."""

from __future__ import annotations

import re
import runpy
from contextlib import suppress
from pathlib import Path

import clouds
import numpy as np
import pytest
from places import ROOT

from topo_region_seg.offline.cli.main import main
from topo_region_seg.steps.color import srgb_to_lab

DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "bags").glob("*.md")])
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_parameter_table_is_that_of_the_code() -> None:
    with_parameters = runpy.run_path(str(ROOT / "scripts" / "write_readme.py"))["with_parameters"]
    assert with_parameters(README) == README, "run: make docs"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_and_pictures_lead_to_files(document: Path) -> None:
    targets = re.findall(r"\]\(([^)#\s]+)[^)]*\)", document.read_text(encoding="utf-8"))
    missing = [name for name in targets if "://" not in name and not (document.parent / name).exists()]
    assert not missing


def test_named_source_files_exist() -> None:
    named = re.findall(r"`((?:topo_region_seg|benchmarks|scripts|docs|bags|test|config|launch)/[\w./-]+)`", README)
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_make_targets_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"\bmake ([a-z-]+)`", README)) <= targets


def test_options_of_the_command_line_exist(capsys: pytest.CaptureFixture[str]) -> None:
    # What follows other programs' names is theirs; that of this one is in code of its own or after its name.
    elsewhere = re.compile(r"^(?:rosdep|colcon|ros2|export) .*$|`docker [^`]*`", re.MULTILINE)
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", elsewhere.sub("", README)))
    commands = re.findall(r"^\| `([a-z]+) [A-Z]", README, re.MULTILINE)
    assert len(commands) == 8
    for arguments in (["--help"], *([command, "--help"] for command in commands)):
        with suppress(SystemExit):
            main(arguments)
    known = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", capsys.readouterr().out))
    assert named and named - known == set()


def test_python_examples_run(warm_kernels: None) -> None:
    first, second = re.findall(r"^```python\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
    xyz, rgb = clouds.scene(64, 48)
    names = {"xyz": xyz, "rgb": rgb, "lab": srgb_to_lab(rgb), "normals": np.tile([0.0, 0.0, -1.0], (len(xyz), 1))}
    exec(first, names)
    assert names["seg"].regions
    names["params"] = names["trs"].Params()
    exec(second, names)


def test_every_room_is_described() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    package = ROOT / "topo_region_seg"
    rooms = [path.name for path in package.glob("*.py")] + [f"{path.parent.name}/" for path in package.glob("*/*.py")]
    assert {room for room in rooms if f"`{room}`" not in text} == set()
