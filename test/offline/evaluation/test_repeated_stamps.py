# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Clouds that share a stamp are paired with their truth in order, or refused where the order does not tell."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from bag_maker import CLOUD, SECOND, Entry, cloud_entries, write_mcap
from clouds import TYPES

from topo_region_seg.cloud.pointcloud2 import encode
from topo_region_seg.offline.bags.types import bag_types
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.evaluation import run as evaluation
from topo_region_seg.offline.runs.comparison import compare
from topo_region_seg.offline.runs.run import open_run
from topo_region_seg.offline.runs.truth import truth_of_run
from topo_region_seg.offline.simulation import Camera, SimulatedFrame, orbit, simulate, tabletop
from topo_region_seg.offline.simulation.recording import CLOUD_TOPIC, TRUTH_TOPIC, camera_cloud

COUNT = 4
COARSE = ["--set", "normal_radius=0.04", "--set", "max_radius=0.06", "--set", "min_region_size=8"]


@pytest.fixture(scope="module")
def frames() -> list[SimulatedFrame]:
    return [simulate(tabletop(1), camera, seed) for seed, camera in enumerate(orbit(Camera.kinect(80, 60), COUNT))]


def entries(frames: list[SimulatedFrame], stamps: list[int], truths: range | list[int] | None = None) -> list[Entry]:
    """Clouds and truths with given header stamps (s), recorded a second apart; `truths` are those that are there."""
    found: list[Entry] = []
    for number, (frame, stamp) in enumerate(zip(frames, stamps, strict=True)):
        header = TYPES.Header(stamp=TYPES.Time(sec=stamp, nanosec=0), frame_id="camera")
        shape = {"height": frame.cloud.height, "width": frame.cloud.width, "is_dense": True}
        truth = encode(bag_types(), header, {"label": frame.labels}, **shape)
        found.append((CLOUD_TOPIC, CLOUD, number * SECOND, camera_cloud(header, frame.cloud)))
        if truths is None or number in truths:
            found.append((TRUTH_TOPIC, CLOUD, number * SECOND, truth))
    return found


def evaluated(bag: Path, status: int = 0) -> dict:
    out = bag.with_suffix(".json")
    assert main(["evaluate", str(bag), "--json", str(out), *COARSE]) == status
    return json.loads(out.read_text())


@pytest.mark.parametrize("frames_a_task", [1, 50])
@pytest.mark.parametrize("stamps", [[0, 0, 0, 0], [5, 5, 6, 6], [7, 8, 7, 8], [5, 6, 6, 7]])
def test_equal_stamps_give_the_same_as_different_ones(frames, stamps, frames_a_task, tmp_path, monkeypatch, capsys):
    wanted = evaluated(write_mcap(tmp_path / "good.mcap", entries(frames, [1, 2, 3, 4])))
    assert "repeated stamps" not in capsys.readouterr().err
    monkeypatch.setattr(evaluation, "FRAMES_A_TASK", frames_a_task)
    found = evaluated(write_mcap(tmp_path / "bad.mcap", entries(frames, stamps)))
    assert len({frame["wov"] for frame in wanted["frames"]}) == COUNT  # so that a wrong pair would be seen
    assert [frame["wov"] for frame in found["frames"]] == [frame["wov"] for frame in wanted["frames"]]
    repeated = sum(stamps.count(stamp) > 1 for stamp in stamps)
    assert f": {repeated} clouds have the stamp of another cloud" in capsys.readouterr().err


@pytest.mark.parametrize("frames_a_task", [1, 50])
def test_clouds_that_the_order_does_not_pair_are_refused(frames, frames_a_task, tmp_path, monkeypatch):
    monkeypatch.setattr(evaluation, "FRAMES_A_TASK", frames_a_task)
    bag = write_mcap(tmp_path / "a.mcap", entries(frames, [0, 0, 0, 9], truths=[0, 2, 3]))
    found = evaluated(bag, status=1)
    assert [frame["stamp"] for frame in found["frames"]] == [9.0]
    assert [rejection["reason"] for rejection in found["rejected"]] == ["repeated_stamp"] * 3
    assert "clouds of this stamp: 3, truths: 2" in found["rejected"][0]["detail"]
    # Of a single truth, the clouds after the first have none.
    found = evaluated(write_mcap(tmp_path / "b.mcap", entries(frames, [0, 0, 0, 9], truths=[0, 3])), status=1)
    assert len(found["frames"]) == 2
    assert [rejection["reason"] for rejection in found["rejected"]] == ["repeated_stamp"] * 2


def replay(bag: Path, *options: str, status: int = 0) -> Path:
    out = bag.with_name(f"run_{bag.stem}_{len(options)}.mcap")
    assert main(["replay", str(bag), "-o", str(out), *COARSE, *options]) == status
    return out


def test_the_frames_of_a_run_have_the_truth_of_their_clouds(frames, tmp_path):
    runs = {
        name: open_run(replay(write_mcap(tmp_path / f"{name}.mcap", entries(frames, stamps))))
        for name, stamps in (("good", [1, 2, 3, 4]), ("bad", [0, 0, 0, 0]))
    }
    quality = {name: [f.quality[0] for f in compare(run, run, truth_of_run(run)).frames] for name, run in runs.items()}
    assert quality["good"] == quality["bad"] and None not in quality["good"]


def test_a_rejected_cloud_leaves_the_truth_of_its_stamp_unknown(frames, tmp_path, capsys):
    made = entries(frames, [0, 0, 0, 9])
    made[2][3].data = made[2][3].data[:-1]
    run = replay(write_mcap(tmp_path / "in.mcap", made), status=1)
    found = open_run(run)
    truth = truth_of_run(found)
    assert truth is not None
    assert [truth.of(frame) is not None for frame in found.frames()] == [False, False, True]
    assert truth.unpaired == [0.0, 0.0]
    capsys.readouterr()
    assert main(["report", str(run), "-o", str(tmp_path / "run.html")]) == 0
    said = capsys.readouterr().err
    assert "without truth: 2 frames" in said and "no barcode of frame 0, 1:" in said


def test_runs_that_read_other_clouds_of_a_stamp_are_not_compared(tmp_path, capsys):
    first, second, third = cloud_entries(3)
    for entry in (first, second):
        entry[3].header.stamp = TYPES.Time(sec=0, nanosec=0)
    a = replay(write_mcap(tmp_path / "a.mcap", [first, second, third]))
    b = replay(write_mcap(tmp_path / "b.mcap", [second, third]))
    assert [frame.index for frame in compare(open_run(a), open_run(a)).frames] == [(0, 0), (1, 1), (2, 2)]
    found = compare(open_run(a), open_run(b))
    assert [frame.index for frame in found.frames] == [(2, 1)]
    assert (found.unpaired, found.only_a, found.only_b) == ([0.0], [0.0, 0.0], [0.0])
    assert main(["compare", str(a), str(b), "--max-unmatched", "2"]) == 1
    said = capsys.readouterr()
    assert (
        "not compared: 1 stamp that several clouds have, the first 0.000 s" in said.out
        and "--max-unmatched 2: it is 3" in said.err
    )
