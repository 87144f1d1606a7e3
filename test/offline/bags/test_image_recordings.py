# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of depth images in place of clouds: found, paired, and taken by every tool."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import images
import numpy as np
import pytest
from bag_maker import SECOND, Entry, cloud_entries, write_folder, write_mcap, write_ros1
from clouds import message
from rosbags.rosbag2 import StoragePlugin

from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags import BagError, open_bag
from topo_region_seg.offline.bags.clouds import cloud_records, cloud_topic, cloud_topics, decode_message
from topo_region_seg.offline.bags.images import ImageTopic
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.images import COLOR_TOPIC, DEPTH_TOPIC, INFO_TOPIC, image_messages
from topo_region_seg.offline.simulation.recording import TRUTH_TOPIC, make_header, write_recording
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

IMAGE, PACKED, INFO = (f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "CameraInfo"))
CAMERA = Camera.kinect(80, 60)
N = 3


@pytest.fixture(scope="module")
def frames() -> list[tuple[Cloud, Any]]:
    made = [simulate(tabletop(seed=5), CAMERA, seed=number) for number in range(N)]
    return [(frame.cloud, frame.labels) for frame in made]


def entries_of(frames: Sequence[tuple[Cloud, Any]], encoding: str = "16UC1") -> list[Entry]:
    """Info, color and depth at each second, as the simulator makes them."""
    kinds = {INFO_TOPIC: INFO, COLOR_TOPIC: IMAGE, DEPTH_TOPIC: IMAGE}
    return [
        (topic, kinds[topic], number * SECOND, msg)
        for number, (cloud, _) in enumerate(frames, start=1)
        for topic, msg in image_messages(make_header(number * SECOND, "camera"), cloud, CAMERA, encoding)
    ]


def expected(cloud: Cloud, encoding: str = "16UC1") -> Cloud:
    """The cloud that depth_image_proc makes of the images."""
    depth = cloud.xyz[:, 2].reshape(cloud.height, cloud.width).astype(np.float32)
    given = np.nan_to_num(np.round(1000.0 * depth)).astype(np.uint16) if encoding == "16UC1" else depth
    info = images.camera_info(60, 80, fx=CAMERA.fx, fy=CAMERA.fy, cx=CAMERA.cx, cy=CAMERA.cy)
    return decode(message(images.cloud_of_depth_image_proc(given, info), cloud.rgb, height=60), max_points=10**6)


def read(path: Path, topic: str | None = None) -> tuple[Any, list[Any]]:
    """Return the topic, and each of its clouds or why there is none."""
    with open_bag(path) as reader:
        found = cloud_topic(reader, topic)
        clouds: list[Any] = []
        for record in cloud_records(reader, found):
            try:
                clouds.append(decode(decode_message(record, found), max_points=10**6))
            except ValueError as error:
                clouds.append(getattr(error, "reason", str(error)))
        return found, clouds


def same(clouds: Sequence[Cloud], frames: Sequence[tuple[Cloud, Any]], encoding: str = "16UC1") -> None:
    assert len(clouds) == len(frames)
    for ours, (given, _) in zip(clouds, frames, strict=True):
        theirs = expected(given, encoding)
        np.testing.assert_array_equal(ours.xyz, theirs.xyz)
        np.testing.assert_array_equal(ours.rgb, theirs.rgb)
        assert (ours.height, ours.width) == (60, 80)


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
@pytest.mark.parametrize(
    "write",
    [
        lambda path, entries: write_mcap(path / "a.mcap", entries),
        lambda path, entries: write_ros1(path / "a.bag", entries),
        lambda path, entries: write_folder(path / "folder", entries, StoragePlugin.SQLITE3),
    ],
    ids=["mcap", "ROS 1", "sqlite3"],
)
def test_clouds_of_every_kind_of_recording(write: Any, encoding: str, frames: Any, tmp_path: Path) -> None:
    topic, clouds = read(write(tmp_path, entries_of(frames, encoding)))
    assert (topic.name, topic.info, topic.color) == (DEPTH_TOPIC, INFO_TOPIC, COLOR_TOPIC)
    assert topic.count == N
    same(clouds, frames, encoding)


