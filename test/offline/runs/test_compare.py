# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Comparing two runs."""

from __future__ import annotations

import json

import numpy as np
import pytest
from bag_maker import chunks_of, cloud_entries, damage, write_mcap
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image
from places import SIMULATED
from sklearn.metrics import adjusted_rand_score

from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.cli.tables import change_table
from topo_region_seg.offline.runs.comparison import Comparison, FrameChange, changed_points, compare
from topo_region_seg.offline.runs.limits import Limits, broken, summary
from topo_region_seg.offline.runs.run import open_run

SIM = SIMULATED


def replay(bag, out, *options):
    assert main(["replay", str(bag), "-o", str(out), *options]) == 0
    return out


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    return (
        replay(SIM, folder / "a.mcap"),
        replay(SIM, folder / "same.mcap"),
        replay(SIM, folder / "b.mcap", "--set", "angle_threshold=9"),
    )


def command(*arguments):
    return main(["compare", *map(str, arguments)])


STRICT = "--max-region-change=0 --min-wov=1 --min-ari=1 --max-changed=0 --max-quality-loss=0 --max-unmatched=0"


def test_the_same_run_twice_breaks_no_limit(runs, capsys):
    assert command(runs[0], runs[1], *STRICT.split()) == 0
    assert "6 frames in both, 6 with the same regions" in capsys.readouterr().out


def test_other_parameters_break_limits_and_are_named(runs, capsys, tmp_path):
    assert command(runs[0], runs[2]) == 0  # without limits every change will do
    assert (
        command(runs[0], runs[2], *STRICT.split(), "--json", tmp_path / "c.json", "--picture", tmp_path / "c.png") == 1
    )
    said = capsys.readouterr()
    assert "parameter angle_threshold: 5.0 -> 9.0" in said.out
    for limit in ("--max-region-change 0", "--min-wov 1", "--min-ari 1", "--max-changed 0"):
        assert f"limit exceeded: {limit}: it is " in said.err
    content = json.loads((tmp_path / "c.json").read_text())
    assert len(content["beyond_limits"]) >= 4 and len(content["frames"]) == 6
    with Image.open(tmp_path / "c.png") as picture:
        assert len(set(picture.convert("RGB").resize((200, 200)).getdata())) > 100


def test_each_figure_of_a_frame_is_that_of_an_independent_calculation(runs):
    a, b = open_run(runs[0]), open_run(runs[2])
    found = compare(a, b)
    for change, frame_a, frame_b in zip(found.frames, a.frames(), b.frames(), strict=True):
        valid = np.isfinite(frame_a.cloud.xyz).all(axis=1)
        left, right = frame_a.labels[valid], frame_b.labels[valid]
        inside = left > 0
        assert change.ari == pytest.approx(adjusted_rand_score(left[inside], right[inside]), abs=1e-9)
        overlap = 0.0
        for label in np.unique(left[inside]):
            region = left == label
            counts = {other: np.sum(region & (right == other)) for other in np.unique(right[region]) if other}
            best = max(counts, key=lambda other: (counts[other], np.sum(right == other)), default=0)
            shared = counts.get(best, 0)
            overlap += region.sum() * shared / (region.sum() + np.sum(right == best) - shared)
        assert change.wov == pytest.approx(overlap / inside.sum(), abs=1e-9)
        assert change.regions == (len(np.unique(left[inside])), len(np.unique(right[right > 0])))
        assert change.ms["total"] == (frame_a.record.ms["total"], frame_b.record.ms["total"])


labels = arrays(np.uint32, st.integers(1, 60), elements=st.integers(0, 4))


@given(labels, st.permutations(range(1, 5)))
def test_new_numbers_are_no_change(a, numbers):
    renamed = np.array([0, *numbers], np.uint32)[a]
    assert not changed_points(a, renamed).any()


@given(labels, st.data())
def test_what_did_not_change_pairs_each_region_with_one_other(a, data):
    b = data.draw(arrays(np.uint32, len(a), elements=st.integers(0, 4)))
    changed = changed_points(a, b)
    assert not changed[(a == 0) & (b == 0)].any()
    assert changed[(a == 0) != (b == 0)].all()
    kept = ~changed & (a > 0)
    # What is left pairs each region with one other: no region is in two pairs.
    pairs = set(zip(a[kept].tolist(), b[kept].tolist(), strict=True))
    assert len({left for left, _ in pairs}) == len({right for _, right in pairs}) == len(pairs)


