# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Message packages that PyPI does not carry, built with colcon from their definitions: a minute, once.

The result is kept in the virtual environment, under a name that changes with the definitions.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest
from places import ROOT

from topo_region_seg.offline.bags.types import VISION_MSGS

COLCON = Path(sysconfig.get_path("scripts")) / "colcon"
BUILD_SECONDS = 300
PACKAGE_XML = """<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>Definitions for tests.</description>
  <maintainer email="topo-region-seg@example.org">topo_region_seg contributors</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  {depends}
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""
# The packages of the wheels name the headers of the Python that they were built with, wherever that was.
CMAKE = """cmake_minimum_required(VERSION 3.16)
project({name})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
foreach(package builtin_interfaces service_msgs {depends})
  find_package(${{package}} REQUIRED)
  set_target_properties(${{package}}::${{package}}__rosidl_generator_py PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "")
endforeach()
rosidl_generate_interfaces(${{PROJECT_NAME}} {files} DEPENDENCIES {depends})
ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""


@dataclass(frozen=True)
class Interfaces:
    """The messages of a package: the text of each definition, and the packages that they refer to."""

    messages: Mapping[str, str]
    depends: tuple[str, ...]


ROBOT = {
    "vision_msgs": Interfaces(VISION_MSGS, ("std_msgs", "geometry_msgs")),
    "object_recognition_msgs": Interfaces({"ObjectType": "string key\nstring db\n"}, ("std_msgs",)),
    "moveit_msgs": Interfaces(
        {
            "CollisionObject": """\
std_msgs/Header header
geometry_msgs/Pose pose
string id
object_recognition_msgs/ObjectType type
shape_msgs/SolidPrimitive[] primitives
geometry_msgs/Pose[] primitive_poses
shape_msgs/Mesh[] meshes
geometry_msgs/Pose[] mesh_poses
shape_msgs/Plane[] planes
geometry_msgs/Pose[] plane_poses
string[] subframe_names
geometry_msgs/Pose[] subframe_poses
byte ADD=0
byte REMOVE=1
byte APPEND=2
byte MOVE=3
byte operation
"""
        },
        ("std_msgs", "geometry_msgs", "shape_msgs", "object_recognition_msgs"),
    ),
}
"""What robots have from apt: each message as its package defines it, but not all messages of the package."""


def robot_interfaces() -> dict[str, str]:
    """Return the environment in which a process finds :data:`ROBOT` and this package; skip if it cannot be built."""
    key = hashlib.sha256((PACKAGE_XML + CMAKE + repr(ROBOT)).encode()).hexdigest()[:16]
    prefix = Path(sys.prefix) / "test_interfaces" / key
    if not prefix.exists():
        _skip_without_tools()
        prefix.parent.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=prefix.parent) as folder:
            _build(Path(folder))
            shutil.move(Path(folder) / "install", prefix)
    python = Path(sysconfig.get_path("purelib")).relative_to(sys.prefix)
    return {
        "PYTHONPATH": os.pathsep.join([str(ROOT), str(prefix / python)]),
        "LD_LIBRARY_PATH": os.pathsep.join(filter(None, [str(prefix / "lib"), os.environ.get("LD_LIBRARY_PATH")])),
        "AMENT_PREFIX_PATH": os.pathsep.join([str(prefix), os.environ.get("AMENT_PREFIX_PATH") or sys.prefix]),
    }


def _skip_without_tools() -> None:
    missing = [tool for tool in ("cmake", "g++") if shutil.which(tool) is None]
    if not (Path(sysconfig.get_path("include")) / "Python.h").exists():
        missing.append("Python.h")
    if not COLCON.exists() or not (Path(sys.prefix) / "share" / "rosidl_default_generators").exists():
        missing.append("the packages of pip install '.[interfaces]'")
    if missing:
        pytest.skip(f"messages cannot be built: {', '.join(missing)} missing")


def _build(folder: Path) -> None:
    for name, interfaces in ROBOT.items():
        source = folder / "src" / name
        (source / "msg").mkdir(parents=True)
        for message, text in interfaces.messages.items():
            (source / "msg" / f"{message}.msg").write_text(text)
        files = " ".join(f'"msg/{message}.msg"' for message in interfaces.messages)
        depends = "".join(f"<depend>{package}</depend>" for package in interfaces.depends)
        (source / "package.xml").write_text(PACKAGE_XML.format(name=name, depends=depends))
        cmake = CMAKE.format(name=name, files=files, depends=" ".join(interfaces.depends))
        (source / "CMakeLists.txt").write_text(cmake)
    command = [COLCON, "--log-base", "log", "build", "--merge-install", "--event-handlers", "console_direct+"]
    command += ["--cmake-args", "-DBUILD_TESTING=OFF", f"-DPython3_EXECUTABLE={sys.executable}"]
    environment = {**os.environ, "AMENT_PREFIX_PATH": sys.prefix, "CMAKE_PREFIX_PATH": sys.prefix}
    environment["PATH"] = os.pathsep.join([str(COLCON.parent), environment["PATH"]])
    environment.pop("PYTHONPATH", None)
    result = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=BUILD_SECONDS)
    assert result.returncode == 0, result.stdout[-4000:] + result.stderr[-4000:]
