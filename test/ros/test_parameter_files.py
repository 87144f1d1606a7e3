# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Node and tools read the same parameter file alike; the judge of what it says is rcl itself."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from topo_region_seg.offline.cli.parameters import read_parameter_file
from topo_region_seg.offline.cli.status import ToolError
from topo_region_seg.parameter_table import ParameterError
from topo_region_seg.params import Params
from topo_region_seg.ros.parameter_files import ParameterFileError, applies_to, files_without_effect, read_file, scalar

rclpy = pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from rclpy.impl.implementation_singleton import rclpy_implementation as rcl

CHOSEN = """
0 1 -1 +1 007 010 08 0x10 -0x1F 0X1f 0x 1_000 1. .5 -.5 1.5 1e3 1e-3 2e-2 2E+2 1e 1e400 -1e400 .e1 . 1.5f 1:30
99999999999999999999 9223372036854775807 9223372036854775808 -9223372036854775808 2020-01-01 1,5 0b1 0o17 true True TRUE
false yes Yes YES no NO on ON On off y Y n N tRUE oui null ~ inf -inf .inf -.inf .Inf +.inf nan .nan .NaN infinity auto
color+normals normals x
"""


def texts() -> list[str]:
    """Return scalars without quotes: chosen ones, and many of the letters of which numbers are made."""
    dice = random.Random(7)
    made = ["".join(dice.choices("0123456789.+-eExX_afin", k=dice.randint(1, 6))) for _ in range(1500)]
    return [
        text for text in dict.fromkeys([*CHOSEN.split(), *made]) if yaml.compose(text).value == text and text != "-"
    ]


@contextmanager
def ros_node(ros_domain: int, path: Path, name: str = "any", namespace: str = "") -> Iterator[Any]:
    """Yield a plain node that was started with the file."""
    context = rclpy.context.Context()
    arguments = ["node", "--ros-args", "--params-file", str(path)]
    rclpy.init(args=arguments, context=context, domain_id=ros_domain + 50)
    node = rclpy.create_node(name, namespace=namespace, context=context)
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)


