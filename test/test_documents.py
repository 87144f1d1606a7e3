# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What the documents say is there, is there: files, anchors, functions, options, targets, generated parts."""

from __future__ import annotations

import ast
import re
import runpy
import subprocess
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import clouds
import numpy as np
import pytest
import yaml
from places import ROOT

import topo_region_seg
from topo_region_seg.cloud.messages.topics import OUTPUTS
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.parameter_docs import markdown_table
from topo_region_seg.params import Params
from topo_region_seg.ros.node_params import NodeParams
from topo_region_seg.steps.color import srgb_to_lab

FOLDERS = ("", "docs", "bags", ".github")
DOCUMENTS = sorted(path for folder in FOLDERS for path in (ROOT / folder).glob("*.md"))
README = ROOT / "README.md"


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


OTHERS = {"qos_overrides", "configure", "activate", "NAME"}
"""What stands where parameters do and is none of the tables."""
LINK = re.compile(r"\[(?P<words>[^\]]*)\]\((?P<target>[^)#\s]*)(?:#(?P<anchor>[^)\s]*))?\)")


@cache
def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@cache
def prose_of(path: Path) -> str:
    """Return a document without its fenced code."""
    return re.sub(r"^```.*?^```", "", text_of(path), flags=re.MULTILINE | re.DOTALL)


def links(path: Path) -> list[tuple[str, str, str]]:
    found = [(m["words"], m["target"], m["anchor"] or "") for m in LINK.finditer(prose_of(path))]
    return [link for link in found if "://" not in link[1] and not link[1].startswith("mailto:")]


def anchors(path: Path) -> set[str]:
    """Return the anchors of a document's headings, as repository browsers and MyST make them."""
    headings = re.findall(r"^#+ +(.*)$", prose_of(path), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in headings}


def defined(path: Path, name: str) -> bool:
    """Whether a Python file defines a function or class, `f` or `C.f`."""
    scope: Any = ast.parse(text_of(path))
    for part in name.split("."):
        scope = next((node for node in scope.body if getattr(node, "name", None) == part), None)
        if scope is None:
            return False
    return True


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_links_lead_to_files_and_their_headings(document: Path) -> None:
    for words, target, anchor in links(document):
        path = document if not target else (document.parent / target).resolve()
        assert path.exists(), f"[{words}]({target})"
        if anchor:
            assert anchor in anchors(path), f"[{words}]({target}#{anchor})"


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_a_link_named_like_a_function_leads_to_the_file_that_defines_it(document: Path) -> None:
    for words, target, _ in links(document):
        if target.endswith(".py") and re.fullmatch(r"`[\w.]+`", words) and "/" not in words:
            assert defined((document.parent / target).resolve(), words.strip("`")), f"[{words}]({target})"


def test_the_paper_leads_to_the_code_in_two_clicks() -> None:
    assert ("docs/algorithm.md", "from-the-paper-to-the-code") in {link[1:] for link in links(README)}
    table = text_of(ROOT / "docs" / "algorithm.md").partition("\n## Notation")[0]
    rows = [row for row in table.splitlines() if row.startswith("|") and "../topo_region_seg/" in row]
    for wanted in ("equation (5)", "equation (6)", "Algorithm 1", "Algorithm 2", "IV.E"):
        assert any(wanted in row.split("|")[1] for row in rows), wanted


def test_every_page_is_in_the_table_of_contents() -> None:
    toctrees = re.findall(r"^```\{toctree\}(.*?)^```", text_of(ROOT / "docs" / "index.md"), re.MULTILINE | re.DOTALL)
    entries = {name for block in toctrees for name in re.findall(r"^(?:.*<)?(\w+)>?$", block, re.MULTILINE)}
    pages = {path.stem for path in (ROOT / "docs").glob("*") if path.suffix in (".md", ".rst")}
    assert entries == pages - {"index"}


def test_the_reference_has_every_public_name() -> None:
    text = (ROOT / "docs" / "api.rst").read_text(encoding="utf-8")
    documented = set(re.findall(r"^\.\. auto\w+:: (\w+)", text, re.MULTILINE))
    assert documented >= set(topo_region_seg.__all__) - {"__version__"}


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_named_files_and_targets_exist(document: Path) -> None:
    named = re.findall(
        r"`((?:topo_region_seg|\.ci|\.github|benchmarks|scripts|docs|bags|test|config|launch|security|examples|rviz)"
        r"/[\w./-]*\w)`",
        prose_of(document),
    )
    assert [name for name in named if not (ROOT / name).exists()] == []
    targets = set(re.findall(r"^([a-z-]+):", text_of(ROOT / "Makefile"), re.MULTILINE))
    assert set(re.findall(r"\bmake ([a-z-]+)`", text_of(document))) <= targets


