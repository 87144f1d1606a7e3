# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What the documents on security and quality say."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from places import ROOT

import topo_region_seg

AUDIT = """
import os, sys
opened, connected = set(), []
def note(event, arguments):
    if event == "open" and isinstance(arguments[0], str):
        opened.add(os.path.realpath(arguments[0]))
    elif event == "socket.connect":
        connected.append(arguments[1])
sys.addaudithook(note)
import numpy as np
import topo_region_seg as trs
trs.segment(np.random.default_rng(0).random((500, 3)), np.zeros((500, 3), np.uint8), trs.Params())
program = [sys.prefix, sys.base_prefix, os.path.dirname(trs.__file__), "/proc", "/sys", "/usr", "/etc", "/dev"]
home = tuple(map(os.path.realpath, program))
kernels = (".nbi", ".nbc")
print([path for path in opened if not path.startswith(home) and not path.endswith(kernels)], connected)
"""


def script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_nothing_is_opened_but_the_program_itself(warm_kernels: None, tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, "-c", AUDIT],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(topo_region_seg.__file__).parent.parent)},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    assert result.stdout.strip() == "[] []"


def test_every_dependency_is_listed_with_its_license() -> None:
    dependencies = script("write_dependencies")
    page = (ROOT / "docs" / "dependencies.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| ([\w.-]+) \| `(.+?)` \| .+ \| (.+) \|$", page, re.MULTILINE)
    wanted = [(dependencies.name_of(requirement), requirement) for _, requirement in dependencies.declared()]
    assert [row[:2] for row in listed] == wanted, "run: python scripts/write_dependencies.py"
    assert all(license and license not in ("not installed", "see the package") for *_, license in listed)


@pytest.mark.parametrize("document", ["SECURITY.md", "docs/quality_declaration.md"])
def test_files_and_targets_that_documents_name_exist(document: str) -> None:
    text = (ROOT / document).read_text(encoding="utf-8")
    named = re.findall(
        r"`((?:test|docs|security|scripts|config|benchmarks|\.ci|topo_region_seg)/[\w./-]+)(?:::\w+)?`", text
    )
    named += re.findall(r"`([A-Z]+\.md|LICENSE|package\.xml|setup\.py)`", text)
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"`make ([a-z-]+)`", text)) <= targets
