# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""README.md is a front door of one page; test_documents.py holds its links, names and Python to the code."""

from __future__ import annotations

import re

from places import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
MOST_BYTES = 8192


def test_it_is_one_page() -> None:
    assert len(README.encode()) <= MOST_BYTES


def test_it_begins_with_a_sentence_a_picture_and_the_demo() -> None:
    first_screen = README[:1500]
    assert re.search(r"!\[[^\]]+\]\(docs/images/\w+\.png\)", first_screen)
    assert "make demo" in first_screen


def test_code_for_a_robot_and_for_python_is_short() -> None:
    blocks = dict(
        re.findall(r"^```(\w+)\n(.*?)^```", README.partition("## On a robot")[2], re.MULTILINE | re.DOTALL)[::-1]
    )
    assert 0 < len(blocks["bash"].splitlines()) <= 6
    assert 0 < len(blocks["python"].splitlines()) <= 5


def test_commands_are_those_of_the_page_about_them() -> None:
    table = re.compile(r"^\| `([a-z]+) [A-Z]", re.MULTILINE)
    page = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")
    assert table.findall(README) == table.findall(page) != []


def test_it_says_how_to_cite_paper_and_package() -> None:
    entries = re.findall(r"^@(\w+)\{", README, re.MULTILINE)
    assert entries == ["inproceedings", "software"]