def test_a_split_region_changes_its_smaller_part():
    a = np.array([1, 1, 1, 1, 1, 2, 2, 0], np.uint32)
    b = np.array([7, 7, 7, 3, 3, 1, 1, 0], np.uint32)
    assert changed_points(a, b).tolist() == [False] * 3 + [True] * 2 + [False] * 3


def test_frames_are_matched_by_stamp_and_the_rest_is_said(tmp_path, capsys):
    entries = cloud_entries(4)
    a = replay(write_mcap(tmp_path / "in_a.mcap", entries[:3]), tmp_path / "a.mcap")
    b = replay(write_mcap(tmp_path / "in_b.mcap", entries[1:]), tmp_path / "b.mcap")
    found = compare(open_run(a), open_run(b))
    assert [frame.index for frame in found.frames] == [(1, 0), (2, 1)]
    assert len(found.only_a) == len(found.only_b) == 1
    assert command(a, b, "--max-unmatched", 1) == 1
    said = capsys.readouterr()
    assert "only in RUN_A: 1 frame" in said.out and "only in RUN_B: 1 frame" in said.out
    assert "--max-unmatched 1: it is 2" in said.err
    assert command(a, b, "--max-unmatched", 2) == 0


def test_equal_stamps_are_matched_in_order(tmp_path):
    entries = cloud_entries(2)
    bag = write_mcap(tmp_path / "in.mcap", [entries[0], entries[0], entries[1]])
    found = compare(open_run(replay(bag, tmp_path / "a.mcap")), open_run(replay(bag, tmp_path / "b.mcap")))
    assert [frame.index for frame in found.frames] == [(0, 0), (1, 1), (2, 2)]


def test_limits_on_what_is_not_known_are_broken(tmp_path, capsys):
    bag = write_mcap(tmp_path / "in.mcap", cloud_entries(2))
    a, b = replay(bag, tmp_path / "a.mcap"), replay(bag, tmp_path / "b.mcap")
    assert command(a, b, "--max-quality-loss", 1) == 1
    assert "the truth is unknown" in capsys.readouterr().err
    empty = compare(
        open_run(a), open_run(replay(write_mcap(tmp_path / "in2.mcap", cloud_entries(9)[5:]), tmp_path / "c"))
    )
    assert empty.frames == []
    assert broken(empty, summary(empty), Limits(min_wov=0.0)) == ["--min-wov 0: there is nothing to compare"]


@pytest.mark.parametrize(
    "limit", ["--min-wov=nan", "--min-ari=nan", "--max-ms-ratio=0", "--max-unmatched=-1", "--max-changed=2", "--most=x"]
)
def test_limits_that_make_no_sense_are_refused(runs, capsys, limit):
    assert command(runs[0], runs[1], limit) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_run_of_more_cpu_time_exceeds_the_limit_and_one_that_waited_does_not(runs):
    a, b = open_run(runs[0]), open_run(runs[1])
    assert all(frame.cpu_ms["total"] > 0.0 for frame in b.record.frames)
    for frame in b.record.frames:
        frame.ms["total"] *= 1000.0
    found = compare(a, b)
    assert not broken(found, summary(found), Limits(max_ms_ratio=50.0))
    for frame in b.record.frames:
        frame.cpu_ms["total"] *= 1000.0
    found = compare(a, b)
    assert broken(found, summary(found), Limits(max_ms_ratio=5.0))
    assert not broken(found, summary(found), Limits(max_ms_ratio=1e9))


def test_of_runs_that_do_not_know_their_cpu_time_the_time_counts(runs):
    a, b = open_run(runs[0]), open_run(runs[1])
    for frame in b.record.frames:
        frame.ms["total"] *= 1000.0
        frame.cpu_ms.clear()
    found = compare(a, b)
    sums = summary(found)
    assert sums["cpu_ms_ratio"] is None and sums["ms_ratio"] == sums["wall_ms_ratio"] > 5.0
    assert broken(found, sums, Limits(max_ms_ratio=5.0))


def quality(wov):
    return {"wov": wov, "overlap_f": None if wov is None else wov / 2}


