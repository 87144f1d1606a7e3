# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The launch files: run everywhere with stand-ins for ROS's launch, and with the real one where it is installed."""

from __future__ import annotations

import importlib.util
import itertools
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from launch_stub import Made, commands, run
from places import ROOT

from topo_region_seg.cloud.label_colors import palette
from topo_region_seg.cloud.messages.markers import region_markers
from topo_region_seg.cloud.messages.topics import OUTPUTS
from topo_region_seg.steps.color import srgb_to_lab

ONE, TWO = (ROOT / "launch" / f"{name}.launch.py" for name in ("region_segmentation", "two_cameras"))
RVIZ = ROOT / "rviz" / "region_segmentation.rviz"
SIDES = ("left", "right")
SIM_TIME = ("-p", "use_sim_time:=false")
MODULES = {"region_segmentation_node": "topo_region_seg.ros.node", "topo_region_seg": "topo_region_seg"}
TWICE = ("namespace", "camera_name", "input", "params_file", "bag", "frame")
ARGUMENTS = {
    ONE: {
        "namespace",
        "params_file",
        "camera",
        "camera_name",
        "input",
        "log_level",
        "use_sim_time",
        "bag",
        "rviz",
        "rviz_config",
        "fixed_frame",
    },
    TWO: {
        "camera",
        "log_level",
        "use_sim_time",
        "rviz",
        "rviz_config",
        *(f"{side}_{name}" for side in SIDES for name in TWICE),
    },
}


def of_kind(made: Made, kind: str) -> list[Made]:
    return [part for part in made.walk() if part.kind == kind]


@pytest.mark.parametrize("file", ARGUMENTS, ids=lambda file: file.name)
def test_arguments_are_declared_described_and_used(file: Path) -> None:
    made = run(file)
    declared = of_kind(made, "DeclareLaunchArgument")
    assert sorted(argument.args[0] for argument in declared) == sorted(ARGUMENTS[file])
    assert all({"default_value", "description"} <= set(argument.keywords) for argument in declared)
    assert {use.args[0] for use in of_kind(made, "LaunchConfiguration")} == ARGUMENTS[file]


@pytest.mark.parametrize("file", ARGUMENTS, ids=lambda file: file.name)
def test_installed_files_that_are_named_exist(file: Path) -> None:
    paths = of_kind(run(file), "PathJoinSubstitution")
    assert paths
    for path in paths:
        share, *parts = path.args[0]
        assert share.args == ("topo_region_seg",)
        assert ROOT.joinpath(*parts).is_file()
        setup = (ROOT / "setup.py").read_text(encoding="utf-8")
        assert f'(f"share/{{PACKAGE}}/{parts[0]}", files("{parts[0]}"))' in setup


def test_it_starts_the_executables_of_setup_py() -> None:
    nodes = of_kind(run(ONE), "Node")
    assert [(node.keywords["package"], node.keywords["executable"]) for node in nodes] == [
        ("topo_region_seg", "region_segmentation_node"),
        ("topo_region_seg", "topo_region_seg"),
        ("rviz2", "rviz2"),
    ]
    setup = (ROOT / "setup.py").read_text(encoding="utf-8")
    assert all(f"{node.keywords['executable']} = " in setup for node in nodes[:2])
    # All in the same namespace, or RViz and the player would miss the node's relative topics.
    assert {node.keywords["namespace"].args[0] for node in nodes} == {"namespace"}


def test_two_cameras_pass_every_argument_that_one_camera_has() -> None:
    includes = of_kind(run(TWO), "IncludeLaunchDescription")
    assert len(includes) == 2
    passed = [dict(include.keywords["launch_arguments"]) for include in includes]
    # What is not passed to the second file would be what the first one was given.
    assert all(set(arguments) == ARGUMENTS[ONE] for arguments in passed)
    shared = {"camera", "log_level", "use_sim_time", "rviz", "rviz_config"}
    assert all(arguments[name].args == (name,) for arguments in passed for name in shared)
    namespaces = [arguments["namespace"].args[0] for arguments in passed]
    assert namespaces == ["left_namespace", "right_namespace"]


def test_what_starts_depends_on_bag_and_rviz() -> None:
    def started(file: Path, **arguments: str) -> list[str]:
        return [Path(command[0]).name for command in commands(file, ROOT, arguments)]

    assert started(ONE) == ["region_segmentation_node"]
    assert started(ONE, bag="a.mcap", rviz="true") == ["region_segmentation_node", "topo_region_seg", "rviz2"]
    assert started(TWO) == ["region_segmentation_node"] * 2
    assert started(TWO, right_bag="a.mcap") == ["region_segmentation_node"] * 2 + ["topo_region_seg"]
    assert started(TWO, rviz="true") == ["region_segmentation_node", "rviz2"] * 2
    left, view, *_ = commands(TWO, ROOT, {"rviz": "true", "rviz_config": "my.rviz", "left_frame": "eye"})
    assert view == ["rviz2", "-d", "my.rviz", "-f", "eye", "--ros-args", "-r", "__ns:=/left", *SIM_TIME]
    assert left[-10:-6] == [*SIM_TIME, "-r", "points:=points"]


