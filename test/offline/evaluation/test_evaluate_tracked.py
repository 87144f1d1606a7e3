# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``evaluate`` follows a stream's regions as the node and the replay do."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from bag_maker import write_mcap
from places import ROOT

from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import decode_message
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.evaluation import run
from topo_region_seg.offline.simulation.recording import CLOUD_TOPIC, TRUTH_TOPIC

BAG = ROOT / "bags" / "tabletop_sim"
TRACKED = ["--set", "track_regions=true"]
HELD = [*TRACKED, "--set", "hold_regions=true"]


def frames(path: Path, tmp_path: Path, *options: object) -> list[dict[str, float]]:
    out = tmp_path / "found.json"
    assert main(["evaluate", str(path), "--json", str(out), *map(str, options)]) == 0
    left_out = ("ms", "bag")
    return [{k: v for k, v in f.items() if k not in left_out} for f in json.loads(out.read_text())["frames"]]


@pytest.fixture(autouse=True)
def small_tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if each recording were a long one: a task for each cloud, where clouds stand alone."""
    monkeypatch.setattr(run, "FRAMES_A_TASK", 1)


def test_what_is_measured_is_what_a_replay_writes(tmp_path: Path) -> None:
    assert main(["replay", str(BAG), "-o", str(tmp_path / "out.mcap"), *HELD]) == 0
    recorded = frames(tmp_path / "out.mcap", tmp_path, "--recorded-labels", "--truth-bag", BAG)
    held = frames(BAG, tmp_path, *HELD)
    assert held == recorded
    assert held == frames(BAG, tmp_path), "between views far from one another nothing is held"


def test_labels_alone_change_no_measure(tmp_path: Path) -> None:
    assert frames(BAG, tmp_path, *TRACKED) == frames(BAG, tmp_path)


def test_clouds_without_truth_are_followed_too(tmp_path: Path) -> None:
    with open_bag(BAG) as reader:
        topics = {topic.name: topic for topic in reader.topics}
        records = list(reader.messages([CLOUD_TOPIC, TRUTH_TOPIC]))
    messages = [(r.topic, r.type, r.log_time, decode_message(r, topics[r.topic])) for r in records]
    second = sorted({time for topic, _, time, _ in messages if topic == TRUTH_TOPIC})[1]
    some = [entry for entry in messages if (entry[0], entry[2]) != (TRUTH_TOPIC, second)]
    bag = write_mcap(tmp_path / "some.mcap", some)
    whole = frames(BAG, tmp_path, *HELD)
    assert frames(bag, tmp_path, *HELD) == whole[:1] + whole[2:]


def test_a_sweep_over_tracking(tmp_path: Path) -> None:
    """What is tracked is one task, what is not one for each cloud; of the same recording."""
    out = tmp_path / "sweep.json"
    grid = ["--set", "track_regions=false,true", "--set", "hold_regions=true"]
    assert main(["sweep", str(BAG), "--cache", str(tmp_path / "cache"), "--json", str(out), *grid]) == 0
    found = {c["varied"]["track_regions"]: c["mean"]["wov"] for c in json.loads(out.read_text())["combinations"]}
    assert found == {False: mean_overlap(frames(BAG, tmp_path)), True: mean_overlap(frames(BAG, tmp_path, *HELD))}


def mean_overlap(measured: list[dict[str, float]]) -> object:
    return pytest.approx(sum(frame["wov"] for frame in measured) / len(measured))
