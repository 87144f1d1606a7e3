# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from bag_maker import chunks_of, cloud_entries, count_entry, damage, write_mcap, write_ros1
from clouds import TYPES, scene
from places import ROOT, SHARED

from topo_region_seg import Params, Pipeline, __version__
from topo_region_seg.cloud.files import read_cloud, write_labeled_cloud
from topo_region_seg.cloud.messages.topics import OUTPUTS
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import decode_message
from topo_region_seg.offline.bags.types import typestore
from topo_region_seg.offline.cli.evaluation_tables import bag_table, frame_table
from topo_region_seg.offline.cli.main import COMMANDS, build_parser, main
from topo_region_seg.offline.evaluation.measures import MEASURES
from topo_region_seg.offline.evaluation.results import BagResult

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="the recordings of ../shared/data are not here")
SMALL = ["--set", "normal_radius=0.02", "--set", "min_region_size=100"]


@pytest.fixture
def bag(tmp_path):
    return write_mcap(tmp_path / "in.mcap", [*cloud_entries(3), count_entry()])


@pytest.fixture
def cloud_file(tmp_path):
    xyz, rgb = scene()
    path = tmp_path / "in.pcd"
    write_labeled_cloud(path, Cloud(xyz, rgb, 48, 64), np.zeros(len(xyz), np.uint32))
    return path


def run(*arguments, status=0):
    assert main([str(argument) for argument in arguments]) == status


def error_line(capsys, *arguments, status=2):
    run(*arguments, status=status)
    err = capsys.readouterr().err
    assert err.count("\n") == 1, err
    return err


def clouds_of(path, topic):
    with open_bag(path) as reader:
        found = next(t for t in reader.topics if t.name == topic)
        return [(r.log_time, decode_message(r, found)) for r in reader.messages([topic])]


# --- the command line ---


def test_version_and_list_of_commands(capsys):
    run("--version")
    assert __version__ in capsys.readouterr().out
    run("--help")
    shown = capsys.readouterr().out
    assert all(command in shown for command in COMMANDS)
    run(status=2)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_each_command(command, capsys):
    run(command, "--help")
    assert "usage: topo_region_seg " + command in capsys.readouterr().out


def test_help_lists_every_parameter(capsys):
    run("segment", "--help")
    shown = capsys.readouterr().out
    assert all(f"  {row.name} = " in shown for row in Params.table())


def test_wrong_usage_is_one_line(capsys):
    assert "invalid choice: 'sgment'" in error_line(capsys, "sgment")
    assert "required: BAG" in error_line(capsys, "replay")
    assert "--rate: 0 is not greater than 0" in error_line(capsys, "play", "x", "--rate", "0")


def test_debug_shows_the_traceback(capsys):
    for arguments in (["--debug", "replay", "missing"], ["replay", "missing", "--debug"]):
        run(*arguments, status=2)
        assert "Traceback" in capsys.readouterr().err


def test_errors_that_nobody_expects_are_one_line_too(cloud_file, capsys, monkeypatch):
    def broken(*_, **__):
        raise KeyError("two\nlines")

    monkeypatch.setattr("topo_region_seg.cloud.files.read_cloud", broken)
    line = error_line(capsys, "segment", cloud_file, status=1)
    assert "internal error: KeyError" in line and "--debug" in line


# --- parameters ---


@pytest.mark.parametrize(
    ("assignments", "why"),
    [
        (["max_radus=0.01"], "did you mean max_radius?"),
        (["max_radius"], "write --set NAME=VALUE"),
        (["max_radius=-1"], "must be at least"),
        (["max_radius=nan"], "finite"),
        (["max_radius=far"], "must be a number"),
        (["filtration_steps=2.5"], "whole number"),
        (["features=texture"], "color+normals, color, normals"),
        (["remove_floor=maybe"], "true or false"),
        (["crop_box=1,2,3"], "must have 0 or 6 numbers"),
        (["min_range=5", "max_range=2"], "greater than max_range"),
    ],
)
def test_parameters_out_of_order(assignments, why, capsys):
    arguments = [part for text in assignments for part in ("--set", text)]
    assert why in error_line(capsys, "segment", "any.pcd", *arguments)


