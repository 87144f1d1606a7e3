# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `evaluate`: its figures against an independent program, and what it does with recordings as they are."""

from __future__ import annotations

import csv
import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest
import quality_oracle
from bag_maker import CLOUD, SECOND, chunks_of, damage, write_mcap
from clouds import TYPES
from places import ROOT
from rosbags.highlevel import AnyReader

import topo_region_seg as trs
from topo_region_seg.cloud.pointcloud2 import encode
from topo_region_seg.offline.bags.types import bag_types
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.evaluation import DETECTION, LEAKAGE, MEASURES, SEGMENTATION
from topo_region_seg.offline.evaluation.labels import labels_of
from topo_region_seg.offline.evaluation.measures import NEEDS_ALL_OBJECTS
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.recording import CLOUD_TOPIC, TRUTH_TOPIC, camera_cloud, make_header

SIMULATED = ROOT / "bags" / "tabletop_sim"
LABELLED = ROOT.parent / "shared" / "data" / "bags" / "tabletop_labelled"
COARSE = ["--set", "normal_radius=0.04", "--set", "max_radius=0.06", "--set", "min_region_size=8"]


def run(*arguments, status=0):
    assert main(["evaluate", *map(str, arguments)]) == status


def evaluated(tmp_path, *arguments, status=0):
    run(*arguments, "--json", tmp_path / "found.json", status=status)
    text = (tmp_path / "found.json").read_text()
    assert "NaN" not in text
    return json.loads(text)


@pytest.fixture(scope="module")
def frames():
    scene = tabletop(1)
    return [simulate(scene, Camera.kinect(80, 60), seed) for seed in range(3)]


def truth_message(frame, labels, stamp, kind="u4"):
    cloud = frame.cloud
    return encode(
        bag_types(),
        make_header(stamp, "camera"),
        {"label": labels.astype(kind)},
        height=cloud.height,
        width=cloud.width,
        is_dense=True,
    )


def entries(frames, truths=None, topic=TRUTH_TOPIC):
    """Clouds and truth at whole seconds; `truths` says which frames have truth."""
    found = []
    for number, frame in enumerate(frames):
        stamp = (number + 1) * SECOND
        found.append((CLOUD_TOPIC, CLOUD, stamp, camera_cloud(make_header(stamp, "camera"), frame.cloud)))
        if truths is None or number in truths:
            found.append((topic, CLOUD, stamp, truth_message(frame, frame.labels, stamp)))
    return found


@pytest.fixture
def bag(frames, tmp_path):
    return write_mcap(tmp_path / "in.mcap", entries(frames))


def columns(data, step, *fields):
    rows = np.asarray(data).reshape(-1, step)
    return [rows[:, start : start + np.dtype(kind).itemsize].copy().view(kind)[:, 0] for start, kind in fields]


@pytest.mark.parametrize(
    "path",
    [
        SIMULATED,
        pytest.param(
            LABELLED,
            marks=pytest.mark.skipif(not LABELLED.is_dir(), reason="the recordings of ../shared/data are not here"),
        ),
    ],
    ids=lambda path: path.name,
)
def test_an_independent_program_finds_the_same(path, tmp_path) -> None:
    """Another reader, another decoder, other measures; only `segment` is the package's."""
    found = evaluated(tmp_path, path)
    with AnyReader([path]) as reader:
        read = {(m.header.stamp.sec, m.header.stamp.nanosec, c.topic): m for c, _, m in messages(reader)}
    wanted = []
    for (sec, nanosec, topic), msg in sorted(read.items()):
        if topic != CLOUD_TOPIC:
            continue
        x, y, z, b, g, r = columns(msg.data, 32, (0, "<f4"), (4, "<f4"), (8, "<f4"), (16, "u1"), (17, "u1"), (18, "u1"))
        (truth,) = columns(read[sec, nanosec, TRUTH_TOPIC].data, 4, (0, "<u4"))
        xyz = np.column_stack([x, y, z])
        labels = trs.segment(xyz, np.column_stack([r, g, b])).labels
        valid = ~np.isnan(xyz.sum(axis=1))
        wanted.append(quality_oracle.measures(truth, labels, valid, msg.height, msg.width))
    assert len(found["frames"]) == len(wanted) == len(read) // 2
    for frame, expected in zip(found["frames"], wanted, strict=True):
        assert {name: frame[name] for name in MEASURES} == pytest.approx(expected, abs=1e-6)
    for name in MEASURES:
        assert found["mean"][name] == pytest.approx(np.mean([frame[name] for frame in wanted]), abs=1e-6)