def hand_made(**changed):
    """A comparison of one frame in which B has one region more and is a little worse, and one frame that only A has."""
    frame = {
        "stamp": 1.0,
        "index": (0, 0),
        "regions": (5, 6),
        "wov": 0.9,
        "ari": 0.8,
        "changed": 0.1,
        "ms": {"total": (10.0, 15.0)},
        "quality": (quality(0.7), quality(0.6)),
    }
    return Comparison(frames=[FrameChange(**{**frame, **changed})], only_a=[2.0], only_b=[])


@pytest.mark.parametrize(
    ("name", "value", "stricter", "looser"),
    [
        ("max_region_change", 1, 0, 2),
        ("min_wov", 0.9, 0.91, 0.89),
        ("min_ari", 0.8, 0.81, 0.79),
        ("max_changed", 0.1, 0.09, 0.11),
        ("max_ms_ratio", 1.5, 1.49, 1.51),
        ("max_quality_loss", 0.1, 0.09, 0.11),
        ("max_unmatched", 1, 0, 2),
    ],
)
def test_each_limit_has_its_side_and_holds_its_own_value(name, value, stricter, looser):
    found = hand_made()
    sums = summary(found)
    assert sums[name.partition("_")[2]] == pytest.approx(value)
    assert broken(found, sums, Limits(**{name: value})) == []
    assert broken(found, sums, Limits(**{name: looser})) == []
    (line,) = broken(found, sums, Limits(**{name: stricter}))
    assert line.startswith(f"--{name.replace('_', '-')} {stricter:g}: it is ")


def test_a_gain_in_quality_is_a_negative_loss():
    found = hand_made(quality=(quality(0.6), quality(0.7)))
    assert summary(found)["quality_loss"] == pytest.approx(-0.1)
    assert broken(found, summary(found), Limits(max_quality_loss=0.0)) == []
    assert broken(found, summary(found), Limits(max_quality_loss=-0.2)) == ["--max-quality-loss -0.2: it is -0.1"]


def test_fewer_regions_are_a_change_as_more_are():
    found = hand_made(regions=(6, 3))
    assert broken(found, summary(found), Limits(max_region_change=2)) == ["--max-region-change 2: it is 3"]