FILES = {
    "plain": "max_radius: 0.03\nremove_floor: false\ncrop_box: [-1, -1, 0, 1, 1, 2]\n",
    "ROS": "/**:\n  ros__parameters:\n    max_radius: 0.03\n    remove_floor: false\n"
    "    crop_box: [-1, -1, 0, 1, 1, 2]\n    autostart: false\n    use_sim_time: true\n",
}


@pytest.mark.parametrize("kind", FILES)
def test_parameter_files_and_assignments(kind, bag, tmp_path):
    file = tmp_path / "p.yaml"
    file.write_text(FILES[kind])
    run(
        "replay",
        bag,
        "--params",
        file,
        "--set",
        "max_radius=1e-2",
        "--set",
        "features=color",
        "--json",
        tmp_path / "s.json",
    )
    wanted = Params(max_radius=0.01, remove_floor=False, crop_box=(-1, -1, 0, 1, 1, 2), features="color")
    assert json.loads((tmp_path / "s.json").read_text())["params"] == wanted.as_dict()


def test_the_shipped_parameter_file_holds_the_defaults(bag, tmp_path):
    shipped = ROOT / "config" / "region_segmentation.yaml"
    run("replay", bag, "--params", shipped, "--json", tmp_path / "s.json")
    assert json.loads((tmp_path / "s.json").read_text())["params"] == Params().as_dict()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (None, "cannot be read"),
        ("a: [", "is not YAML"),
        ("- 1", "holds no names and values"),
        ("max_radus: 1", "did you mean max_radius?"),
        ("max_radius: far", "must be a number"),
        ("a: {ros__parameters: {}}\nb: {ros__parameters: {}}", "parameters of 2 nodes"),
    ],
)
def test_damaged_parameter_files(text, why, tmp_path, capsys):
    file = tmp_path / "p.yaml"
    if text is not None:
        file.write_text(text)
    line = error_line(capsys, "segment", "any.pcd", "--params", file)
    assert why in line and str(file) in line


# --- segment ---


def test_segment_prints_and_writes(cloud_file, tmp_path, capsys):
    outputs = [tmp_path / name for name in ("out.ply", "barcode.png", "picture.png")]
    run(
        "segment",
        cloud_file,
        "-o",
        outputs[0],
        "--barcode",
        outputs[1],
        "--picture",
        outputs[2],
        "--set",
        "features=color",
    )
    shown = capsys.readouterr().out
    assert "3,072 points" in shown and "2 regions" in shown
    assert "#c81e1e" in shown and "#1e1ec8" in shown  # the mean colors
    assert all(f"wrote {path}" in shown for path in outputs)
    assert outputs[1].read_bytes().startswith(b"\x89PNG") and outputs[2].read_bytes().startswith(b"\x89PNG")
    assert len(read_cloud(outputs[0], max_points=10**6)) == 3072


def test_segment_without_color(tmp_path, capsys):
    xyz, _ = scene()
    path = tmp_path / "gray.ply"
    write_labeled_cloud(path, Cloud(xyz, None, 1, len(xyz)), np.zeros(len(xyz), np.uint32))
    assert "set features to 'normals'" in error_line(capsys, "segment", path)
    run("segment", path, "--set", "features=normals", *SMALL)
    assert "mean color" not in capsys.readouterr().out


def test_segment_names_the_right_command_for_a_recording(bag, tmp_path, capsys):
    assert f"replay {bag}" in error_line(capsys, "segment", bag)
    assert f"replay {tmp_path}" in error_line(capsys, "segment", tmp_path)


@pytest.mark.parametrize(
    ("flag", "name"),
    [("-o", "missing/a.pcd"), ("-o", "a.txt"), ("--barcode", "a.txt"), ("--picture", "missing/a.png")],
)
def test_segment_checks_its_outputs_first(flag, name, cloud_file, tmp_path, capsys):
    error_line(capsys, "segment", cloud_file, flag, tmp_path / name)


# --- replay ---