def test_the_simulator_writes_what_the_tools_read(frames: Any, tmp_path: Path) -> None:
    write_recording(tmp_path / "bag", frames, camera=CAMERA, clouds=False)
    same(read(tmp_path / "bag")[1], frames)
    write_recording(tmp_path / "both.mcap", frames, camera=CAMERA, depth_encoding="32FC1")
    topic, clouds = read(tmp_path / "both.mcap")
    assert not isinstance(topic, ImageTopic), "clouds go before images"
    np.testing.assert_array_equal(clouds[0].xyz, frames[0][0].xyz)
    topic, clouds = read(tmp_path / "both.mcap", DEPTH_TOPIC)
    same(clouds, frames, "32FC1")
    with pytest.raises(ValueError, match="80 x 60"):
        write_recording(tmp_path / "no", frames, camera=Camera.kinect(40, 30))


def test_packed_images(frames: Any, tmp_path: Path) -> None:
    from PIL import Image as Picture

    entries = []
    for topic, kind, time, msg in entries_of(frames):
        if topic == DEPTH_TOPIC:
            packed = images.packed_depth(msg.data.view(np.uint16).reshape(60, 80))
        elif topic == COLOR_TOPIC:
            file = io.BytesIO()
            Picture.fromarray(msg.data.reshape(60, 80, 3)).save(file, "PNG")
            packed = images.compressed(file.getvalue(), "rgb8; png compressed bgr8")
        else:
            entries.append((topic, kind, time, msg))
            continue
        transport = "compressedDepth" if topic == DEPTH_TOPIC else "compressed"
        entries.append((f"{topic}/{transport}", PACKED, time, replace(packed, header=msg.header)))
    bag = write_mcap(tmp_path / "a.mcap", entries)
    topic, clouds = read(bag)
    assert (topic.name, topic.color) == (f"{DEPTH_TOPIC}/compressedDepth", f"{COLOR_TOPIC}/compressed")
    same(clouds, frames)
    # Where both are there, the raw ones are read.
    both = write_mcap(tmp_path / "both.mcap", [*entries, *entries_of(frames)])
    assert read(both)[0].name == DEPTH_TOPIC


