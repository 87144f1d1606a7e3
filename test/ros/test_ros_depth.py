# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth images in place of clouds, over DDS: the same labels, pairs by stamp, and a word on what is missing."""

from __future__ import annotations

import os
import subprocess
import sys
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import images
import numpy as np
import pytest
from clouds import message
from places import ROOT

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from ros_harness import STARTUP, Client, NodeProcess, label_column, running_node, until
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2

from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.recording import write_recording
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PERIOD = 33_000_000
HEIGHT, WIDTH = 120, 160


class View:
    """Depth (mm), colors and camera of a simulated tabletop."""

    def __init__(self, seed: int, width: int = WIDTH, height: int = HEIGHT) -> None:
        camera = Camera.kinect(width, height)
        frame = simulate(tabletop(seed=seed), camera, seed=seed)
        assert frame.cloud.rgb is not None
        self.depth = np.nan_to_num(1000.0 * frame.cloud.xyz[:, 2]).round().astype(np.uint16).reshape(height, width)
        self.rgb = frame.cloud.rgb.reshape(height, width, 3)
        self.info = images.camera_info(height, width, fx=camera.fx, fy=camera.fy, cx=camera.cx, cy=camera.cy)

    def labels(self, params: Params, colored: bool = True, encoding: str = "16UC1") -> Any:
        """Labels of the cloud that depth_image_proc makes."""
        depth = self.depth if encoding == "16UC1" else self.depth * np.float32(0.001)
        xyz = images.cloud_of_depth_image_proc(depth, self.info)
        cloud = decode(
            message(xyz, self.rgb.reshape(-1, 3), height=len(self.depth)), max_points=10**7, needs_color=colored
        )
        return Pipeline(params).run(cloud, lambda *_: None).labels


def ros_image(msg: Any, stamp: int, kind: type = Image) -> Any:
    made = kind(data=array("B", bytes(msg.data)))
    names = ("format",) if kind is CompressedImage else ("height", "width", "encoding", "is_bigendian", "step")
    for name in names:
        setattr(made, name, getattr(msg, name))
    made.header.frame_id = "camera_color_optical_frame"
    made.header.stamp.sec, made.header.stamp.nanosec = divmod(stamp, 10**9)
    return made


def ros_info(msg: Any, stamp: int = 0) -> CameraInfo:
    made = CameraInfo(height=msg.height, width=msg.width, distortion_model=msg.distortion_model)
    made.d, made.k, made.r, made.p = (list(map(float, values)) for values in (msg.d, msg.k, msg.r, msg.p))
    made.header.stamp.sec, made.header.stamp.nanosec = divmod(stamp, 10**9)
    return made


class Rig(Client):
    """A client that is a depth camera, too."""

    def __init__(self, domain: int, info: QoSProfile = LATCHED) -> None:
        super().__init__(domain)
        self.depth = self.node.create_publisher(Image, "depth/image", 10)
        self.color = self.node.create_publisher(Image, "color/image", 10)
        self.info = self.node.create_publisher(CameraInfo, "depth/camera_info", info)
        self.time = 10**9

    def wait_for_node(self) -> None:
        for publisher in (self.depth, self.info):
            until(publisher.get_subscription_count, f"a subscription to {publisher.topic_name}", STARTUP)
        until(lambda: self.node.count_publishers("labeled_points"), "a publisher of labels")
        until(lambda: self.diagnostics, "diagnostics")

    def shoot(self, view: View, *, late: int | None = 0, encoding: str = "16UC1") -> int:
        """Publish a view; the color is stamped `late` nanoseconds after the depth, None for no color."""
        self.time += PERIOD
        depth = view.depth if encoding == "16UC1" else (view.depth * np.float32(0.001)).astype(np.float32)
        self.depth.publish(ros_image(images.depth_image(depth, encoding), self.time))
        if late is not None:
            self.color.publish(ros_image(images.color_image(view.rgb, "bgr8"), self.time + late))
        return self.time

    def answer(self, stamp: int) -> PointCloud2 | None:
        sec, nanosec = divmod(stamp, 10**9)
        at = [m for m in self.labeled if (m.header.stamp.sec, m.header.stamp.nanosec) == (sec, nanosec)]
        return at[-1] if at else None

    def see(self, view: View, **how: Any) -> PointCloud2:
        """Show a view until the node answers one of its frames."""
        stamps: list[int] = []

        def answered() -> PointCloud2 | None:
            stamps.append(self.shoot(view, **how))
            try:
                return until(lambda: next(filter(None, map(self.answer, stamps)), None), "an answer", 1.0)
            except AssertionError:
                return None

        return until(answered, "labels of a depth image")


@pytest.fixture(scope="module")
def view() -> View:
    return View(3)


