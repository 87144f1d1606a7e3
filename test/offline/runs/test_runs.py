# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs: what a replay writes of itself, and what is read back."""

from __future__ import annotations

import dataclasses
import json
from collections import Counter

import numpy as np
import pytest
import quality_oracle
from bag_maker import cloud_entries, count_entry, write_mcap
from mcap.reader import make_reader
from places import SIMULATED

from topo_region_seg import Params, Pipeline, PointClass, __version__
from topo_region_seg.cloud.stamp import stamp_of
from topo_region_seg.offline.bags import BagError, BagWriter, open_bag
from topo_region_seg.offline.bags.attachments import read_attachment
from topo_region_seg.offline.bags.clouds import POINT_CLOUD, cloud_topic, decode_message
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.runs.record import MEDIA_TYPE, RECORD_NAME, RunRecord
from topo_region_seg.offline.runs.run import open_run
from topo_region_seg.offline.runs.truth import quality, truth_of_run
from topo_region_seg.offline.sensor_figures import sensor_figures

SIM = SIMULATED


@pytest.fixture(scope="module")
def sim_run(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    assert main(["replay", str(SIM), "-o", str(path), "--json", str(path.with_suffix(".json")), "--all"]) == 0
    return path


def stamps_in(bag):
    with open_bag(bag) as reader:
        topic = cloud_topic(reader)
        return [stamp_of(decode_message(record, topic)) for record in reader.messages([topic.name])]


def test_a_replay_says_in_its_recording_how_it_came_about(sim_run):
    with sim_run.open("rb") as file:  # as any reader of MCAP finds it
        attachments = {a.name: a for a in make_reader(file).iter_attachments()}
    assert attachments[RECORD_NAME].media_type == MEDIA_TYPE
    record = json.loads(attachments[RECORD_NAME].data)
    summary = json.loads(sim_run.with_suffix(".json").read_text())
    for part in ("frames", "truncated", "params"):
        assert record[part] == summary[part]
    assert record["rejected"] == [] and 0.003 < record["sensor"]["pixel_rad"] < 0.005
    assert (record["source"], record["topic"]) == (str(SIM.resolve()), "/camera/depth/points")
    assert record["versions"]["topo_region_seg"] == __version__
    assert record["versions"]["numpy"] == np.__version__


def test_the_record_tells_the_camera_and_what_became_of_the_points(sim_run):
    run = open_run(sim_run)
    given = next(iter(run.frames()))
    seg = Pipeline(run.params).run(given.cloud)
    names = [PointClass(number).name.lower() for number in seg.point_classes]
    assert run.record.frames[0].classes == dict(Counter(names)) and "support" in names
    assert run.record.sensor == sensor_figures(given.cloud)
    assert RunRecord.from_json(run.record.to_json()) == run.record
    older = json.loads(run.record.to_json())
    del older["sensor"], older["frames"][0]["classes"]
    read = RunRecord.from_json(json.dumps(older))
    assert read.sensor is None and read.frames[0].classes == {}
    for broken in ({"sensor": 1}, {"sensor": {"noise": [1]}}, {"sensor": {"pixel_rad": "x", "valid": 1, "noise": []}}):
        with pytest.raises(ValueError, match=r"is .*, not a"):
            RunRecord.from_json(json.dumps(older | broken))


def test_a_run_gives_the_recorded_clouds_in_order(sim_run):
    run = open_run(sim_run)
    frames = list(run.frames())
    assert [stamp_of(frame.msg) for frame in frames] == stamps_in(SIM)
    assert [frame.index for frame in frames] == list(range(6))
    for frame in frames:
        assert len(frame.labels) == len(frame.cloud) == frame.record.points == 76_800
        assert frame.labels.max() == frame.record.regions
    assert [frame.index for frame in run.frames({1, 4})] == [1, 4]
    assert run.params == Params() and run.problems == []


def test_folders_carry_the_record_too(tmp_path):
    bag = write_mcap(tmp_path / "in.mcap", [*cloud_entries(2), count_entry()])
    main(["replay", str(bag), "-o", str(tmp_path / "out")])
    assert [frame.index for frame in open_run(tmp_path / "out").frames()] == [0, 1]


def test_rejected_clouds_are_in_the_record_with_their_reason(tmp_path):
    bag = write_mcap(tmp_path / "in.mcap", cloud_entries(3))
    assert main(["replay", str(bag), "-o", str(tmp_path / "out.mcap"), "--set", "max_points=10"]) == 1
    record = open_run(tmp_path / "out.mcap").record
    assert record.frames == []
    assert [entry.reason for entry in record.rejected] == ["too_many_points"] * 3
    assert "allow 10; raise max_points" in record.rejected[0].detail


def test_truth_comes_from_where_the_run_was_made(sim_run):
    run = open_run(sim_run)
    truth = truth_of_run(run)
    assert truth and len(truth) == 6
    frame = next(run.frames())
    labels = truth.of(frame)
    assert labels is not None and labels.max() > 1
    found, perfect = quality(frame, labels), quality(dataclasses.replace(frame, labels=labels), labels)
    assert found and perfect and found["wov"] is not None
    assert perfect["wov"] == 1.0
    height, width = frame.cloud.height, frame.cloud.width
    independent = quality_oracle.measures(labels, frame.labels, frame.valid, height, width)
    assert found["wov"] == pytest.approx(independent["wov"], abs=1e-9)
    with pytest.raises(BagError, match="has no truth on /nowhere"):
        truth_of_run(run, truth_topic="/nowhere")


def test_without_the_source_there_is_no_truth(sim_run):
    run = open_run(sim_run)
    run.record = RunRecord.from_json(run.record.to_json().replace(str(SIM.resolve()), "/gone"))
    assert truth_of_run(run) is None
    assert truth_of_run(run, SIM) is not None


def with_record(path, text):
    with BagWriter(path) as writer:
        writer.add_topic("/labeled_points", POINT_CLOUD)
        writer.attach(RECORD_NAME, MEDIA_TYPE, text.encode())
    return path


@pytest.mark.parametrize(
    "change",
    [
        lambda record: [],
        lambda record: {**record, "format": 2},
        lambda record: {**record, "format": True},
        lambda record: {**record, "frames": [{"stamp": "now"}]},
        lambda record: {**record, "frames": [{"stamp": 1, "points": 1, "regions": 1, "ms": {"total": None}}]},
        lambda record: {**record, "params": {"max_radius": -1}},
        lambda record: {**record, "params": {"no_such": 1}},
        lambda record: {**record, "rejected": [{"stamp": 1, "reason": 5, "detail": ""}]},
        lambda record: {key: value for key, value in record.items() if key != "versions"},
    ],
)
def test_a_record_that_makes_no_sense_is_one_clear_error(sim_run, tmp_path, change):
    record = json.loads(open_run(sim_run).record.to_json())
    path = with_record(tmp_path / "odd.mcap", json.dumps(change(record)))
    with pytest.raises(BagError, match=r"odd\.mcap: its 'topo_region_seg/run' cannot be read .*replay the bag again"):
        open_run(path)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, '"\\ud800"', "{}", "NaN"])
