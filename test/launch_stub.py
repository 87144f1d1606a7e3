# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Enough of ROS's launch packages to run a launch file where they are not installed, and to look at the result."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

NAMES = {
    "launch": ["LaunchDescription"],
    "launch.actions": ["DeclareLaunchArgument", "IncludeLaunchDescription"],
    "launch.conditions": ["IfCondition", "UnlessCondition"],
    "launch.launch_description_sources": ["PythonLaunchDescriptionSource"],
    "launch.substitutions": ["EqualsSubstitution", "LaunchConfiguration", "PathJoinSubstitution"],
    "launch_ros": [],
    "launch_ros.actions": ["Node"],
    "launch_ros.substitutions": ["FindPackageShare"],
}


class Made:
    """What a launch file made: the name of the class and the arguments."""

    def __init__(self, kind: str, *args: Any, **keywords: Any) -> None:
        self.kind, self.args, self.keywords = kind, args, keywords

    def walk(self) -> Iterator[Made]:
        """Yield this and everything inside it."""
        yield self
        todo: list[Any] = [*self.args, *self.keywords.values()]
        while todo:
            value = todo.pop(0)
            if isinstance(value, Made):
                yield from value.walk()
            elif isinstance(value, dict):
                todo += [*value.keys(), *value.values()]
            elif isinstance(value, (list, tuple, type({}.items()))):
                todo += list(value)


def run(file: Path) -> Made:
    """Return the launch description of a file."""
    with _stubs():
        spec = importlib.util.spec_from_file_location(file.stem.replace(".", "_"), file)
        assert spec and spec.loader
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        made: Made = module.generate_launch_description()
    return made


@contextmanager
def _stubs() -> Iterator[None]:
    before = {name: sys.modules.get(name) for name in NAMES}
    for name, classes in NAMES.items():
        module = ModuleType(name)
        for kind in classes:
            setattr(module, kind, lambda *args, kind=kind, **keywords: Made(kind, *args, **keywords))
        sys.modules[name] = module
    try:
        yield
    finally:
        for name, module in before.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module