@pytest.mark.parametrize("name", ["out.mcap", "out"])
def test_replay_is_the_pipeline_frame_by_frame(name, bag, tmp_path, capsys):
    out, summary = tmp_path / name, tmp_path / "s.json"
    run("replay", bag, "-o", out, "--json", summary, *SMALL)
    captured = capsys.readouterr()
    assert captured.err == ""
    assert "3 clouds segmented" in captured.out and f"wrote {out}" in captured.out

    pipeline = Pipeline(Params(normal_radius=0.02, min_region_size=100))
    inputs, labeled = clouds_of(bag, "/camera/points"), clouds_of(out, "/labeled_points")
    found = json.loads(summary.read_text())
    assert set(found) == {"frames", "rejected", "truncated", "params"}
    assert (found["rejected"], found["truncated"]) == ([], False)
    assert len(inputs) == len(labeled) == len(found["frames"]) == 3
    for (time_in, given), (time_out, result), frame in zip(inputs, labeled, found["frames"], strict=True):
        cloud = decode(given, max_points=10**6)
        seg = pipeline.run(cloud)
        assert time_in == time_out
        assert result.header == given.header
        assert (result.height, result.width) == (given.height, given.width)
        labels = np.asarray(result.data).reshape(-1, 20)[:, 16:].copy().view("<u4")[:, 0]
        np.testing.assert_array_equal(labels, seg.labels)
        assert set(frame) == {"stamp", "points", "regions", "ms", "cpu_ms", "classes"}
        assert (frame["stamp"], frame["points"], frame["regions"]) == (
            given.header.stamp.sec + 2e-9,
            768,
            len(seg.regions),
        )
        assert set(frame["ms"]) >= {"total", "filtration", "normals"} and list(frame["cpu_ms"]) == list(frame["ms"])
        assert all(0.0 <= spent <= frame["cpu_ms"]["total"] for spent in frame["cpu_ms"].values())
    with open_bag(out) as reader:
        assert [topic.name for topic in reader.topics] == ["/labeled_points", "/region_count"]


def test_replay_writes_the_rest_on_request(bag, tmp_path):
    out = tmp_path / "out.mcap"
    run("replay", bag, "-o", out, "--all", "--with-input", *SMALL)
    with open_bag(out) as reader:
        names = ("/camera/points", *(f"/{output.name}" for output in OUTPUTS))
        assert {topic.name: topic.count for topic in reader.topics} == dict.fromkeys(names, 3)
    # The labeled cloud is passed over, so that the recording can be replayed again.
    run("replay", out, *SMALL)


def test_replay_writes_the_topics_that_are_named(bag, tmp_path, capsys):
    out = tmp_path / "out.mcap"
    run("replay", bag, "-o", out, "--also", "detections,/surfaces", "--also", "label_image", *SMALL)
    with open_bag(out) as reader:
        kinds = {topic.name: topic.type for topic in reader.topics}
        assert kinds == {
            "/labeled_points": "sensor_msgs/msg/PointCloud2",
            "/region_count": "std_msgs/msg/UInt32",
            "/detections": "vision_msgs/msg/Detection3DArray",
            "/surfaces": "vision_msgs/msg/Detection3DArray",
            "/label_image": "sensor_msgs/msg/Image",
        }
        record = next(iter(reader.messages(["/detections"])))
        found = typestore().deserialize_cdr(record.data, record.type)
    labels = [detection.id for detection in found.detections]
    assert labels == [str(number + 1) for number in range(len(labels))] and labels
    run("replay", bag, "-o", tmp_path / "b.mcap", "--also", "detection", status=2)
    assert "--also detection: no such output; choose from regions, barcode, " in capsys.readouterr().err


def test_replay_of_a_ros1_bag_gives_the_same_labels(bag, tmp_path):
    ros1 = write_ros1(tmp_path / "in.bag", cloud_entries(3))
    run("replay", bag, "-o", tmp_path / "a.mcap", *SMALL)
    run("replay", ros1, "-o", tmp_path / "b.mcap", *SMALL)
    a, b = (clouds_of(tmp_path / name, "/labeled_points") for name in ("a.mcap", "b.mcap"))
    assert [time for time, _ in a] == [time for time, _ in b]
    for (_, left), (_, right) in zip(a, b, strict=True):
        assert left.header == right.header
        np.testing.assert_array_equal(left.data, right.data)


