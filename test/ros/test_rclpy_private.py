# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What is used of rclpy though it is private: named here, there in this version, and used through one file alone."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from pathlib import Path

import pytest
from places import ROOT

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

import rclpy
from rclpy.context import Context
from rclpy.lifecycle import LifecycleNode
from rclpy.parameter import Parameter

from topo_region_seg.ros import rclpy_private

MEMBERS = {"_parameter_overrides", "_parameters", "_state_machine", "_service_change_state"}
ROS = ROOT / "topo_region_seg" / "ros"


@pytest.fixture
def node(ros_domain: int) -> Iterator[LifecycleNode]:
    context = Context()
    rclpy.init(context=context, domain_id=ros_domain)
    made = LifecycleNode("n", context=context, parameter_overrides=[Parameter("a", value=1), Parameter("b", value=2)])
    yield made
    made.destroy_node()
    rclpy.try_shutdown(context=context)


def private_members(source: str) -> set[str]:
    """Return the names with an underscore that are taken of anything but self and super()."""
    found = set()
    for part in ast.walk(ast.parse(source)):
        if isinstance(part, ast.Attribute) and part.attr.startswith("_") and not part.attr.startswith("__"):
            own = isinstance(part.value, ast.Name) and part.value.id in ("self", "cls", "os")
            found |= set() if own else {part.attr}
    return found


def test_these_are_all_that_one_file_uses() -> None:
    assert private_members(inspect.getsource(rclpy_private)) == MEMBERS


@pytest.mark.parametrize("file", sorted(ROS.glob("*.py")), ids=lambda file: file.stem)
def test_no_other_file_uses_any(file: Path) -> None:
    source = file.read_text(encoding="utf-8")
    if file.stem != "rclpy_private":
        assert private_members(source) == set()
        assert not [member for member in MEMBERS if f"self.{member}" in source]


def test_this_version_has_them(node: LifecycleNode) -> None:
    assert {name: given.value for name, given in rclpy_private.given_parameters(node).items()} == {"a": 1, "b": 2}
    node.declare_parameter("a", 5)
    assert rclpy_private.declared_parameters(node)["a"].value == 1
    assert "b" not in rclpy_private.declared_parameters(node)
    rclpy_private.given_parameters(node)["b"] = Parameter("b", value=3)
    assert node.declare_parameter("b", 5).value == 3
    assert rclpy_private.lifecycle_state(node) == "unconfigured"
    assert rclpy_private.change_state_service(node).srv_name == "/n/change_state"
    assert callable(rclpy_private.change_state_service(node).callback)
    assert node.trigger_configure() is not None
    assert rclpy_private.lifecycle_state(node) == "inactive"