def test_every_cut_gives_the_frames_that_are_whole(frames: Any, tmp_path: Path) -> None:
    whole = write_mcap(tmp_path / "whole.mcap", entries_of(frames)).read_bytes()
    counts = []
    for end in range(len(whole) * 2 // 5, len(whole), len(whole) // 12):
        cut = tmp_path / f"{end}.mcap"
        cut.write_bytes(whole[:end])
        with open_bag(cut) as reader:
            assert reader.truncated
        _, clouds = read(cut)
        good = [cloud for cloud in clouds if isinstance(cloud, Cloud)]
        same(good, frames[: len(good)])
        counts.append(len(good))
    assert counts == sorted(counts) and counts[0] < counts[-1] == N


def test_late_color_is_paired_and_missing_partners_are_said(frames: Any, tmp_path: Path) -> None:
    entries = entries_of(frames)

    def shifted(seconds: float, keep: Any = lambda number: True) -> list[Entry]:
        made = []
        for number, (topic, kind, time, msg) in enumerate(entries):
            if topic == COLOR_TOPIC:
                if not keep(number // 3):
                    continue
                later = time + int(seconds * SECOND)
                msg = replace(msg, header=make_header(later, "camera"))
            made.append((topic, kind, time, msg))
        return made

    same(read(write_mcap(tmp_path / "late.mcap", shifted(0.3)))[1], frames)
    assert read(write_mcap(tmp_path / "far.mcap", shifted(100.0)))[1] == ["color_apart"] * N
    _, clouds = read(write_mcap(tmp_path / "gap.mcap", shifted(0.0, lambda number: number != 1)))
    assert [cloud if isinstance(cloud, str) else "" for cloud in clouds] == ["", "color_apart", ""]
    without = [entry for entry in entries if entry[0] != INFO_TOPIC]
    assert read(write_mcap(tmp_path / "info.mcap", without))[1] == ["no_camera_info"] * N
    # Once is enough, even when it comes last.
    once = write_mcap(tmp_path / "once.mcap", [*without, (INFO_TOPIC, INFO, 9 * SECOND, entries[0][3])])
    same(read(once)[1], frames)


def test_damaged_images_cost_only_themselves(frames: Any, tmp_path: Path) -> None:
    entries = entries_of(frames)
    broken = [
        (topic, kind, time, b"\0\1\0\0rubbish" if topic == DEPTH_TOPIC and time == 2 * SECOND else msg)
        for topic, kind, time, msg in entries
    ]
    _, clouds = read(write_mcap(tmp_path / "a.mcap", broken))
    kinds = sorted(cloud if isinstance(cloud, str) else "" for cloud in clouds)
    assert kinds == ["", "", "undecodable"]


def renamed(entries: Sequence[Entry], names: dict[str, str], frame: str = "camera") -> list[Entry]:
    return [
        (names[topic], kind, time, replace(msg, header=replace(msg.header, frame_id=frame)))
        for topic, kind, time, msg in entries
        if topic in names
    ]


def test_which_images_belong_together(frames: Any, tmp_path: Path) -> None:
    """As a realsense has them: an infrared image and an unaligned depth image beside the aligned one."""
    entries = entries_of(frames)
    aligned = renamed(
        entries,
        {
            DEPTH_TOPIC: "/cam/aligned_depth_to_color/image_raw",
            INFO_TOPIC: "/cam/aligned_depth_to_color/camera_info",
            COLOR_TOPIC: "/cam/color/image_raw",
        },
        "color_frame",
    )
    unaligned = renamed(
        entries, {DEPTH_TOPIC: "/cam/depth/image_rect_raw", INFO_TOPIC: "/cam/depth/camera_info"}, "depth_frame"
    )
    gray = images.image(np.zeros((60, 80), np.uint8), "mono8")
    infrared = [("/cam/infra1/image_rect_raw", IMAGE, SECOND, gray)]
    topic, clouds = read(write_mcap(tmp_path / "a.mcap", [*aligned, *unaligned, *infrared]))
    assert topic.name == "/cam/aligned_depth_to_color/image_raw", "the one that color belongs to"
    assert (topic.info, topic.color) == ("/cam/aligned_depth_to_color/camera_info", "/cam/color/image_raw")
    same(clouds, frames)
    topic, clouds = read(tmp_path / "a.mcap", "/cam/depth/image_rect_raw")
    assert (topic.info, topic.color) == ("/cam/depth/camera_info", ""), "colors of another frame would be misplaced"
    assert all(cloud.rgb is None for cloud in clouds)


def test_several_cameras_are_named_and_one_can_be_chosen(frames: Any, tmp_path: Path) -> None:
    entries = entries_of(frames)
    both = [
        entry
        for side in ("left", "right")
        for entry in renamed(entries, {topic: f"/{side}{topic}" for topic in (DEPTH_TOPIC, INFO_TOPIC, COLOR_TOPIC)})
    ]
    bag = write_mcap(tmp_path / "a.mcap", both)
    with pytest.raises(BagError, match=f"choose one: --topic /left{DEPTH_TOPIC}, --topic /right{DEPTH_TOPIC}"):
        read(bag)
    topic, clouds = read(bag, f"/right{DEPTH_TOPIC}")
    assert (topic.info, topic.color) == (f"/right{INFO_TOPIC}", f"/right{COLOR_TOPIC}")
    same(clouds, frames)
    with pytest.raises(BagError, match=f"of type {IMAGE}; choose one of: --topic /left"):
        read(bag, f"/right{COLOR_TOPIC}")


def test_recordings_of_clouds_are_read_as_before(tmp_path: Path, frames: Any) -> None:
    bag = write_mcap(tmp_path / "a.mcap", [*cloud_entries(2), *entries_of(frames)])
    with open_bag(bag) as reader:
        assert cloud_topic(reader).name == "/camera/points"
        assert [topic.name for topic in cloud_topics(reader)] == ["/camera/points"]


def run(*arguments: object, status: int = 0) -> None:
    assert main([str(argument) for argument in arguments]) == status


def test_replay_gives_the_labels_of_the_clouds(frames: Any, tmp_path: Path, capsys: Any) -> None:
    bag, out = write_mcap(tmp_path / "a.mcap", entries_of(frames)), tmp_path / "out.mcap"
    run("replay", bag, "-o", out, "--with-input")
    assert f"{DEPTH_TOPIC}: clouds made of depth images, with {INFO_TOPIC}, colors of {COLOR_TOPIC}" in (
        capsys.readouterr().err
    )
    with open_bag(out) as reader:
        labeled = next(topic for topic in reader.topics if topic.name == "/labeled_points")
        records = list(reader.messages(["/labeled_points"]))
        answers = [decode_message(record, labeled) for record in records]
        given = next(topic for topic in reader.topics if topic.name == "/camera/depth/points")
        inputs = [decode(decode_message(record, given), max_points=10**6) for record in reader.messages([given.name])]
    same(inputs, frames)
    assert [record.log_time for record in records] == [SECOND, 2 * SECOND, 3 * SECOND]
    for answer, (cloud, _) in zip(answers, frames, strict=True):
        labels = answer.data.reshape(-1, answer.point_step)[:, -4:].copy().view(np.uint32)[:, 0]
        seg = Pipeline(Params()).run(expected(cloud), lambda *_: None)
        assert seg.labels.any()
        np.testing.assert_array_equal(labels, seg.labels)
        assert answer.header.frame_id == "camera"


def test_replay_says_which_frames_have_no_partner(frames: Any, tmp_path: Path) -> None:
    entries = [entry for entry in entries_of(frames) if not (entry[0] == COLOR_TOPIC and entry[2] == SECOND)]
    summary = tmp_path / "summary.json"
    run("replay", write_mcap(tmp_path / "a.mcap", entries), "--json", summary, status=1)
    found = json.loads(summary.read_text())
    assert [frame["stamp"] for frame in found["frames"]] == [2.0, 3.0]
    assert [rejection["reason"] for rejection in found["rejected"]] == ["color_apart"]


def test_evaluate_measures_against_the_truth_beside_the_images(frames: Any, tmp_path: Path) -> None:
    quality = tmp_path / "quality.json"
    write_recording(tmp_path / "bag", frames, camera=CAMERA, clouds=False)
    run("evaluate", tmp_path / "bag", "--json", quality)
    of_images = json.loads(quality.read_text())
    assert len(of_images["frames"]) == N and of_images["mean"]["wov"] > 0.3
    with open_bag(tmp_path / "bag") as reader:
        assert reader.count(TRUTH_TOPIC) == N


def test_inspect_shows_what_the_clouds_are_made_of(frames: Any, tmp_path: Path, capsys: Any) -> None:
    bag, found = write_mcap(tmp_path / "a.mcap", entries_of(frames)), tmp_path / "found.json"
    run("inspect", bag, "--json", found)
    assert f"clouds made of depth images, with {INFO_TOPIC}, colors of {COLOR_TOPIC}" in capsys.readouterr().out
    report = json.loads(found.read_text())["clouds"][DEPTH_TOPIC]
    assert report["count"] == N and report["color"] and report["suggested"]


def test_a_run_of_images_can_be_reported(frames: Any, tmp_path: Path) -> None:
    bag, out = write_mcap(tmp_path / "a.mcap", entries_of(frames)), tmp_path / "out.mcap"
    run("replay", bag, "-o", out)
    run("report", out)