def test_replay_goes_on_after_bad_frames(tmp_path, capsys):
    entries = cloud_entries(4)
    entries[0][3].data = entries[0][3].data[:-1]
    entries[1] = (*entries[1][:3], b"\0\1\0\0\xff")
    entries[2][3].fields[3] = TYPES.PointField(name="intensity", offset=16, datatype=7, count=1)
    path, summary = write_mcap(tmp_path / "in.mcap", entries), tmp_path / "s.json"
    run("replay", path, "-o", tmp_path / "out.mcap", "--json", summary, status=1)
    assert "3 rejected" in capsys.readouterr().out
    found = json.loads(summary.read_text())
    assert [(r["stamp"], r["reason"]) for r in found["rejected"]] == [
        (1 + 2e-9, "data_too_short"),
        (2.0, "undecodable"),
        (3 + 2e-9, "missing_color"),
    ]
    assert len(found["frames"]) == 1 and len(clouds_of(tmp_path / "out.mcap", "/labeled_points")) == 1


def test_replay_goes_on_after_an_error_in_a_frame(bag, tmp_path, monkeypatch, capsys):
    original, calls = Pipeline.run, []

    def sometimes(self, cloud, *more):
        calls.extend([1] * (cloud.width == 32))  # the clouds of the warm-up have other sizes
        if cloud.width == 32 and len(calls) == 2:
            raise RuntimeError("broken")
        return original(self, cloud, *more)

    monkeypatch.setattr(Pipeline, "run", sometimes)
    run("replay", bag, "--json", tmp_path / "s.json", status=1)
    assert "RuntimeError: broken (internal_error)" in capsys.readouterr().err
    assert len(json.loads((tmp_path / "s.json").read_text())["frames"]) == 2


def test_replay_of_a_cut_recording(bag, tmp_path, capsys):
    bag.write_bytes(bag.read_bytes()[: chunks_of(bag)[1][1] + 30])
    run("replay", bag, "-o", tmp_path / "out.mcap", "--json", tmp_path / "s.json", status=3)
    assert "is cut short" in capsys.readouterr().err
    found = json.loads((tmp_path / "s.json").read_text())
    assert found["truncated"] is True and len(found["frames"]) == 2
    assert len(clouds_of(tmp_path / "out.mcap", "/labeled_points")) == 2


def test_replay_of_a_damaged_recording(bag, capsys):
    damage(bag, sum(chunks_of(bag)[1]) // 2)
    run("replay", bag, status=1)
    captured = capsys.readouterr()
    assert "2 clouds segmented" in captured.out and "1 message lost" in captured.err


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (lambda path: path / "missing", "no such file"),
        (lambda path: path, "no recording in this folder"),
        (lambda path: write_mcap(path / "a.mcap", [count_entry()]), "has no clouds"),
        (
            lambda path: write_mcap(path / "a.mcap", cloud_entries(1, "/a") + cloud_entries(1, "/b")),
            "--topic /a, --topic /b",
        ),
    ],
)
@pytest.mark.parametrize("command", ["replay", "play"])
def test_recordings_that_cannot_be_used(command, make, why, tmp_path, capsys):
    assert why in error_line(capsys, command, make(tmp_path))


def test_replay_refuses_outputs_before_the_work(bag, tmp_path, capsys):
    (tmp_path / "folder").mkdir()
    for arguments, why in (
        (["-o", bag], "is the recording that is read"),
        (["-o", tmp_path / "folder"], "exists already"),
        (["-o", bag / "out.mcap"], "is the recording that is read, or inside it"),
        (["--json", tmp_path / "missing" / "s.json"], "missing or not writable"),
        (["--topic", "/count"], "is of type std_msgs/msg/UInt32"),
    ):
        assert why in error_line(capsys, "replay", bag, *arguments)
    assert "segment" in error_line(capsys, "replay", "a.pcd")
    assert len(clouds_of(bag, "/camera/points")) == 3


def test_ctrl_c_keeps_what_is_done_and_leaves_nothing_torn(tmp_path):
    topic, kind, _, message = cloud_entries(1)[0]
    data = bytes(typestore().serialize_cdr(message, kind))
    bag = write_mcap(tmp_path / "in.mcap", [(topic, kind, i, data) for i in range(5000)])
    out = tmp_path / "out.mcap"
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "topo_region_seg",
            "replay",
            str(bag),
            "-o",
            str(out),
            "--json",
            str(tmp_path / "s.json"),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    part = f".{out.name}."
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and process.poll() is None:
        size = sum(p.stat().st_size for folder in tmp_path.glob(part + "*") for p in folder.rglob("*.mcap"))
        if size > 10_000:  # some frames are done
            break
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "Traceback" not in err and "the results so far are kept" in err
    done = len(json.loads((tmp_path / "s.json").read_text())["frames"])
    assert 0 < done < 5000
    assert len(clouds_of(out, "/labeled_points")) == done
    assert sorted(p.name for p in tmp_path.iterdir()) == ["in.mcap", "out.mcap", "s.json"]


