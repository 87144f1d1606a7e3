# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml
from places import ROOT

import topo_region_seg

CHANGELOG = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8")
SPDX = (
    "# SPDX-FileCopyrightText: 2026 topo_region_seg contributors",
    "# SPDX-License-Identifier: Apache-2.0",
)
SOURCE_FOLDERS = (
    "topo_region_seg",
    "launch",
    "config",
    "rviz",
    "security",
    "test",
    "benchmarks",
    "scripts",
    "docs",
    "bags",
    "examples",
    ".github",
)
SOURCE_SUFFIXES = (".py", ".sh", ".yaml", ".yml", ".rviz")


def manifest() -> ElementTree.Element:
    return ElementTree.parse(ROOT / "package.xml").getroot()


def source_files() -> list[Path]:
    found = [
        ROOT / "setup.py",
        ROOT / "Makefile",
        ROOT / ".ci" / "run",
        ROOT / ".pre-commit-config.yaml",
        *ROOT.glob("*.yaml"),
        *ROOT.glob("*.cff"),
    ]
    for folder in SOURCE_FOLDERS:
        found += [path for path in (ROOT / folder).rglob("*") if path.suffix in SOURCE_SUFFIXES]
    generated = {"metadata.yaml"}
    return [path for path in found if path.stat().st_size and path.name not in generated]


def test_version_is_the_same_everywhere() -> None:
    version = manifest().findtext("version")
    assert version == topo_region_seg.__version__
    assert re.search(rf"^{re.escape(str(version))} \(\d{{4}}-\d\d-\d\d\)$", CHANGELOG, re.MULTILINE)
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_changelog_is_one_that_the_release_tools_read() -> None:
    changelog = pytest.importorskip("catkin_pkg.changelog", reason="comes with colcon")
    found = changelog.get_changelog_from_path(str(ROOT), package_name="topo_region_seg")
    versions = [version for version, _, _ in found.foreach_version()]
    assert versions == [manifest().findtext("version")]
    assert "Forthcoming" in CHANGELOG
    assert list(ROOT.glob("CHANGELOG*")) == [ROOT / "CHANGELOG.rst"]


def test_one_address_everywhere() -> None:
    urls = {url.get("type"): url.text for url in manifest().findall("url")}
    assert urls.keys() == {"website", "repository", "bugtracker"}
    for name in ("README.md", "CITATION.cff", "CONTRIBUTING.md"):
        found = re.findall(r"https://github\.com/[\w-]+/[\w-]+", (ROOT / name).read_text(encoding="utf-8"))
        assert set(found) == {urls["repository"]}, name


def test_workflows_run_what_the_makefile_has_on_every_python() -> None:
    text = (ROOT / ".github" / "workflows" / "ci.yaml").read_text(encoding="utf-8")
    jobs = yaml.safe_load(text)["jobs"]
    versions = re.findall(r"VERSIONS := (.*)", (ROOT / "Makefile").read_text(encoding="utf-8"))[0].split()
    assert sorted(jobs["test"]["strategy"]["matrix"]["python"]) == sorted(versions)
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"run: make ([a-z-]+)", text)) <= targets


def test_continuous_integration_builds_the_site() -> None:
    assert "make site || status=1" in (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()


def test_setup_reads_the_version_of_the_manifest() -> None:
    output = subprocess.run(
        [sys.executable, "setup.py", "--version"], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    ).stdout
    assert output.split()[-1] == manifest().findtext("version")


def test_manifest_is_one_that_colcon_takes_for_a_ros_package() -> None:
    catkin_pkg = pytest.importorskip("catkin_pkg.package", reason="comes with colcon")
    warnings: list[str] = []
    package = catkin_pkg.parse_package(ROOT / "package.xml", warnings=warnings)
    package.validate(warnings=warnings)
    assert warnings == []
    assert package.get_build_type() == "ament_python"
    assert package.package_format == 3


def test_manifest_names_every_ros_package_that_the_node_imports() -> None:
    declared = {dependency.text for dependency in manifest().findall("exec_depend")}
    imported: set[str] = set()
    for path in (*(ROOT / "topo_region_seg" / "ros").rglob("*.py"), *(ROOT / "launch").glob("*.py")):
        imported |= set(re.findall(r"^\s*(?:from|import) (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE))
    ros = {
        name for name in imported if name in {"rclpy", "launch", "launch_ros", "ament_index_python"} or "_msgs" in name
    }
    ros |= imported & {"builtin_interfaces", "rcl_interfaces"}
    assert ros
    assert ros <= declared


def states_license(path: Path) -> bool:
    lines = path.read_text(encoding="utf-8").splitlines()
    start = 1 if lines[0].startswith("#!") else 0
    return tuple(lines[start : start + 2]) == SPDX


def test_source_files_state_their_license() -> None:
    assert [str(path.relative_to(ROOT)) for path in source_files() if not states_license(path)] == []


def test_license_is_the_one_declared() -> None:
    text = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert "Apache License" in text and "Version 2.0" in text
    assert manifest().findtext("license") == "Apache-2.0"


def test_tool_settings_leave_the_package_to_setup_py() -> None:
    sections = re.findall(r"^\[+([\w-]+)", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(sections) == {"tool"}
