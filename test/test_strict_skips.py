# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The rule that a run in continuous integration skips nothing that is not on the list."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from places import TEST
from strict_skips import ALLOWED


def status_and_output(folder: Path, reason: str, *options: str, ci: str = "") -> tuple[int, str]:
    (folder / "conftest.py").write_text("from strict_skips import pytest_addoption, pytest_configure\n")
    (folder / "test_a.py").write_text(
        f"import pytest\n\n@pytest.mark.skipif(True, reason={reason!r})\ndef test_skipped(): ...\ndef test_run(): ...\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", str(folder), *options],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(TEST), "CI": ci},
        capture_output=True,
        text=True,
        timeout=60,
    )
    return done.returncode, done.stdout


@pytest.mark.parametrize(("options", "ci"), [(["--strict-skips"], ""), ([], "true")])
def test_a_skip_that_is_not_on_the_list_fails_the_run_and_is_named(tmp_path: Path, options: list[str], ci: str) -> None:
    status, said = status_and_output(tmp_path, "no such program", *options, ci=ci)
    assert status == 1
    assert "test_a.py::test_skipped: no such program" in said


def test_a_skip_that_is_on_the_list_does_not(tmp_path: Path) -> None:
    assert status_and_output(tmp_path, f"needs {ALLOWED[0]}", "--strict-skips")[0] == 0


def test_on_a_desk_any_skip_will_do(tmp_path: Path) -> None:
    assert status_and_output(tmp_path, "no such program")[0] == 0
