# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Data flows one way, so imports do: read from the source, lazy imports and those for types included."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = "topo_region_seg"
ROOT = Path(__file__).resolve().parent.parent

# What each room may import of the others; a room is a folder or a file of the package.
TABLES = {"params", "data"}
CORE = {*TABLES, "kernels", "parallel", "stages", "pipeline"}
EDGES = {*TABLES, "cloud_layout", "pointcloud2", "messages", "palette"}
MAY_IMPORT: dict[str, set[str]] = {
    "params": set(),
    "data": {"params"},
    "kernels": {"data", "parallel"},
    "parallel": set(),
    "stages": {*TABLES, "kernels", "parallel"},
    "pipeline": {*TABLES, "kernels", "parallel", "stages"},
    "api": CORE,
    "": {*CORE, "api"},  # the package's own __init__
    "palette": {"data"},
    "cloud_layout": TABLES,
    "pointcloud2": {*TABLES, "cloud_layout", "kernels"},
    "messages": {*EDGES, "kernels"},
    "ply": set(),
    "cloud_files": {*TABLES, "cloud_layout", "pointcloud2", "ply"},
    "bags": EDGES,
    "figures": {*TABLES, "palette"},
    "simulation": {*EDGES, "bags", "stages"},
    "runs": {"", *CORE, *EDGES, "bags", "evaluation"},
    "report": {"", *TABLES, "palette", "evaluation", "figures", "runs"},
    "evaluation": {"", *CORE, "cloud_layout", "pointcloud2", "bags"},
    "inspection": {*CORE, *EDGES, "bags"},
    "parameter_docs": {"params", "ros"},
    "ros": {*CORE, *EDGES},
    "tools": {
        "",
        "api",
        *CORE,
        *EDGES,
        "bags",
        "cloud_files",
        "figures",
        "inspection",
        "report",
        "runs",
        "simulation",
        "evaluation",
        "ros",
        "parameter_docs",
    },
    "__main__": {"tools"},
    "demo": {"", "api", *CORE, *EDGES, "bags", "cloud_files", "figures", "simulation", "tools", "ros"},
}

# Which rooms may import what is not there on every machine, or is slow to load.
ROS = {
    "ament_index_python",
    "builtin_interfaces",
    "diagnostic_msgs",
    "geometry_msgs",
    "lifecycle_msgs",
    "rcl_interfaces",
    "rclpy",
    "sensor_msgs",
    "std_msgs",
    "visualization_msgs",
}
EXTERNAL_ROOMS = {
    **{name: {"ros"} for name in ROS},
    "numba": {"kernels"},
    "matplotlib": {"figures"},
    "rosbags": {"bags"},
    "mcap": {"bags"},
    "lz4": {"bags"},
    "zstandard": {"bags"},
    "pypcd4": {"cloud_files"},
    "imgviz": {"demo", "simulation"},
    "PIL": {"report"},
    "distributed": {"evaluation"},
    "dask": {"evaluation"},
}
NOT_ON_A_ROBOT = {"rosbags", "mcap", "lz4", "zstandard", "matplotlib", "rich", "pypcd4", "yaml", "imgviz"}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted((ROOT / PACKAGE).rglob("*.py"))}


def imports(module: str) -> Iterator[str]:
    """Yield the dotted name of everything that `module` imports, submodules named in full."""
    for node in ast.walk(ast.parse(MODULES[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: relative import in line {node.lineno}"
            assert node.module
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                yield full if full in MODULES else node.module


def room(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


def inside(module: str) -> set[str]:
    return {name for name in imports(module) if name.split(".")[0] == PACKAGE}


def test_every_room_is_known() -> None:
    assert {room(module) for module in MODULES} <= set(MAY_IMPORT)


def test_imports_point_one_way() -> None:
    wrong = [
        f"{module} imports {name}"
        for module in MODULES
        for name in inside(module)
        if room(name) not in MAY_IMPORT[room(module)] | {room(module)}
    ]
    assert wrong == []


def test_what_is_not_everywhere_stays_in_its_room() -> None:
    wrong = [
        f"{module} imports {name}"
        for module in MODULES
        for name in imports(module)
        if room(module) not in EXTERNAL_ROOMS.get(name.split(".")[0], {room(module)})
    ]
    assert wrong == []


def test_imports_have_no_cycle() -> None:
    graph = {module: inside(module) - {module, PACKAGE} for module in MODULES}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"modules import each other: {' -> '.join(error.args[1])}")


def test_node_needs_only_what_a_robot_has() -> None:
    todo, seen = [f"{PACKAGE}.ros.node"], set()
    while todo:
        module = todo.pop()
        if module in seen:
            continue
        seen.add(module)
        names = set(imports(module))
        assert not {name.split(".")[0] for name in names} & NOT_ON_A_ROBOT, f"{module}, which the node imports"
        todo += [name for name in names if name in MODULES]


def test_package_import_is_light() -> None:
    slow = sorted({"numba", "scipy", "rclpy", "rosbags", "mcap", "matplotlib", "rich"})
    code = f"import sys, {PACKAGE}; print([name for name in {slow} if name in sys.modules])"
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    )
    assert result.stdout.strip() == "[]"