def remaps(line: list[str]) -> dict[str, str]:
    pairs = [part.split(":=") for flag, part in itertools.pairwise(line) if flag == "-r"]
    return {name: topic for name, topic in pairs if not name.startswith("__")}


INPUTS = ("points", "depth/image", "depth/camera_info", "color/image")


@pytest.mark.parametrize("camera", ["realsense", "orbbec", "zed", "azure_kinect", "depth_image_proc"])
@pytest.mark.parametrize("given", ["points", "depth", "/other/points"])
def test_a_camera_sets_the_topics_of_its_driver(camera: str, given: str) -> None:
    node, player = commands(ONE, ROOT, {"camera": camera, "input": given, "bag": "a.mcap"})
    assert ("input:=depth" in node) == (given == "depth")
    found = remaps(node)
    assert tuple(found) == INPUTS and remaps(player) == found, "the player publishes where the node listens"
    assert all(topic.startswith("/") and topic not in INPUTS for topic in found.values())
    assert len(set(found.values())) == len(INPUTS)
    assert (found["points"] == "/other/points") == (given == "/other/points")
    # The table of the documentation has the same names.
    page = (ROOT / "docs" / "robot.md").read_text(encoding="utf-8")
    row = next(line for line in page.splitlines() if line.startswith(f"| `{camera}` |"))
    assert all(f"`{topic}`" in row for name, topic in found.items() if given != "/other/points" or name != "points")


def test_without_a_camera_names_stay_relative_and_an_unknown_one_is_refused() -> None:
    (node,) = commands(ONE, ROOT, {})
    assert remaps(node) == {name: name for name in INPUTS} and "input:=depth" not in node
    (node,) = commands(ONE, ROOT, {"input": "depth"})
    assert remaps(node) == {name: name for name in INPUTS} and "input:=depth" in node
    with pytest.raises(RuntimeError, match="camera:=kinect: must be one of realsense, orbbec, zed, azure_kinect"):
        commands(ONE, ROOT, {"camera": "kinect"})


def test_the_layout_for_foxglove_shows_topics_of_the_node() -> None:
    layout = json.loads((ROOT / "foxglove" / "region_segmentation.json").read_text(encoding="utf-8"))
    text = json.dumps(layout["configById"])
    shown = set(re.findall(r'"/([a-z_]+)', text)) - {"diagnostics"}
    assert shown <= {output.name for output in OUTPUTS} and {"region_colors", "label_image", "surfaces"} <= shown

    def panels(part: Any) -> set[str]:
        return {part} if isinstance(part, str) else panels(part["first"]) | panels(part["second"])

    assert panels(layout["layout"]) == set(layout["configById"])


NAMED = {
    "realsense": ("/left/camera/depth/color/points", "/left/camera/color/image_raw"),
    "orbbec": ("/left/depth_registered/points", "/left/color/image_raw"),
    "zed": ("/left/zed_node/point_cloud/cloud_registered", "/left/zed_node/rgb/color/rect/image"),
    "azure_kinect": ("/left/points2", "/left/rgb/image_raw"),
    "depth_image_proc": ("/left/depth_registered/points", "/left/rgb/image_rect_color"),
}


@pytest.mark.parametrize("camera", NAMED)
def test_two_cameras_of_one_driver_have_names_of_their_own(camera: str) -> None:
    (single,) = commands(ONE, ROOT, {"camera": camera, "camera_name": "left"})
    left, right = commands(TWO, ROOT, {"camera": camera, "left_input": "depth", "right_camera_name": "rear"})
    assert (remaps(single)["points"], remaps(single)["color/image"]) == NAMED[camera]
    assert remaps(left) == remaps(single)
    assert remaps(right) == {name: topic.replace("/left/", "/rear/", 1) for name, topic in remaps(left).items()}
    assert "input:=depth" in left and "input:=depth" not in right


@pytest.mark.parametrize("file", ARGUMENTS, ids=lambda file: file.name)
def test_a_view_that_is_not_installed_is_said_and_the_rest_starts(file: Path) -> None:
    lines = commands(file, ROOT, {"rviz": "true"}, without=("rviz2",))
    said = [line[1] for line in lines if line[0] == "echo"]
    assert len(said) == (1 if file == ONE else 2)
    assert all("rviz2 is not installed" in text and "ros-jazzy-rviz2" in text for text in said)
    assert {line[0] for line in lines} == {"echo", "region_segmentation_node"}
    assert "rviz2" in [line[0] for line in commands(file, ROOT, {"rviz": "true"})]