@pytest.mark.parametrize("place", [0, 1])
def test_a_damaged_run_is_compared_as_far_as_it_goes_and_fails(place, tmp_path, capsys):
    bag = write_mcap(tmp_path / "in.mcap", cloud_entries(3))
    pair = [replay(bag, tmp_path / "a.mcap"), replay(bag, tmp_path / "b.mcap")]
    start, end = chunks_of(pair[place])[0]
    damage(pair[place], (start + end) // 2)
    assert command(*pair) == 1
    said = capsys.readouterr()
    assert f"damaged: {pair[place]}" in said.err
    assert "frames in both" in said.out


def test_quality_against_the_truth_is_read_as_asked(runs, capsys, tmp_path):
    quality = {}
    for option in ("--source", "--whole-objects", "--partial-truth"):
        given = [option, SIM] if option == "--source" else [option]
        assert command(runs[0], runs[2], *given, "--json", tmp_path / "c.json") == 0
        quality[option] = [
            pair for frame in json.loads((tmp_path / "c.json").read_text())["frames"] for pair in frame["quality"]
        ]
        shown = capsys.readouterr().out
        assert "true WOv A" in shown and "true overl. F" in shown
    for parts, whole, partial in zip(*quality.values(), strict=True):
        assert whole["wov"] != parts["wov"] == partial["wov"]
        assert partial["overlap_f"] is None and partial["recall_50"] == parts["recall_50"]
        assert 0.0 < parts["overlap_f"] <= 1.0


def test_the_frames_that_changed_most_come_first_and_those_that_did_not_are_left_out():
    def frame(index, changed, regions=(5, 5)):
        return hand_made(index=(index, index), changed=changed, regions=regions).frames[0]

    frames = [
        frame(0, 0.0),
        frame(1, 0.2),
        frame(2, None),  # other points
        frame(3, 0.2, (5, 2)),
        frame(4, 0.0, (5, 6)),
        frame(5, 0.9),
        frame(6, 0.2, (5, 6)),
    ]
    found = Comparison(frames=frames)
    assert [frame.index[0] for frame in found.most_changed(10)] == [2, 5, 3, 6, 1, 4]
    assert [frame.index[0] for frame in found.most_changed(2)] == [2, 5]


@pytest.mark.parametrize(
    ("name", "why"),
    [("max_quality_loss", "the truth is unknown"), ("min_wov", "there is nothing to compare")]
    + [(name, "there is nothing to compare") for name in ("min_ari", "max_changed", "max_ms_ratio")],
)
def test_a_limit_on_what_is_not_known_is_exceeded_and_says_why(name, why):
    found = hand_made(quality=(None, None), wov=None, ari=None, changed=None, ms={})
    lines = broken(found, summary(found), Limits(**{name: 0.5}))
    assert lines[0] == f"--{name.replace('_', '-')} 0.5: {why}"
    sizes = "1 frames differ in their number of points, first at 1.000 s"
    assert lines[1:] == ([] if name in ("max_quality_loss", "max_ms_ratio") else [sizes])


def test_only_known_times_and_qualities_count():
    frames = hand_made().frames + hand_made(ms={"total": (None, 9.0)}, quality=(quality(0.9), None)).frames
    frames += hand_made(ms={"total": (30.0, 30.0)}, quality=(quality(0.5), quality(None))).frames
    frames += hand_made(ms={"total": (20.0, 50.0)}, quality=(quality(0.5), quality(0.1))).frames
    sums = summary(Comparison(frames=frames, only_a=[], only_b=[2.0, 3.0, 4.0]))
    assert sums["ms_ratio"] == pytest.approx(30.0 / 20.0), "of the medians"
    assert sums["quality_loss"] == pytest.approx((0.1 + 0.4) / 2)
    assert sums["unmatched"] == 3
    assert summary(hand_made(ms={"total": (0.0, 5.0)}))["ms_ratio"] is None
    sums = summary(hand_made(cpu_ms={"total": (2.0, 1.0)}))
    assert (sums["ms_ratio"], sums["cpu_ms_ratio"], sums["wall_ms_ratio"]) == (0.5, 0.5, 1.5)


def test_the_worst_frame_counts():
    frames = hand_made().frames + hand_made(regions=(9, 2), wov=0.2, ari=0.95, changed=0.05).frames
    sums = summary(Comparison(frames=frames))
    assert (sums["region_change"], sums["wov"], sums["ari"], sums["changed"]) == (7, 0.2, 0.8, 0.1)


def cells(table):
    return [list(column.cells) for column in table.columns]


def test_the_table_shows_each_figure_of_a_frame():
    other = hand_made(stamp=2.0, changed=None, wov=None, ari=None, ms={}, quality=(None, quality(0.25)), regions=(3, 1))
    table = change_table([*hand_made().frames, *other.frames])
    assert cells(table) == [
        ["1.000", "2.000"], ["5", "3"], ["6", "1"], ["10.0 %", "other points"], ["0.900", "–"], ["0.800", "–"],
        ["10.0", "–"], ["15.0", "–"], ["0.700", "–"], ["0.600", "0.250"], ["0.350", "–"], ["0.300", "0.125"],
    ]  # fmt: skip
    assert [column.header for column in table.columns] == [
        "stamp (s)", "reg. A", "B", "changed", "WOv", "ARI", "ms A", "B", "true WOv A", "B", "true overl. F A", "B",
    ]  # fmt: skip
    assert len(change_table(hand_made(quality=(None, None)).frames).columns) == 8
    table = change_table(hand_made(cpu_ms={"total": (7.0, None)}).frames)
    assert cells(table)[6:8] == [["7.0"], ["–"]] and table.columns[6].header == "CPU A"


def test_the_picture_names_both_runs_and_shows_what_changed(runs, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(
        "topo_region_seg.offline.figures.difference.plot_differences", lambda rows, path: drawn.extend(rows)
    )
    assert command(runs[0], runs[2], "--picture", tmp_path / "c.png") == 0
    found = compare(open_run(runs[0]), open_run(runs[2]))
    assert len(drawn) == 4
    for row, change in zip(drawn, found.most_changed(4), strict=True):
        assert change.changed > 0.0
        assert row.titles == (
            f"A, {change.stamp:.3f} s: {change.regions[0]} regions",
            f"B: {change.regions[1]} regions",
            f"changed: {100 * change.changed:.1f} % of the points",
        )
        valid = np.isfinite(row.cloud.xyz).all(axis=1)
        assert row.changed[valid].mean() == pytest.approx(change.changed)