def test_as_a_program_without_ros(bag, tmp_path):
    """The tools need no ROS, their output no terminal, and `head` may stop reading."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("AMENT", "ROS"))}
    code = (
        "import sys; sys.modules['rclpy'] = None; "
        "from topo_region_seg.offline.cli.main import main; sys.exit(main(sys.argv[1:]))"
    )
    program = [sys.executable, "-c", code]
    done = subprocess.run([*program, "replay", str(bag)], env=environment, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    assert "\x1b" not in done.stdout
    refused = subprocess.run([*program, "play", str(bag)], env=environment, capture_output=True, text=True, timeout=120)
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1 and "pip install '.[ros]'" in refused.stderr


# --- real recordings ---


@needs_shared
@pytest.mark.parametrize(("name", "count"), [("bags/laptop_stream/laptop_stream.mcap", 3), ("clouds/watercan.bag", 1)])
def test_replay_of_real_recordings(name, count, tmp_path):
    run("replay", SHARED / name, "-o", tmp_path / "out.mcap", "--json", tmp_path / "s.json", "--all")
    found = json.loads((tmp_path / "s.json").read_text())
    assert len(found["frames"]) == count and found["rejected"] == []
    assert all(frame["regions"] > 1 for frame in found["frames"])
    assert len(clouds_of(tmp_path / "out.mcap", "/labeled_points")) == count


@needs_shared
def test_replay_of_the_tabletop_recording(tmp_path):
    bag, out = SHARED / "bags" / "tabletop_labelled", tmp_path / "out.mcap"
    run("replay", bag, "-o", out, "--json", tmp_path / "s.json")
    inputs, labeled = clouds_of(bag, "/camera/depth/points"), clouds_of(out, "/labeled_points")
    assert len(labeled) == 12
    for (time_in, given), (time_out, result) in zip(inputs, labeled, strict=True):
        assert (time_in, given.header, given.height, given.width) == (
            time_out,
            result.header,
            result.height,
            result.width,
        )
        before = np.asarray(given.data).reshape(-1, given.point_step)[:, :12]
        np.testing.assert_array_equal(before, np.asarray(result.data).reshape(-1, 20)[:, :12])


@needs_shared
def test_segment_of_the_milk_carton(tmp_path, capsys):
    run("segment", SHARED / "clouds" / "milk_color.pcd", "--barcode", tmp_path / "b.png")
    assert "13,704 points" in capsys.readouterr().out
    assert (tmp_path / "b.png").stat().st_size > 1000


def test_players_wait_for_as_many_as_is_said_and_for_nobody(capsys):
    parser = build_parser(["play"])
    for text, count in (("0", 0), ("3", 3)):
        assert parser.parse_args(["play", "a.mcap", "--wait-for", text]).wait_for == count
    for option in (["--wait-for", "-1"], ["--rate", "0"], ["--hz", "-2"], ["--wait-timeout", "0"], ["--rate", "nan"]):
        assert main(["play", "a.mcap", *option]) == 2
        err = capsys.readouterr().err
        assert err.count("\n") == 1 and option[0] in err


def test_a_table_of_recordings_names_its_columns():
    results = [BagResult("folder/a.mcap", without_truth=2), BagResult("folder/b.mcap", error="why")]
    table = bag_table(results, MEASURES)
    heads = [str(column.header).replace("\n", " ") for column in table.columns]
    assert heads[:4] == ["recording", "frames", "no truth", "re- jected"] and heads[-1] == "ms"
    assert len(heads) == 5 + len(MEASURES)
    assert list(table.columns[0].cells) == ["a.mcap", "b.mcap", "mean over frames"]
    assert list(table.columns[1].cells) == ["0", "failed", "0"]
    assert list(table.columns[2].cells) == ["2", "0", "2"]
    assert frame_table(results, MEASURES).columns[0].header == "recording"
    assert frame_table(results[:1], MEASURES).columns[0].header == "stamp (s)"
