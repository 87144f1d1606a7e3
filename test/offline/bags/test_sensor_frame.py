# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Clouds in a robot's frame are seen from where the transforms of the recording put the camera."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message
from topo_region_seg.offline.bags.opening import open_bag
from topo_region_seg.offline.bags.sensor_frame import SensorFrame
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.simulation import Camera, simulate, tabletop

STORE = get_typestore(Stores.ROS2_JAZZY)
TURN = Rotation.from_euler("xyz", [-2.2, 0.1, -1.5])
PLACE = np.array([0.4, -0.1, 1.1])


def header(frame: str, sec: int) -> Any:
    kinds = STORE.types
    return kinds["std_msgs/msg/Header"](stamp=kinds["builtin_interfaces/msg/Time"](sec=sec, nanosec=0), frame_id=frame)


def transform(parent: str, child: str, rotation: Rotation, place: np.ndarray, sec: int = 0) -> Any:
    kinds = STORE.types
    x, y, z, w = (float(value) for value in rotation.as_quat())
    return kinds["geometry_msgs/msg/TransformStamped"](
        header=header(parent, sec),
        child_frame_id=child,
        transform=kinds["geometry_msgs/msg/Transform"](
            translation=kinds["geometry_msgs/msg/Vector3"](*(float(value) for value in place)),
            rotation=kinds["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
        ),
    )


def record(path: Path, transforms: dict[str, list[Any]], frame: str = "base_link", sec: int = 5) -> Path:
    """Record a tabletop in the frame of a robot, with some transforms."""
    cloud = simulate(tabletop(1), Camera.kinect(160, 120), 1).cloud
    assert cloud.rgb is not None
    xyz = TURN.apply(cloud.xyz.astype(np.float64)) + PLACE if frame == "base_link" else cloud.xyz
    rows = np.zeros(len(cloud), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
    rows["x"], rows["y"], rows["z"] = xyz.T
    red, green, blue = cloud.rgb.astype(np.uint32).T
    rows["rgb"] = red << 16 | green << 8 | blue
    kinds = STORE.types
    fields = [
        kinds["sensor_msgs/msg/PointField"](name=name, offset=4 * i, datatype=7, count=1)
        for i, name in enumerate(("x", "y", "z", "rgb"))
    ]
    msg = kinds["sensor_msgs/msg/PointCloud2"](
        header=header(frame, sec),
        height=cloud.height,
        width=cloud.width,
        fields=fields,
        is_bigendian=False,
        point_step=16,
        row_step=16 * cloud.width,
        data=rows.view(np.uint8).reshape(-1),
        is_dense=False,
    )
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        clouds = writer.add_connection("/points", msg.__msgtype__, typestore=STORE)
        for topic, items in transforms.items():
            kind = kinds["tf2_msgs/msg/TFMessage"]
            connection = writer.add_connection(topic, kind.__msgtype__, typestore=STORE)
            writer.write(connection, 10**9, STORE.serialize_cdr(kind(transforms=items), kind.__msgtype__))
        writer.write(clouds, sec * 10**9, STORE.serialize_cdr(msg, msg.__msgtype__))
    return path


def placed(path: Path) -> tuple[tuple[float, ...] | None, str]:
    with open_bag(path) as reader:
        topic = cloud_topic(reader)
        sensor = SensorFrame(reader)
        msg = decode_message(next(iter(reader.messages([topic.name]))), topic)
        return sensor.place(decode(msg, max_points=10**6), msg).sensor_pose, sensor.note


OPTICAL = transform("base_link", "camera_depth_optical_frame", TURN, PLACE)


def test_the_pose_is_that_of_the_camera_in_the_frame_of_the_clouds(tmp_path: Path) -> None:
    pose, note = placed(record(tmp_path / "bag", {"/tf_static": [OPTICAL]}))
    assert pose is not None
    assert pose[:3] == pytest.approx(PLACE)
    x, y, z, w = TURN.as_quat()
    assert abs(np.dot(pose[3:], [w, x, y, z])) == pytest.approx(1.0)
    assert "base_link: seen from camera_depth_optical_frame" in note


def test_chains_go_up_and_down_the_tree(tmp_path: Path) -> None:
    up = Rotation.from_euler("z", 0.7)
    chain = [
        transform("torso", "base_link", up, np.array([0.0, 0.0, 0.3])),
        transform("torso", "head", Rotation.identity(), np.array([0.1, 0.0, 1.0])),
        transform("head", "camera_optical_frame", TURN, np.array([0.0, 0.2, 0.0])),
    ]
    pose, _ = placed(record(tmp_path / "bag", {"/tf_static": chain}))
    assert pose is not None
    assert pose[:3] == pytest.approx(up.inv().apply([0.1, 0.2, 0.7]))


def test_a_moving_camera_is_where_it_was_at_the_time_of_the_cloud(tmp_path: Path) -> None:
    moves = [
        transform("base_link", "camera_optical_frame", TURN, PLACE + [0.0, 0.0, 0.1 * sec], sec) for sec in (9, 3, 5, 1)
    ]
    pose, _ = placed(record(tmp_path / "bag", {"/tf": moves}, sec=6))
    assert pose is not None and pose[2] == pytest.approx(PLACE[2] + 0.5)


@pytest.mark.parametrize(
    ("items", "frame", "note"),
    [
        ([OPTICAL], "camera_color_optical_frame", ""),
        ([transform("map", "odom", TURN, PLACE)], "base_link", ""),
        ([transform("elsewhere", "camera_optical_frame", TURN, PLACE)], "base_link", ""),
        ([OPTICAL, transform("base_link", "rear_optical_frame", TURN, -PLACE)], "base_link", "several cameras"),
    ],
)
def test_where_nothing_tells_the_camera_the_cloud_stays_as_it_is(
    tmp_path: Path, items: list[Any], frame: str, note: str
) -> None:
    pose, said = placed(record(tmp_path / "bag", {"/tf_static": items}, frame))
    assert pose is None and note in said and bool(note) == bool(said)


@pytest.mark.parametrize(("apart", "one"), [(0.1, True), (0.2, True), (0.201, False)])
def test_several_cameras_of_one_head_count_as_one_and_the_depth_camera_is_it(
    tmp_path: Path, apart: float, one: bool
) -> None:
    still = Rotation.identity()
    items = [
        transform("base_link", "camera_color_optical_frame", still, np.array([apart, 0.0, 0.0])),
        transform("base_link", "camera_depth_optical_frame", still, np.zeros(3)),
    ]
    pose, note = placed(record(tmp_path / "bag", {"/tf_static": items}))
    assert pose == ((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0) if one else None)
    assert ("seen from camera_depth_optical_frame" in note) is one and ("several cameras" in note) is not one


def test_the_tools_see_clouds_from_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    regions = {}
    for name, items in (("with", [OPTICAL]), ("without", [transform("map", "odom", TURN, PLACE)])):
        bag = record(tmp_path / name, {"/tf_static": items})
        assert main(["replay", str(bag), "--json", str(tmp_path / "out.json")]) == 0
        regions[name] = json.loads((tmp_path / "out.json").read_text())["frames"][0]["regions"]
    own = record(tmp_path / "own", {}, "camera_optical_frame")
    assert main(["replay", str(own), "--json", str(tmp_path / "out.json")]) == 0
    expected = json.loads((tmp_path / "out.json").read_text())["frames"][0]["regions"]
    assert abs(regions["with"] - expected) <= 2
    assert "seen from camera_depth_optical_frame" in capsys.readouterr().err
    assert main(["inspect", str(tmp_path / "with")]) == 0
    assert "seen from camera_depth_optical_frame" in capsys.readouterr().out
