# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Enough of ROS's launch packages to run a launch file where they are not installed, and to look at the result."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

NAMES = {
    "ament_index_python": [],
    "ament_index_python.packages": [],
    "launch": ["LaunchContext", "LaunchDescription", "LaunchDescriptionEntity"],
    "launch.actions": ["DeclareLaunchArgument", "IncludeLaunchDescription", "LogInfo", "OpaqueFunction"],
    "launch.conditions": ["IfCondition", "UnlessCondition"],
    "launch.launch_description_sources": ["PythonLaunchDescriptionSource"],
    "launch.substitutions": ["EqualsSubstitution", "LaunchConfiguration", "PathJoinSubstitution"],
    "launch_ros": [],
    "launch_ros.actions": ["Node"],
    "launch_ros.substitutions": ["FindPackageShare"],
}


class PackageNotFoundError(KeyError):
    """That of ament_index_python."""


class Made:
    """What a launch file made: the name of the class and the arguments."""

    def __init__(self, kind: str, *args: Any, **keywords: Any) -> None:
        self.kind, self.args, self.keywords = kind, args, keywords

    def perform(self, context: Any) -> str:
        """As a LaunchConfiguration: return its value, "" where none is known."""
        return str(context.launch_configurations[self.args[0]]) if context else ""

    def walk(self) -> Iterator[Made]:
        """Yield this and everything inside it."""
        yield self
        if self.kind == "OpaqueFunction":
            for made in self.keywords["function"](None, *self.keywords.get("args", [])):
                yield from made.walk()
        todo: list[Any] = [*self.args, *self.keywords.values()]
        while todo:
            value = todo.pop(0)
            if isinstance(value, Made):
                yield from value.walk()
            elif isinstance(value, dict):
                todo += [*value.keys(), *value.values()]
            elif isinstance(value, (list, tuple, type({}.items()))):
                todo += list(value)


def run(file: Path, without: tuple[str, ...] = ()) -> Made:
    """Return the launch description of a file; packages named in `without` are not installed."""
    with _stubs(without):
        spec = importlib.util.spec_from_file_location(file.stem.replace(".", "_"), file)
        assert spec and spec.loader
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        made: Made = module.generate_launch_description()
    return made


def commands(file: Path, share: Path, arguments: dict[str, str], without: tuple[str, ...] = ()) -> list[list[str]]:
    """Return the command lines, as launch_ros makes them, that a launch file starts with some arguments.

    What it would say in the log stands among them, after "echo"; packages named in `without` are not installed.
    """
    return list(_commands(run(file, without).args[0], share, dict(arguments), without))


def _commands(parts: list[Made], share: Path, values: dict[str, str], without: tuple[str, ...]) -> Iterator[list[str]]:
    # As launch does: in order, arguments of an included file stay set after it.
    def text(value: Any) -> str:
        if isinstance(value, str):
            return value
        if value.kind == "LaunchConfiguration":
            return values[value.args[0]]
        if value.kind == "EqualsSubstitution":
            return str(text(value.args[0]) == text(value.args[1])).lower()
        if value.kind == "FindPackageShare":
            return str(share)
        assert value.kind == "PathJoinSubstitution", value.kind
        return "/".join(map(text, value.args[0]))

    def wanted(condition: Made | None) -> bool:
        return condition is None or (text(condition.args[0]) == "true") == (condition.kind == "IfCondition")

    for part in parts:
        given = part.keywords
        if not wanted(given.get("condition")):
            continue
        if part.kind == "DeclareLaunchArgument":
            values.setdefault(part.args[0], text(given["default_value"]))
        elif part.kind == "IncludeLaunchDescription":
            (source,) = part.args
            values.update({name: text(value) for name, value in given["launch_arguments"]})
            yield from _commands(run(Path(text(source.args[0])), without).args[0], share, values, without)
        elif part.kind == "OpaqueFunction":
            context = SimpleNamespace(launch_configurations=values)
            yield from _commands(given["function"](context, *given.get("args", [])), share, values, without)
        elif part.kind == "LogInfo":
            yield ["echo", given["msg"]]
        elif part.kind == "Node":
            ros = [*map(text, given.get("ros_arguments", []))]
            ros += ["-r", f"__node:={given['name']}"] if "name" in given else []
            namespace = text(given["namespace"])
            ros += ["-r", f"__ns:=/{namespace.lstrip('/')}"] if namespace else []
            for entry in given.get("parameters", []):
                if isinstance(entry, dict):
                    for name, value in entry.items():
                        ros += ["-p", f"{name}:={text(value)}"]
                else:
                    ros += ["--params-file", text(entry)]
            for name, topic in given.get("remappings", []):
                ros += ["-r", f"{name}:={text(topic)}"]
            yield [given["executable"], *map(text, given.get("arguments", [])), "--ros-args", *ros]
        else:
            raise AssertionError(part.kind)


@contextmanager
def _stubs(without: tuple[str, ...]) -> Iterator[None]:
    def get_package_prefix(name: str) -> str:
        if name in without:
            raise PackageNotFoundError(name)
        return "/opt/ros/jazzy"

    before = {name: sys.modules.get(name) for name in NAMES}
    for name, classes in NAMES.items():
        module = ModuleType(name)
        for kind in classes:
            setattr(module, kind, lambda *args, kind=kind, **keywords: Made(kind, *args, **keywords))
        sys.modules[name] = module
    vars(sys.modules["ament_index_python.packages"]).update(
        get_package_prefix=get_package_prefix, PackageNotFoundError=PackageNotFoundError
    )
    try:
        yield
    finally:
        for name, module in before.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module