def messages(reader):
    for connection, time, data in reader.messages():
        yield connection, time, reader.deserialize(data, connection.msgtype)


def test_results_for_people_and_machines(bag, tmp_path, capsys) -> None:
    found = evaluated(tmp_path, bag, "--csv", tmp_path / "found.csv", *COARSE)
    shown = capsys.readouterr()
    assert shown.err == ""
    assert "WOv" in shown.out and "mean over frames" in shown.out and f"{found['mean']['wov']:.3f}" in shown.out
    assert set(found["mean"]) == set(MEASURES)
    assert (found["without_truth"], found["rejected"], found["truncated"]) == (0, [], False)
    assert found["params"] == trs.Params(normal_radius=0.04, max_radius=0.06, min_region_size=8).as_dict()
    assert found["version"].startswith(trs.__version__ + "+")
    assert [frame["stamp"] for frame in found["frames"]] == [1.0, 2.0, 3.0]
    assert all(
        frame["bag"] == str(bag) and frame["ms"]["total"] > frame["ms"]["filtration"] for frame in found["frames"]
    )
    (summary,) = found["bags"]
    assert (summary["frames"], summary["topic"], summary["truth"]) == (3, CLOUD_TOPIC, TRUTH_TOPIC)
    assert summary["mean"] == found["mean"]
    rows = list(csv.DictReader((tmp_path / "found.csv").open()))
    assert [float(row["wov"]) for row in rows] == [frame["wov"] for frame in found["frames"]]


def test_frames_without_truth_are_counted_and_said(frames, tmp_path, capsys) -> None:
    bag = write_mcap(tmp_path / "in.mcap", entries(frames, truths=[1]))
    found = evaluated(tmp_path, bag, *COARSE)
    assert found["without_truth"] == found["bags"][0]["without_truth"] == 2
    assert [frame["stamp"] for frame in found["frames"]] == [2.0]
    assert "2 of 3 clouds" in capsys.readouterr().err


def test_a_recording_without_any_truth_has_failed(frames, tmp_path, capsys) -> None:
    bag = write_mcap(tmp_path / "in.mcap", entries(frames, truths=[]))
    found = evaluated(tmp_path, bag, status=1)
    assert found["without_truth"] == 3 and found["mean"] == dict.fromkeys(MEASURES)
    assert "none of its 3 clouds has truth" in found["bags"][0]["error"]
    assert "failed: " in capsys.readouterr().err


def test_truth_is_matched_by_stamp_not_by_order(frames, tmp_path, bag) -> None:
    clouds = entries(frames, truths=[])
    truths = [entry for entry in entries(frames) if entry[0] == TRUTH_TOPIC]
    late = [(topic, kind, 9 * SECOND - time, message) for topic, kind, time, message in truths]
    mixed = write_mcap(tmp_path / "mixed.mcap", clouds + late)
    assert without_ms(evaluated(tmp_path, mixed, *COARSE)) == without_ms(evaluated(tmp_path, bag, *COARSE))


def test_truth_of_another_topic_or_another_recording(frames, tmp_path, bag) -> None:
    wanted = without_ms(evaluated(tmp_path, bag, *COARSE))
    other = write_mcap(tmp_path / "other.mcap", entries(frames, topic="/annotation"))
    assert without_ms(evaluated(tmp_path, other, "--truth-topic", "annotation", *COARSE)) == wanted
    bare = write_mcap(tmp_path / "bare.mcap", entries(frames, truths=[]))
    assert without_ms(evaluated(tmp_path, bare, "--truth-bag", bag, *COARSE)) == wanted