def test_scalars_are_what_rcl_takes_them_for(ros_domain: int, tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    given = [text for text in texts() if not is_hexadecimal_float(text)]
    lines = "\n".join(f"    v{i}: {text}" for i, text in enumerate(given))
    path.write_text(f"/**:\n  ros__parameters:\n{lines}\n")
    ours = read_file(path).sections["/**"]
    with ros_node(ros_domain, path) as node:
        theirs = {name: parameter.value for name, parameter in node._parameter_overrides.items()}
    assert len(ours) == len(theirs) == len(given) > 1000
    wrong = [
        (text, ours[f"v{i}"], theirs[f"v{i}"])
        for i, text in enumerate(given)
        if type(ours[f"v{i}"]) is not type(theirs[f"v{i}"]) or repr(ours[f"v{i}"]) != repr(theirs[f"v{i}"])
    ]
    assert wrong == []


def is_hexadecimal_float(text: str) -> bool:
    """Whether C reads a text such as 0x.8p3, which nobody writes, as a number."""
    return text.lower().lstrip("+-").startswith("0x") and ("." in text or "p" in text)


def test_quotes_make_text() -> None:
    assert [scalar(text) for text in ("1e-3", "1_000", "yes")] == [0.001, "1_000", True]


KEYS = ["/**", "/*", "region", "/region", "/*/region", "/**/region", "robot/region", "/robot/*", "/robot/**", "/other"]


@pytest.mark.parametrize("namespace", ["", "robot", "robot/arm"])
def test_sections_are_for_the_nodes_that_rcl_takes_them_for(namespace: str, ros_domain: int, tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    sections = {key: {"ros__parameters": {f"p{i}": 1}} for i, key in enumerate(KEYS)}
    nested = {"robot": {"arm": {"region": {"ros__parameters": {"q": {"r": 2}}}}}}
    path.write_text(yaml.safe_dump({**sections, **nested}))
    with ros_node(ros_domain, path, "region", namespace) as node:
        theirs = set(node._parameter_overrides)
        name = node.get_fully_qualified_name()
    ours = {
        parameter for key, values in read_file(path).sections.items() if applies_to(key, name) for parameter in values
    }
    assert ours == theirs


def ros(lines: str, key: str = "/**") -> str:
    return f"{key}:\n  ros__parameters:\n    " + "\n    ".join(lines.splitlines()) + "\n"


FILES = {
    "exponents": ros("max_radius: 2e-2\nvoxel_size: 1e-3"),
    "whole numbers": ros("max_range: 3\nmin_region_size: 50.0\nfiltration_steps: 0x10\nmin_range: +1"),
    "lists of whole numbers": ros("crop_box: [-1, -1, 0, 1, 1, 2]"),
    "an empty list": ros("crop_box: []"),
    "words for yes and no": ros("remove_floor: off\ndrop_zeros: Y"),
    "a word for a number": ros("max_radius: auto"),
    "what every node has": ros("use_sim_time: false\nstart_type_description_service: true\nmax_radius: 0.03"),
    "overrides": ros(
        "qos_overrides:\n  /points:\n    subscription:\n      depth: 3\nqos_overrides./a.publisher.depth: 1"
    ),
    "the node's own": ros("autostart: false\nwarning_period: 2\nmax_radius: 0.03"),
    "its own name": ros("max_radius: 0.03", "/region_segmentation"),
    "its name without slash": ros("max_radius: 0.03", "region_segmentation"),
    "several sections": ros("max_radius: 0.03")
    + ros("voxel_size: 0.001", "/region_segmentation")
    + ros("fps: 30", "/cam"),
    "a name that nobody knows": ros("max_radus: 0.03\nmax_range: 3.0"),
    "a former name": ros("mode: supervoxels"),
    "text in quotes": ros('max_radius: "0.02"'),
    "a number that YAML alone reads": ros("max_points: 1_000"),
    "an unknown word": ros("features: colour"),
    "a number for yes": ros("remove_floor: 1"),
    "out of range": ros("max_radius: -1"),
    "a contradiction": ros("min_range: 5\nmax_range: 2"),
    "half a point": ros("min_region_size: 50.5"),
    "a mixed list": ros("crop_box: [-1, -1, 0.5, 1, 1, 2]"),
    "a list of the wrong length": ros("crop_box: [1.0, 2.0]"),
    "a wrong value of the node's own": ros("input_reliability: sometimes"),
    "no value": ros("max_radius:"),
    "an alias": ros("max_radius: &r 0.02\nobject_radius: *r"),
}
REFUSED = list(FILES)[list(FILES).index("text in quotes") :]


def by_the_node(ros_domain: int, path: Path) -> Params | None:
    """Return the parameters that the node has after a start with the file; None if it refuses it."""
    from topo_region_seg.ros.region_segmentation import RegionSegmentation

    try:
        rclpy.init(args=["node", "--ros-args", "--params-file", str(path)], domain_id=ros_domain + 50)
        node = RegionSegmentation()
    except (rcl.RCLError, ParameterError):
        return None
    else:
        params: Params = node._params
        node.destroy_node()
        return params
    finally:
        rclpy.try_shutdown()


def by_the_tools(path: Path) -> Params | None:
    try:
        return Params.from_mapping(read_parameter_file(path))
    except (ToolError, ParameterError) as error:
        assert str(path) in str(error) or not isinstance(error, ToolError)
        assert "\n" not in str(error)
        return None


@pytest.mark.parametrize("kind", FILES)
def test_node_and_tools_come_to_the_same(
    kind: str, ros_domain: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(FILES[kind])
    node = by_the_node(ros_domain, path)
    said = warnings(capfd)
    tools = by_the_tools(path)
    assert node == tools
    assert (node is None) == (kind in REFUSED)
    assert warnings(capfd) == said
    assert bool(said) == (kind in ("a name that nobody knows", "a former name"))


def warnings(capfd: pytest.CaptureFixture[str]) -> set[str]:
    """Return what was said of unknown names."""
    lines = capfd.readouterr().err.splitlines()
    return {line.partition("unknown parameter")[2] for line in lines} - {""}


def test_what_the_node_has_is_taken_by_both(ros_domain: int, tmp_path: Path) -> None:
    """As `ros2 param dump` writes it: everything that the node has declared."""
    from topo_region_seg.ros.region_segmentation import RegionSegmentation

    first, path = tmp_path / "first.yaml", tmp_path / "dumped.yaml"
    first.write_text(ros("max_range: 3\ncrop_box: [-1, -1, 0, 1, 1, 2]\noutput: supervoxels\nvoxel_size: 1e-3"))
    rclpy.init(args=["node", "--ros-args", "--params-file", str(first)], domain_id=ros_domain + 50)
    try:
        node = RegionSegmentation()
        dumped: dict[str, Any] = {}
        for name, parameter in node._parameters.items():
            *outer, inner = name.split(".")
            place = dumped
            for part in outer:
                place = place.setdefault(part, {})
            place[inner] = np.asarray(parameter.value).tolist() if parameter.value is not None else []
        node.destroy_node()
    finally:
        rclpy.try_shutdown()
    assert {"use_sim_time", "qos_overrides"} <= set(dumped)
    path.write_text(yaml.safe_dump({"/region_segmentation": {"ros__parameters": dumped}}))
    wanted = Params(max_range=3.0, crop_box=(-1, -1, 0, 1, 1, 2), output="supervoxels", voxel_size=0.001)
    assert by_the_tools(path) == by_the_node(ros_domain, path) == wanted


def test_a_file_for_another_node_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, none = tmp_path / "p.yaml", tmp_path / "none.yaml"
    path.write_text(ros("max_radius: 0.03", "/segmentation"))
    arguments = ["node", "--ros-args", "--params-file", str(path), "--params-file", str(none), "-p", "a:=1"]
    (line,) = files_without_effect(arguments, "/region_segmentation")
    assert str(path) in line and "/segmentation, none for /region_segmentation" in line and "'/**'" in line
    assert files_without_effect(arguments, "/segmentation") == []
    assert by_the_tools(path) == Params(max_radius=0.03), "the name may be that of a launch file"
    assert f"{path}: the parameters are those of /segmentation" in capsys.readouterr().err
    path.write_text(
        ros("max_radius: 0.03", "/left/region_segmentation") + ros("max_radius: 0.02", "/right/region_segmentation")
    )
    with pytest.raises(ToolError, match="of 2 nodes"):
        read_parameter_file(path)


def test_files_that_are_none(tmp_path: Path) -> None:
    for content, why in (
        (b"\xff\xfe", "not text"),
        (b"a: [", "not YAML"),
        (b"- 1", "no names"),
        (b"a: {ros__parameters: 3}", "no names"),
    ):
        path = tmp_path / "p.yaml"
        path.write_bytes(content)
        with pytest.raises(ParameterFileError, match=why) as caught:
            read_file(path)
        assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    path.write_text("")
    assert read_file(path).sections == {} == read_file(path).plain
