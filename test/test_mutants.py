# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The mutation run: which changes it makes, which tests it tries, and what it publishes."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest
import yaml
from places import ROOT


@pytest.fixture(scope="module", autouse=True)
def scripts() -> Iterator[None]:
    sys.path.insert(0, str(ROOT / "scripts"))
    yield
    sys.path.remove(str(ROOT / "scripts"))


@pytest.fixture(scope="module")
def chosen(scripts: None) -> list[Any]:
    from mutation.choice import chosen

    return chosen(ROOT, seed=0)


def test_each_is_one_small_change_that_python_can_read(chosen: list[Any]) -> None:
    assert len({mutant.id for mutant in chosen}) == len(chosen) >= 150
    for mutant in chosen:
        text = (ROOT / "topo_region_seg" / mutant.file).read_text(encoding="utf-8")
        assert ast.dump(ast.parse(text)) != ast.dump(ast.parse(mutant.text)), mutant
        same = len(set(text.splitlines()) & set(mutant.text.splitlines())) / len(set(text.splitlines()))
        assert same > 0.7 and mutant.before != mutant.after


@pytest.mark.parametrize(
    ("source", "changed"),
    [
        ("a < b", ["a <= b"]),
        ("x = 3", ["x = 4", "x = 2"]),
        ("not a", ["(a)"]),
        ("f(a, b)", ["pass", "f(b, a)"]),
        ("min(a)", ["pass", "max(a)"]),
        ("a and b", ["a or b"]),
        ("raise E", ["pass"]),
        ("if a:\n    b = c", ["if (not (a)):\n    b = c"]),
        ("assert a < b", []),
        ("def f(a: int = 0) -> int: ...", ["def f(a: int = 1) -> int: ..."]),
        ("'ä' == b + 1", ["'ä' != b + 1", "'ä' == b - 1", "'ä' == b + 2", "'ä' == b + 0"]),
    ],
)
def test_the_changes_of_a_line(source: str, changed: list[str]) -> None:
    from mutation.operators import edits

    assert [source[: edit.start] + edit.text + source[edit.end :] for edit in edits(source)] == changed


def test_rooms_have_their_tests_and_those_of_the_file_s_name_come_first() -> None:
    from mutation.rooms import BY_NAME, ROOMS, tests_of

    for room in ROOMS:
        for file in room.files(ROOT):
            own, others = tests_of(room, file, ROOT)
            assert own or others
            assert not set(own) & set(others)
    own, others = tests_of(BY_NAME["tools"], "offline/inspection/topic.py", ROOT, {"test/offline/test_segment.py": 9.0})
    assert own == ["test/offline/test_inspect.py"] and others[-1] == "test/offline/test_segment.py"


def test_the_page_tells_what_was_tried_and_what_was_not(chosen: list[Any]) -> None:
    from mutation.page import page

    killed, survived, alike, late = chosen[:4]
    results = {
        mutant.id: {"room": mutant.room, "result": result, "date": "2026-01-02"}
        for mutant, result in ((killed, "killed"), (survived, "survived"), (alike, "survived"), (late, "timeout"))
    }
    text = page(ROOT, chosen, results, {alike.id: "Because."}, {survived.id: "Why not."})
    assert "**67 %** of 3 changes were noticed" in text and "Tried on 2026-01-02, commit " in text
    assert (
        f"{len(chosen)} are chosen, 1 of them change nothing that can be seen, {len(chosen) - 4} were not tried" in text
    )
    assert "| all | 3 | 1 | 1 | 1 | 67 % |" in text
    unseen, _, nothing = text.partition("## Not noticed")[2].partition("## Nothing changes")
    assert f"{survived.file}:{survived.line}" in unseen and "Why not." in unseen and "Because." not in unseen
    assert f"{alike.file}:{alike.line}" in nothing and "Because." in nothing


@pytest.mark.parametrize("file", ["equivalent.yaml", "survivors.yaml"])
def test_what_is_listed_has_a_reason(file: str) -> None:
    listed = yaml.safe_load((ROOT / "scripts" / "mutation" / file).read_text(encoding="utf-8"))
    for name, reason in listed.items():
        assert len(str(name)) == 10 and str(reason).endswith("."), name


def test_they_are_listed_without_being_tried() -> None:
    command = [sys.executable, str(ROOT / "scripts" / "mutants.py"), "--list", "--room", "cloud"]
    # Where Python is told to trust no folder, the script would not find its own modules.
    environment = os.environ | {"PYTHONPATH": str(ROOT / "scripts")}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.count("cloud/") >= 26