@pytest.mark.parametrize("kind", ["u1", "i4"])
def test_truth_in_the_clouds_own_field(frames, tmp_path, bag, kind) -> None:
    carried = []
    for number, frame in enumerate(frames):
        stamp = (number + 1) * SECOND
        message = camera_cloud(make_header(stamp, "camera"), frame.cloud)
        points = np.asarray(message.data).reshape(-1, 32).copy()
        labels = frame.labels.astype(int)
        if kind == "i4":
            labels[labels == 0] = -1  # "unknown" of some annotation programs
        size = np.dtype(kind).itemsize
        points[:, 24 : 24 + size] = labels.astype(kind).view(np.uint8).reshape(-1, size)
        message.data = points.reshape(-1)
        message.fields.append(TYPES.PointField(name="label", offset=24, datatype={"u1": 2, "i4": 5}[kind], count=1))
        carried.append(("/labelled", CLOUD, stamp, message))
    own = write_mcap(tmp_path / "own.mcap", carried)
    assert without_ms(evaluated(tmp_path, own, *COARSE)) == without_ms(evaluated(tmp_path, bag, *COARSE))


def test_labels_that_were_recorded_are_measured_as_they_are(tmp_path, bag) -> None:
    wanted = evaluated(tmp_path, bag, *COARSE)
    assert main(["replay", str(bag), "-o", str(tmp_path / "out.mcap"), *COARSE]) == 0
    found = evaluated(tmp_path, tmp_path / "out.mcap", "--recorded-labels", "--truth-bag", bag)
    assert without_ms(found) == without_ms(wanted)
    assert found["bags"][0]["topic"] == "/labeled_points"


def without_ms(found):
    return [{k: v for k, v in frame.items() if k not in ("ms", "bag")} for frame in found["frames"]]


def test_frames_that_cannot_be_measured_are_named_and_the_rest_is_done(frames, tmp_path, capsys) -> None:
    made = entries(frames)
    made[1] = (TRUTH_TOPIC, CLOUD, SECOND, truth_message(frames[0], frames[0].labels.astype(np.float32), SECOND, "f4"))
    made[2][3].data = made[2][3].data[:-1]
    short = make_header(3 * SECOND, "camera")
    made[5] = (TRUTH_TOPIC, CLOUD, 3 * SECOND, encode(bag_types(), short, {"label": np.ones(7, "u4")}, is_dense=True))
    found = evaluated(tmp_path, write_mcap(tmp_path / "in.mcap", made), *COARSE, status=1)
    assert [(r["stamp"], r["reason"]) for r in found["rejected"]] == [
        (1.0, "label_type"),
        (2.0, "data_too_short"),
        (3.0, "truth_size"),
    ]
    assert found["without_truth"] == 1 and found["frames"] == []
    assert capsys.readouterr().err.count("rejected: ") == 3


def test_a_recording_that_is_cut_short_or_damaged(frames, tmp_path, capsys) -> None:
    bag = write_mcap(tmp_path / "in.mcap", entries(frames))
    whole = bag.read_bytes()
    bag.write_bytes(whole[: chunks_of(bag)[3][1] + 20])
    found = evaluated(tmp_path, bag, *COARSE, status=3)
    assert found["truncated"] and len(found["frames"]) == 2
    assert "is cut short" in capsys.readouterr().err
    bag.write_bytes(whole)
    damage(bag, sum(chunks_of(bag)[2]) // 2)
    found = evaluated(tmp_path, bag, *COARSE, status=1)
    assert len(found["frames"]) == 2 and len(found["bags"][0]["problems"]) == 1


def test_folders_are_searched_and_recordings_that_fail_are_named(frames, tmp_path, capsys) -> None:
    folder = tmp_path / "all"
    (folder / "day").mkdir(parents=True)
    write_mcap(folder / "b.mcap", entries(frames))
    write_mcap(folder / "day" / "a.mcap", entries(frames[:1]))
    (folder / "broken.mcap").write_bytes(b"no recording")
    (folder / ".hidden.mcap").write_bytes(b"")
    (folder / "notes.txt").write_text("")
    found = evaluated(tmp_path, folder, folder / "b.mcap", *COARSE, status=1)
    assert [Path(b["bag"]).name for b in found["bags"]] == ["b.mcap", "broken.mcap", "a.mcap"]
    assert [b["frames"] for b in found["bags"]] == [3, 0, 1]
    assert len(found["frames"]) == 4
    assert "failed: " in capsys.readouterr().err
    # Means are over frames, not over recordings.
    assert found["mean"]["wov"] == pytest.approx(np.mean([frame["wov"] for frame in found["frames"]]))


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["missing"], "no such file"),
        ([ROOT / "docs"], "no recording in this folder or below"),
        ([SIMULATED, "--truth-topic", "/typo"], "has no truth on /typo"),
        ([SIMULATED, "--truth-bag", "missing"], "no such file"),
        ([SIMULATED, "--recorded-labels", "--truth-topic", "/typo"], "has no truth on /typo"),
        ([SIMULATED, "--topic", "/typo"], "has no topic /typo"),
        ([SIMULATED, "--workers", "0"], "not a number from 1"),
        ([SIMULATED, "--workers", "2", "--scheduler", "tcp://x:1"], "not allowed with"),
        ([SIMULATED, "--json", "missing/found.json"], "missing or not writable"),
        ([ROOT / "README.md"], "is no recording"),
    ],
)
def test_wrong_usage_is_one_line(arguments, why, capsys) -> None:
    run(*arguments, status=2)
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and why in err