def test_options_of_the_command_line_exist(capsys: pytest.CaptureFixture[str]) -> None:
    # What follows other programs' names is theirs; that of this one is in code of its own or after its name.
    elsewhere = re.compile(r"^(?:rosdep|colcon|ros2|export|git|pip|make) .*$|`(?:docker|--ipc)[^`]*`", re.MULTILINE)
    pages = ("command_line", "recordings", "evaluation", "runs", "start", "trouble")
    text = "\n".join(text_of(ROOT / "docs" / f"{page}.md") for page in pages)
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", elsewhere.sub("", text)))
    commands = re.findall(r"^\| `([a-z]+) [A-Z]", text, re.MULTILINE)
    assert len(commands) == 8
    for arguments in (["--help"], *([command, "--help"] for command in commands)):
        with suppress(SystemExit):
            main(arguments)
    known = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", capsys.readouterr().out))
    assert named and named - known == set()


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_yaml_is_yaml_and_names_topics_that_exist(document: Path) -> None:
    for block in re.findall(r"^```yaml\n(.*?)^```", text_of(document), flags=re.MULTILINE | re.DOTALL):
        assert isinstance(yaml.safe_load(block), dict)
        ours = set(re.findall(r"topic: /(\w+)$", block, re.MULTILINE))
        assert ours <= {output.name for output in OUTPUTS}


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_parameters_and_values_that_are_set_exist(document: Path) -> None:
    # What is shown with its output may be there to fail.
    text = re.sub(r"^```console.*?^```", "", text_of(document), flags=re.MULTILINE | re.DOTALL)
    for name, value in re.findall(r"(?:--set |-p |/region_segmentation )(\w+)(?::=|=| )([\w.+-]+)", text):
        if name not in OTHERS:
            table = NodeParams if name in {row.name for row in NodeParams.table()} else Params
            table.from_mapping({name: yaml.safe_load(value)})
    for arguments in re.findall(r"\bParams\(([^)]*)\)", text):
        eval(f"Params({arguments})", {"Params": Params})


def test_parameter_table_is_that_of_the_code() -> None:
    scripts = runpy.run_path(str(ROOT / "scripts" / "write_documents.py"))
    shown = scripts["part_of"](text_of(ROOT / "docs" / "parameters.md"), "parameters")
    assert shown.strip() == markdown_table().strip(), "run: make docs"


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_shown_output_is_what_the_tools_print() -> None:
    """Words and layout are compared; figures are not, as most are times. Where long times fold a table, words."""
    scripts = runpy.run_path(str(ROOT / "scripts" / "write_documents.py"))

    def lines(text: str) -> list[str]:
        plain = re.sub(r"[-+]?\d[\d,]*(?:\.\d+)?", "#", text.replace("─", ""))
        return [" ".join(line.split()) for line in plain.splitlines() if line.strip()]

    for (name, part), commands in scripts["COMMANDS"].items():
        shown = scripts["part_of"](text_of(ROOT / "docs" / name), part)
        there, here = lines(shown), lines(scripts["tool_output"](commands))
        if len(there) != len(here):
            there, here = (sorted(" ".join(text).split()) for text in (there, here))
        assert there == here, f"docs/{name}, {part}; run: make docs"


@pytest.mark.parametrize("document", [README, ROOT / "docs" / "python.md", ROOT / "docs" / "index.md"], ids=name_of)
def test_python_examples_run(document: Path, warm_kernels: None) -> None:
    xyz, rgb = clouds.scene(64, 48)
    names: dict[str, Any] = {"xyz": xyz, "rgb": rgb, "lab": srgb_to_lab(rgb), "params": Params()}
    names["normals"] = np.tile([0.0, 0.0, -1.0], (len(xyz), 1))
    for code in re.findall(r"^```python\n(.*?)^```", text_of(document), re.MULTILINE | re.DOTALL):
        exec(code, names)
        assert names["seg"].regions


def test_every_room_is_described() -> None:
    text = text_of(ROOT / "docs" / "architecture.md")
    package = ROOT / "topo_region_seg"
    files = [path.name for path in package.glob("*.py")]
    rooms = [f"{path.parent.name}/" for path in package.glob("*/__init__.py")]
    rooms += [f"offline/{path.parent.name}/" for path in package.glob("offline/*/__init__.py")]
    assert {room for room in files + rooms if f"`{room}`" not in text} == set()


def test_documents_do_not_say_it_oddly() -> None:
    odd = ("the mend", "anew", "can be had", "set one of the two back", "are what they say")
    tracked = subprocess.run(["git", "ls-files", "*.md", "*.rst", "*.cff"], cwd=ROOT, capture_output=True, text=True)
    paths = [ROOT / name for name in tracked.stdout.split()] or DOCUMENTS
    found = {
        f"{path.name}: {phrase}"
        for path in paths
        for phrase in odd
        if path.exists() and re.search(rf"\b{phrase}\b", text_of(path), re.IGNORECASE)
    }
    assert found == set()