@pytest.mark.timeout(300)
def test_two_cameras_from_recordings_each_give_their_labels(ros_domain: int, tmp_path: Path) -> None:
    """The command lines that launch would make of the file, run over DDS."""
    pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")
    from ros_harness import STARTUP, Client, label_column, until
    from sensor_msgs.msg import PointCloud2

    bag = str(ROOT / "bags" / "tabletop_sim")
    view = tmp_path / "parameters.yaml"
    view.write_text("/**:\n  ros__parameters: {max_radius: 0.01, min_region_size: 100000}\n")
    arguments = {"left_bag": bag, "right_bag": bag, "right_params_file": str(view), "log_level": "warn"}
    client = Client(ros_domain + 50)
    environment = {**os.environ, "ROS_DOMAIN_ID": str(ros_domain + 50), "PYTHONPATH": str(ROOT)}
    processes: list[subprocess.Popen[bytes]] = []
    try:
        inboxes = {side: client.collect(PointCloud2, f"/{side}/labeled_points") for side in SIDES}
        answers = [f"/{side}/labeled_points" for side in SIDES]
        lines = sorted(commands(TWO, ROOT, arguments), key=lambda line: Path(line[0]).name)
        for number, (executable, *rest) in enumerate(lines):
            if number == len(SIDES):
                # The recordings last a second, which discovery may take longer than.
                until(lambda: all(map(client.node.count_publishers, answers)), "publishers of labels", STARTUP)
            with (tmp_path / f"{number}.txt").open("w") as log:
                command = [sys.executable, "-m", MODULES[executable], *rest]
                processes.append(subprocess.Popen(command, env=environment, stdout=log, stderr=log, cwd=tmp_path))
        until(lambda: all(inboxes.values()), "labels of both cameras", STARTUP)
        # Each node has the parameters of its own file.
        assert label_column(inboxes["left"][0]).max() > 1
        assert label_column(inboxes["right"][0]).max() <= 1
        assert not client.labeled, "nothing outside of the namespaces"
    finally:
        for process in processes:
            process.send_signal(signal.SIGINT)
        status = [process.wait(STARTUP) for process in processes]
        client.close()
        print(*(file.read_text() for file in sorted(tmp_path.glob("*.txt"))))
    assert status == [0, 0, 0, 0]


def test_rviz_shows_topics_and_markers_that_the_node_publishes() -> None:
    displays = yaml.safe_load(RVIZ.read_text(encoding="utf-8"))["Visualization Manager"]["Displays"]
    topics = {display["Name"]: display["Topic"]["Value"] for display in displays}
    assert topics == {
        "Labels": "region_colors",
        "Camera colors": "labeled_points",
        "Regions": "region_markers",
        "Foreground": "foreground_points",
        "Label image": "label_image",
        "Detections": "detections",
        "Surfaces": "surfaces",
    }
    labels, camera, regions = displays[:3]
    # An Intensity transformer would give label 0 the bright end of its rainbow.
    assert labels["Color Transformer"] == camera["Color Transformer"] == "RGB8"
    assert [display["Enabled"] for display in displays] == [True, False, True, False, False, False, False]
    assert set(topics.values()) <= {output.name for output in OUTPUTS}
    source = Path(region_markers.__code__.co_filename).read_text(encoding="utf-8")
    drawn = set(re.findall(r'types, header, "(\w+)", ', source))
    assert set(regions["Namespaces"]) == drawn
    assert all(regions["Namespaces"].values())


def test_unlabeled_points_are_dark_and_yet_visible_in_rviz() -> None:
    view = yaml.safe_load(RVIZ.read_text(encoding="utf-8"))["Visualization Manager"]["Global Options"]
    background = np.array([[int(part) for part in view["Background Color"].split(";")]], np.uint8)
    lightness = srgb_to_lab(np.concatenate([background, palette()]))[:, 0]
    assert lightness[0] + 8 < lightness[1] < 25
    assert lightness[2:].min() > lightness[1] + 20


@pytest.mark.parametrize("file", ARGUMENTS, ids=lambda file: file.name)
def test_the_real_launch_makes_the_description_and_starts_nothing_twice(file: Path) -> None:
    pytest.importorskip("launch_ros", reason="launch_ros is not on PyPI; it comes with a ROS 2 installation")
    from launch import LaunchContext
    from launch.actions import DeclareLaunchArgument
    from launch_ros.actions import Node

    spec = importlib.util.spec_from_file_location("launch_file", file)
    assert spec and spec.loader
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    entities = module.generate_launch_description().entities
    context = LaunchContext()
    arguments = [entity for entity in entities if isinstance(entity, DeclareLaunchArgument)]
    assert {argument.name for argument in arguments} == ARGUMENTS[file]
    for bag, rviz, count in (("", "false", 1), ("recording.mcap", "false", 2), ("", "true", 1)):
        context.launch_configurations.update({"bag": bag, "rviz": rviz})
        started = [
            entity
            for entity in entities
            if isinstance(entity, Node) and (entity.condition is None or entity.condition.evaluate(context))
        ]
        assert len(started) == (count if file == ONE else 0)