def test_without_dask_the_option_says_what_to_install(monkeypatch, capsys) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    run(SIMULATED, "--workers", "2", status=2)
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "pip install '.[dask]'" in err


def test_the_example_in_the_documentation_is_what_is_found(tmp_path) -> None:
    text = (ROOT / "docs" / "evaluation.md").read_text(encoding="utf-8")
    shown = text.partition("<!-- evaluation:")[2].partition("<!-- end of evaluation -->")[0]
    lines = [line for line in shown.splitlines() if line.startswith(" mean over frames")]
    found = evaluated(tmp_path, SIMULATED)
    for line, measures in zip(lines, (SEGMENTATION, DETECTION, LEAKAGE), strict=True):
        values = [f"{found['mean'][name]:.3f}" for name in measures]
        assert line.split()[3:-1] == ["6", "0", "0", *values], "run: make docs"


def test_whole_objects_and_partial_truth(tmp_path, capsys) -> None:
    parts, whole = evaluated(tmp_path, SIMULATED), evaluated(tmp_path, SIMULATED, "--whole-objects")
    with AnyReader([SIMULATED]) as reader:
        truths = [msg for connection, _, msg in messages(reader) if connection.topic == TRUTH_TOPIC]
    for before, after, msg in zip(parts["frames"], whole["frames"], truths, strict=True):
        (truth,) = columns(msg.data, 4, (0, "<u4"))
        objects = {label // 10 for label in truth.tolist() if label >= 20}
        assert after["recall_50"] * len(objects) == pytest.approx(round(after["recall_50"] * len(objects)))
        assert after["wov"] < before["wov"]  # regions are the parts of objects
    capsys.readouterr()
    partial = evaluated(tmp_path, SIMULATED, "--partial-truth")
    shown = capsys.readouterr().out
    for name, value in parts["mean"].items():
        assert partial["mean"][name] == (None if name in NEEDS_ALL_OBJECTS else value)
    rows = [line.split() for line in shown.splitlines() if line.startswith(" mean over frames")]
    assert rows[1].count("n/a") == len(set(NEEDS_ALL_OBJECTS) & set(DETECTION))


def test_parameters_without_effect_are_named_once(frames, tmp_path, capsys, recwarn) -> None:
    bag = write_mcap(tmp_path / "in.mcap", entries(frames))
    settings = [*COARSE, "--set", "features=normals", "--set", "color_threshold=3"]
    run(bag, bag, *settings)
    said = capsys.readouterr().err
    assert said.count("(no_effect)") == 1 and "color_threshold = 3" in said
    assert [str(warning.message) for warning in recwarn if "no_effect" in str(warning.message)] == []


@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2", "i4", "u4"])
@pytest.mark.parametrize("big_endian", [False, True])
def test_labels_are_read_in_the_byte_order_of_their_message(kind, big_endian):
    """Negative ones are none."""
    labels = np.array([0, 1, 2, 100, 3, 4], kind)
    if kind.startswith("i"):
        labels[4] = -3
    msg = encode(bag_types(), make_header(SECOND, "camera"), {"label": labels}, height=2, is_dense=True)
    if big_endian:
        swapped = labels.astype(labels.dtype.newbyteorder(">"))
        msg = dataclasses.replace(msg, is_bigendian=True, data=np.frombuffer(swapped.tobytes(), np.uint8))
    np.testing.assert_array_equal(labels_of(msg, max_points=10), np.maximum(labels, 0))