@pytest.fixture(scope="module")
def node(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[NodeProcess]:
    log = tmp_path_factory.mktemp("depth") / "log.txt"
    with running_node(ros_domain, log, "-p", "input:=depth", "-p", "warning_period:=0.0") as process:
        yield process


@pytest.fixture(scope="module")
def client(ros_domain: int, node: NodeProcess, view: View) -> Iterator[Rig]:
    """A camera whose camera_info was published once, before the node could hear it."""
    client = Rig(ros_domain)
    client.info.publish(ros_info(view.info))
    client.wait_for_node()
    yield client
    client.close()


pytestmark = pytest.mark.usefixtures("default_parameters")


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
@pytest.mark.parametrize("output", ["regions", "objects"])
def test_labels_are_those_of_the_cloud(client: Rig, view: View, output: str, encoding: str) -> None:
    assert client.set_atomically({"output": output}).successful
    answer = client.see(view, encoding=encoding)
    assert (answer.height, answer.width) == (HEIGHT, WIDTH)
    assert answer.header.frame_id == "camera_color_optical_frame", "that of the depth image"
    expected = view.labels(Params(output=output), encoding=encoding)
    assert expected.any()
    np.testing.assert_array_equal(label_column(answer), expected)


@pytest.mark.parametrize("late", [-PERIOD // 3, PERIOD // 3])
def test_color_that_is_off_by_less_than_half_a_period_is_paired(client: Rig, view: View, late: int) -> None:
    for _ in range(3):  # until the period is known
        client.shoot(view)
    np.testing.assert_array_equal(label_column(client.see(view, late=late)), view.labels(Params()))


def rejected(client: Rig, reason: str) -> int:
    return int(client.figures().get(f"rejected: {reason}", "0"))


def test_missing_color_is_said_with_what_to_do(client: Rig, view: View, node: NodeProcess) -> None:
    for _ in range(12):
        client.shoot(view, late=10**9)
    before = rejected(client, "color_apart")

    def said() -> bool:
        client.shoot(view, late=None)
        return "[color_apart] color and depth stamps differ by" in node.log and rejected(client, "color_apart") > before

    until(said, "a word on color that is apart")
    assert "more than half a period" in node.log


def test_color_is_left_out_where_it_does_not_count(client: Rig, view: View) -> None:
    until(client.color.get_subscription_count, "a subscription to color")
    assert client.set_atomically({"features": "normals"}).successful
    until(lambda: not client.color.get_subscription_count(), "no subscription to color")
    answer = client.see(view, late=None)
    np.testing.assert_array_equal(label_column(answer), view.labels(Params(features="normals"), colored=False))


def test_the_size_may_change_in_between(client: Rig, view: View, node: NodeProcess) -> None:
    small = View(4, 80, 60)
    client.see(view)
    for _ in range(3):
        client.shoot(small)
    node.wait_for_log("have 80 x 60 pixels, but camera_info on /depth/camera_info describes images of 160 x 120")
    client.info.publish(ros_info(small.info))
    np.testing.assert_array_equal(label_column(client.see(small)), small.labels(Params()))
    client.info.publish(ros_info(view.info))
    np.testing.assert_array_equal(label_column(client.see(view)), view.labels(Params()))


def test_bad_images_are_rejected_with_a_reason_and_the_next_is_answered(client: Rig, view: View) -> None:
    broken = {
        "data_too_short": {"data": array("B", b"\0" * 9)},
        "depth_encoding": {"encoding": "rgb8"},
        "bad_stamp": {},
    }
    for reason, changes in broken.items():
        before = rejected(client, reason)

        def counted(reason: str = reason, changes: Any = changes, before: int = before) -> bool:
            client.time += PERIOD
            depth, color = images.depth_image(view.depth), images.color_image(view.rgb)
            shown = ros_image(depth, client.time), ros_image(color, client.time)
            for name, value in changes.items():
                setattr(shown[0], name, value)
            if reason == "bad_stamp":
                for msg in shown:
                    msg.header.stamp.nanosec = 4 * 10**9
            client.depth.publish(shown[0])
            client.color.publish(shown[1])
            return rejected(client, reason) > before

        until(counted, f"{reason} to be counted")
    assert label_column(client.see(view)).any()


def test_missing_camera_info_is_said_with_where_there_is_some(ros_domain: int, tmp_path: Path, view: View) -> None:
    client = Rig(ros_domain + 50, info=qos_profile_sensor_data)
    other = client.node.create_publisher(CameraInfo, "/camera/depth/camera_info", 1)
    try:
        with running_node(ros_domain + 50, tmp_path / "log.txt", "-p", "input:=depth") as node:
            client.wait_for_node()
            client.node.destroy_publisher(client.info)

            def said() -> bool:
                client.shoot(view)
                return "no_camera_info" in node.log

            until(said, "a word on camera_info")
            line = next(line for line in node.log.splitlines() if "[no_camera_info]" in line)
            assert "depth images come on /depth/image, but no camera_info on /depth/camera_info" in line
            assert line.endswith("remap with --ros-args -r depth/camera_info:=/camera/depth/camera_info")
            other.publish(ros_info(view.info))
    finally:
        client.close()


def test_packed_images_of_best_effort_publishers(ros_domain: int, tmp_path: Path, view: View) -> None:
    import io

    from PIL import Image as Picture

    client = Rig(ros_domain + 51)
    depth = client.node.create_publisher(CompressedImage, "/cam/depth/compressedDepth", qos_profile_sensor_data)
    color = client.node.create_publisher(CompressedImage, "/cam/rgb/compressed", qos_profile_sensor_data)
    info = client.node.create_publisher(CameraInfo, "/cam/info", qos_profile_sensor_data)
    file = io.BytesIO()
    Picture.fromarray(view.rgb).save(file, "PNG")
    packed = images.packed_depth(view.depth), images.compressed(file.getvalue(), "rgb8; png compressed bgr8")
    remaps = {"depth/image": "/cam/depth", "depth/camera_info": "/cam/info", "color/image": "/cam/rgb"}
    arguments = [part for name, topic in remaps.items() for part in ("-r", f"{name}:={topic}")]
    for name, value in (("input", "depth"), ("depth_transport", "compressedDepth"), ("color_transport", "compressed")):
        arguments += ["-p", f"{name}:={value}"]
    try:
        with running_node(ros_domain + 51, tmp_path / "log.txt", *arguments) as node:
            node.wait_for_log("active: waiting for depth images on /cam/depth/compressedDepth")

            def answered() -> PointCloud2 | None:
                client.time += PERIOD
                info.publish(ros_info(view.info, client.time))
                depth.publish(ros_image(packed[0], client.time, CompressedImage))
                color.publish(ros_image(packed[1], client.time, CompressedImage))
                return client.labeled[-1] if client.labeled else None

            answer = until(answered, "labels", STARTUP)
            np.testing.assert_array_equal(label_column(answer), view.labels(Params()))
    finally:
        client.close()


def test_silence_is_said_with_the_depth_images_that_there_are(ros_domain: int, tmp_path: Path) -> None:
    client = Client(ros_domain + 50)
    made = [
        client.node.create_publisher(kind, topic, 1)
        for kind, topic in (
            (Image, "/camera/color/image_raw"),
            (Image, "/camera/depth/image_rect_raw"),
            (CompressedImage, "/depth/image/compressedDepth"),
        )
    ]
    arguments = ("-p", "input:=depth", "-p", "input_timeout:=1.0")
    try:
        with running_node(ros_domain + 50, tmp_path / "log.txt", *arguments) as node:
            node.wait_for_log("set depth_transport to compressedDepth for /depth/image/compressedDepth")
            (*_, line) = (line for line in node.log.splitlines() if "no depth images on /depth/image" in line)
            assert "-r depth/image:=/camera/depth/image_rect_raw or" in line
    finally:
        del made
        client.close()


def played(domain: int, *arguments: object) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-m", "topo_region_seg", "play", *map(str, arguments)],
        env={**os.environ, "ROS_DOMAIN_ID": str(domain), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=STARTUP,
    )
    return done.returncode, done.stderr


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The view, eight times, as images alone."""
    camera = Camera.kinect(WIDTH, HEIGHT)
    frame = simulate(tabletop(seed=3), camera, seed=3)
    path = tmp_path_factory.mktemp("recording") / "images.mcap"
    write_recording(path, [(frame.cloud, frame.labels)] * 8, camera=camera, clouds=False)
    return path


@pytest.mark.parametrize("stamp", ["recorded", "now"])
def test_recorded_images_are_played_to_the_inputs_of_the_node(
    client: Rig, view: View, recording: Path, ros_domain: int, stamp: str
) -> None:
    before = len(client.labeled)
    status, err = played(ros_domain, recording, "--stamp", stamp, "--hz", 10)
    assert status == 0, err
    assert "published 8 depth images of /camera/depth/image_rect_raw on depth/image" in err
    until(lambda: len(client.labeled) > before, "labels of the recording")
    assert client.labeled[-1].header.frame_id == "camera_depth_optical_frame"
    np.testing.assert_array_equal(label_column(client.labeled[-1]), view.labels(Params()))


def test_recorded_images_are_played_as_clouds(view: View, recording: Path, ros_domain: int) -> None:
    client = Client(ros_domain + 50)
    try:
        clouds = client.collect(PointCloud2, "points")
        status, err = played(ros_domain + 50, recording, "--as-clouds", "--hz", 20, "--wait-timeout", 60)
        assert status == 0 and "published 8 clouds of /camera/depth/image_rect_raw on points" in err
        until(lambda: len(clouds) == 8, "all clouds")
        xyz = decode(clouds[-1], max_points=10**6).xyz
        np.testing.assert_array_equal(xyz, images.cloud_of_depth_image_proc(view.depth, view.info))
    finally:
        client.close()
    status, err = played(ros_domain + 50, recording, "--remap-to", "elsewhere")
    assert status == 2 and "use --ros-args -r depth/image:=TOPIC" in err
