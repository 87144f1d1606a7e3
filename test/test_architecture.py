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
from places import ROOT

PACKAGE = "topo_region_seg"

# The floors of the package, the lowest first: a room may import from floors below its own and from itself. A room is a
# folder or file named here; the longest name that fits counts.
FLOORS: tuple[set[str], ...] = (
    {"parameter_table", "clock"},
    {"params"},
    {"growth"},
    {"data"},
    {"compiled"},
    {"steps.view"},
    {
        "steps.sensor",
        "steps.crop",
        "steps.support",
        "steps.thinning",
        "steps.color",
        "steps.normals",
        "steps.homogeneity",
        "steps.filtration",
        "steps.small_regions",
        "steps.regions",
        "steps.scales",
        "cloud",
    },
    {"beyond.objects", "beyond.supervoxels", "beyond.auto_scale", "beyond.adjacency"},
    {"output"},
    {"segmentation"},
    {"beyond.boxes", "beyond.tracking", "diagnosis", "warming"},
    {"cloud.messages"},
    {"pipeline"},
    {"api"},
    {""},  # the package's own __init__
    {"ros"},
    {"offline.bags", "offline.frames", "offline.sensor_figures", "offline.stamps"},
    {"offline.simulation", "offline.evaluation", "offline.figures", "offline.parameter_docs"},
    {"offline.runs", "offline.inspection"},
    {"offline.report"},
    {"offline.cli"},
    {"offline.demo", "__main__"},
)
FLOOR = {room: number for number, floor in enumerate(FLOORS) for room in floor}

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
    "std_srvs",
    "tf2_ros",
    "vision_msgs",
    "visualization_msgs",
}
EXTERNAL_ROOMS = {
    **{name: {"ros"} for name in ROS},
    "numba": {"compiled", "steps.filtration"},
    "llvmlite": {"compiled", "steps.filtration"},
    "matplotlib": {"offline.figures"},
    "rosbags": {"offline.bags"},
    "mcap": {"offline.bags"},
    "lz4": {"offline.bags"},
    "zstandard": {"offline.bags"},
    "pypcd4": {"cloud"},
    "lzf": {"cloud"},
    "imgviz": {"offline.demo", "offline.simulation"},
    "PIL": {"cloud", "offline.report"},
    "jinja2": {"offline.report"},
    "markupsafe": {"offline.report"},
    "distributed": {"offline.evaluation"},
    "dask": {"offline.evaluation"},
}


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
    """Return the longest name of a room that the module lies in; packages that only hold rooms are in none."""
    inner = module.removeprefix(PACKAGE).removeprefix(".")
    while inner and inner not in FLOOR:
        inner = inner.rpartition(".")[0]
    return inner


def inside(module: str) -> set[str]:
    return {name for name in imports(module) if name.split(".")[0] == PACKAGE}


def test_every_module_is_in_a_room() -> None:
    holders = {PACKAGE, f"{PACKAGE}.steps", f"{PACKAGE}.beyond", f"{PACKAGE}.offline"}
    assert [module for module in MODULES if not room(module) and module not in holders] == []
    assert [room for room in FLOOR if f"{PACKAGE}.{room}".rstrip(".") not in MODULES] == []


def test_imports_point_down() -> None:
    wrong = [
        f"{module} imports {name}"
        for module in MODULES
        for name in inside(module)
        if room(name) != room(module) and FLOOR[room(name)] >= FLOOR[room(module)]
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
    """Besides ROS, its standard library and this package: numpy, scipy and numba; yaml comes with rclpy.

    Pillow is loaded for packed images only, and its absence is said.
    """
    todo, seen, others = [f"{PACKAGE}.ros.node"], set(), set()
    while todo:
        module = todo.pop()
        if module in seen:
            continue
        seen.add(module)
        names = set(imports(module))
        todo += [name for name in names if name in MODULES]
        others |= {name.split(".")[0] for name in names} - {PACKAGE} - ROS - sys.stdlib_module_names
    assert [module for module in seen if module.startswith(f"{PACKAGE}.offline")] == []
    assert others <= {"numpy", "scipy", "numba", "llvmlite", "yaml", "PIL"}


def test_package_import_is_light() -> None:
    slow = sorted({"PIL", "numba", "scipy", "rclpy", "rosbags", "mcap", "matplotlib", "rich"})
    code = f"import sys, {PACKAGE}; print([name for name in {slow} if name in sys.modules])"
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    )
    assert result.stdout.strip() == "[]"
