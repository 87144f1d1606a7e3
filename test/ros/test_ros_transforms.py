# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames from TF, with a stand-in for tf2_ros, which is not on PyPI: the node in a process of its own, over DDS."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from places import ROOT, TEST

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from geometry_msgs.msg import TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_harness import Client, NodeProcess, cloud_message, label_column, running_node, until
from scipy.spatial.transform import Rotation

from topo_region_seg.cloud.placing import Transform, moved
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

STANDIN = TEST / "standin"
CAMERA = Camera.kinect(160, 120)
FRAME = "camera_depth_optical_frame"
TURN = Rotation.from_matrix(CAMERA.rotation)


def pose(rotation: Rotation, position: Any) -> tuple[float, ...]:
    x, y, z, w = rotation.as_quat()
    return (*map(float, position), w, x, y, z)


class Tree(Client):
    """A client that publishes transforms, latched, and clouds."""

    def __init__(self, domain: int) -> None:
        super().__init__(domain)
        quality = QoSProfile(depth=20, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._transforms = self.node.create_publisher(TransformStamped, "/tf_standin", quality)

    def tell(self, parent: str, child: str, rotation: Rotation, position: Any) -> None:
        msg = TransformStamped(child_frame_id=child)
        msg.header.frame_id = parent
        q, t = msg.transform.rotation, msg.transform.translation
        q.x, q.y, q.z, q.w = rotation.as_quat().tolist()
        t.x, t.y, t.z = map(float, position)
        self._transforms.publish(msg)

    def forget(self) -> None:
        self.tell("", "clear", Rotation.identity(), (0, 0, 0))


@pytest.fixture(scope="module")
def view() -> Any:
    return simulate(tabletop(seed=3), CAMERA, seed=3).cloud


@pytest.fixture
def client(ros_domain: int) -> Iterator[Tree]:
    tree = Tree(ros_domain + 50)
    yield tree
    tree.close()


def started(domain: int, folder: Path, *arguments: str) -> Any:
    path = {"PYTHONPATH": os.pathsep.join([str(STANDIN), str(ROOT)])}
    return running_node(domain + 50, folder / "log.txt", *arguments, environment=path)


def expected(cloud: Any, params: Params) -> Any:
    return Pipeline(params).run(cloud, lambda *_: None).labels


def given(view: Any) -> Any:
    return cloud_message(view.xyz, view.rgb, height=view.height)


def test_output_is_in_the_frame_that_was_asked_for(client: Tree, ros_domain: int, tmp_path: Path, view: Any) -> None:
    """The camera on an arm on the base in the world: chains are followed, and up is that of the base."""
    mast = Rotation.from_euler("z", 30, degrees=True)
    client.tell("map", "base_link", mast, (5.0, 1.0, 0.0))
    client.tell("base_link", FRAME, mast.inv() * TURN, mast.inv().apply(np.array(CAMERA.eye) - (5.0, 1.0, 0.0)))
    arguments = ("-p", "output_frame:=map", "-p", "base_frame:=base_link")
    with started(ros_domain, tmp_path, *arguments):
        client.wait_for_node()
        answer = client.ask(given(view))
    assert answer.header.frame_id == "map"
    to_map = Transform.of_pose(pose(TURN, CAMERA.eye))
    placed = moved(view, to_map)
    np.testing.assert_allclose(decode(answer, max_points=10**6).xyz, placed.xyz, atol=1e-5)
    labels = label_column(answer)
    theirs = expected(placed, Params(up=(0.0, 0.0, 1.0)))
    assert theirs.any() and np.mean((labels > 0) == (theirs > 0)) > 0.99


def test_up_and_crop_box_come_from_the_base_frame(client: Tree, ros_domain: int, tmp_path: Path, view: Any) -> None:
    client.tell("base_link", FRAME, TURN, CAMERA.eye)
    box = (-0.15, -0.2, 0.6, 0.3, 0.2, 1.2)
    arguments = ("-p", "base_frame:=base_link", "-p", f"crop_box:={list(box)}")
    with started(ros_domain, tmp_path, *arguments):
        client.wait_for_node()
        answer = client.ask(given(view))
    assert answer.header.frame_id == FRAME, "clouds stay in their frame"
    inverse = Transform(TURN.inv().as_matrix(), -TURN.inv().apply(CAMERA.eye))
    cloud = type(view)(view.xyz, view.rgb, view.height, view.width, base_pose=inverse.pose)
    theirs = expected(cloud, Params(crop_box=box))
    assert theirs.any()
    np.testing.assert_array_equal(label_column(answer), theirs)
    inside = (TURN.apply(view.xyz) + CAMERA.eye)[label_column(answer) > 0]
    assert (inside >= np.array(box[:3]) - 1e-6).all() and (inside <= np.array(box[3:]) + 1e-6).all()


def test_a_transform_that_is_missing_is_named_and_counted_until_it_comes(
    client: Tree, ros_domain: int, tmp_path: Path, view: Any
) -> None:
    arguments = ("-p", "sensor_frame:=camera", "-p", "transform_timeout:=0.05", "-p", "warning_period:=0.0")
    with started(ros_domain, tmp_path, *arguments) as node:
        client.wait_for_node()

        def rejected() -> int:
            client.publish(given(view))
            return int(client.figures().get("rejected: no_transform", "0"))

        until(rejected, "a frame without a transform to be counted")
        node.wait_for_log(f"[no_transform] cloud rejected: no transform from 'camera' to '{FRAME}' (sensor_frame)")
        assert "are not connected in the tree" in node.log, "what tf2 says, in one line"
        client.tell(FRAME, "camera", Rotation.identity(), (0.0, 0.0, -0.1))
        answer = client.ask(given(view))
        theirs = expected(type(view)(*_parts(view), sensor_pose=(0.0, 0.0, -0.1, 1.0, 0.0, 0.0, 0.0)), Params())
        np.testing.assert_array_equal(label_column(answer), theirs)
        # It may go and come back.
        client.forget()
        before = rejected()
        until(lambda: rejected() > before, "rejections again")
        client.tell(FRAME, "camera", Rotation.identity(), (0.0, 0.0, -0.1))
        np.testing.assert_array_equal(label_column(client.ask(given(view))), theirs)


def _parts(view: Any) -> tuple[Any, ...]:
    return view.xyz, view.rgb, view.height, view.width


def test_without_tf2_ros_one_line_says_what_to_install(ros_domain: int, tmp_path: Path) -> None:
    node = NodeProcess(ros_domain + 50, tmp_path / "log.txt", "-p", "base_frame:=base_link")
    try:
        node.wait_for_log("not started, and ends: activate failed: base_frame = 'base_link' needs tf2_ros")
        assert "install ros-jazzy-tf2-ros-py; or leave it out, and set sensor_pose, up" in node.log
    finally:
        status = node.stop()
    assert status == 1 and "Traceback" not in node.log