def test_a_record_that_is_no_json_is_one_clear_error(tmp_path, text):
    with pytest.raises(BagError, match="cannot be read"):
        open_run(with_record(tmp_path / "odd.mcap", text))


def test_recordings_without_a_record_are_refused(tmp_path):
    with pytest.raises(BagError, match="was not written by replay"):
        open_run(SIM)
    with BagWriter(tmp_path / "old.mcap") as writer:
        writer.add_topic("/labeled_points", POINT_CLOUD)
        with open_bag(SIM) as reader:
            for record in reader.messages(["/camera/depth/points"]):
                writer.write("/labeled_points", record.log_time, record.data)
    assert read_attachment(tmp_path / "old.mcap", RECORD_NAME) is None
    with pytest.raises(BagError, match="older version"):
        open_run(tmp_path / "old.mcap")


def test_a_source_whose_clouds_cannot_be_read_has_no_truth(tmp_path):
    entries = cloud_entries(2)
    source = write_mcap(tmp_path / "in.mcap", entries)
    out = tmp_path / "out.mcap"
    assert main(["replay", str(source), "-o", str(out)]) == 0
    assert truth_of_run(open_run(out)) is None, "its clouds carry no labels"
    garbage = write_mcap(tmp_path / "garbage.mcap", [(*entry[:3], b"\0\1\0\0") for entry in entries])
    assert truth_of_run(open_run(out), garbage) is None
