# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of objects: what its frames and groups count, and that a frame runs and is told."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from places import ROOT

sys.path.append(str(ROOT))  # last, so that an installed copy of the package is the one that is tested

from benchmarks import pcl_peers
from benchmarks.beyond.__main__ import with_measured
from benchmarks.objects import __main__ as benchmark
from benchmarks.objects import datasets
from benchmarks.objects.ablations import PARTS, switched_off, united_at_once
from benchmarks.objects.changes import changes
from benchmarks.objects.datasets import Sample, data_sets
from benchmarks.objects.frame import measured
from benchmarks.objects.programs import OURS, PEERS
from benchmarks.objects.tables import groups, markdown, mean, usual_ms
from topo_region_seg.beyond.objects.convexity import Borders
from topo_region_seg.beyond.objects.uniting import unite_convex
from topo_region_seg.data import Cloud
from topo_region_seg.params import Params

TRUTH = np.array([1, 1, 20, 20, 21, 21, 30, 30], np.uint32)
FOUND = np.array([9, 9, 1, 1, 1, 1, 2, 2], np.uint32)


def sample(**about) -> Sample:
    cloud = Cloud(np.ones((8, 3), np.float32), None, 1, 8)
    return Sample(cloud, TRUTH, **{"complete": True, "kind": "tabletop", **about})


def frame(kind: str, wov: float, precision: float | None = 0.5, **more) -> dict:
    names = ("fos", "fus", "overlap_precision", "overlap_recall", "overlap_f", "f75", "recall_50", "boundary_f")
    rest = {name: 0.25 for name in names}
    false = None if precision is None else 1.0
    counts = {"reported": 4, "true": 2, "cpu_ms": 40.0, "precision_50": precision, "false_objects": false}
    return {OURS: {"kind": kind, "wov": wov, **rest, **counts, **more}}


RUN = {
    "tabletop": {"frame 0": frame("tabletop", 0.9, cpu_ms=20.0, whole_wov=0.8)},
    "scenes": {
        "a": frame("bin", 0.5, cpu_ms=90.0),
        "b": frame("table, transparent things", 0.1, None),
        "c": frame("room or office", 0.3, None),
    },
    "simulated": {"bin, active stereo, 1": frame("bin, active stereo", 0.7)},
}


def test_measures_by_parts_and_by_whole_objects() -> None:
    found = measured(sample(parts=True), FOUND)
    assert (found["true"], found["whole_true"], found["reported"]) == (3, 2, 3)
    assert (found["wov"], found["whole_wov"]) == (pytest.approx((2 * 0.5 + 2 * 0.5 + 2) / 6, abs=1e-4), 1.0)
    assert found["whole_precision_50"] == pytest.approx(2 / 3, abs=1e-4)
    assert not any(name.startswith("whole_") for name in measured(sample(), FOUND))


def test_where_not_all_objects_have_truth_precision_is_left_out() -> None:
    found = measured(sample(complete=False), FOUND)
    assert found["precision_50"] is None and found["overlap_f"] is None
    assert found["recall_50"] is not None and found["wov"] is not None


def test_groups_take_the_frames_that_they_are_named_for() -> None:
    taken = {group.title: group.frames(RUN, OURS) for group in groups(RUN)}
    whole = taken.pop("Recorded tabletops, whole objects")
    assert mean(whole.values(), "wov") == 0.8 and mean(whole.values(), "fos") == 0.25
    names = {title.partition(" (")[0]: [*frames] for title, frames in taken.items()}
    assert names["Other cameras and scenes, all frames"] == ["a", "b", "c"]
    assert names["The same, without rooms and transparent things"] == ["a"]
    assert names["The same, frames where all objects have truth"] == ["a"]
    assert names["Simulated, bin"] == names["Simulated, active stereo"] == ["bin, active stereo, 1"]
    assert usual_ms(RUN) == 20.0 and usual_ms({}) is None


def test_the_document_has_a_table_for_each_group_and_names_low_and_slow_frames() -> None:
    text = markdown(RUN, [OURS, *PEERS])
    assert all(group.title in text for group in groups(RUN))
    assert "a (scenes): 4.5 times" in text
    low = text.partition("Frames below")[2]
    assert [line.split(" | ")[0] for line in low.splitlines() if line.startswith("| ")][2:] == ["| a", "| b", "| c"]
    document = (ROOT / "docs" / "objects.md").read_text(encoding="utf-8")
    assert text.splitlines()[0] in with_measured(document, text, benchmark.BEGIN, benchmark.END)


def test_two_runs_are_compared_on_the_frames_of_both() -> None:
    other = {"scenes": {"a": frame("bin", 0.75, overlap_f=0.5)}}
    text = changes(RUN, other)
    assert "scenes: a: WOv 0.500 -> 0.750 (+0.250)" in text
    all_frames = next(line for line in text.splitlines() if "all frames" in line)
    assert "0.500 -> 0.750" in all_frames and "0.250 -> 0.500" in all_frames
    assert "tabletop" not in text.lower()


def test_without_the_shared_recordings_scenes_are_left_out(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(datasets, "SCENES", tmp_path / "nowhere")
    found = data_sets()
    assert found["scenes"].names == [] and "nowhere" in found["scenes"].missing
    assert len(found["tabletop"].names) == 12 and len(found["simulated"].names) == 36


def test_hardly_seen_objects_of_simulated_scenes_are_unknown() -> None:
    one = data_sets()["simulated"].load("bin, active stereo, 11")
    labels, size = np.unique(one.truth, return_counts=True)
    assert (labels[labels >= 20] % 10 == 0).all() and size[labels >= 20].min() >= datasets.LEAST_SEEN
    assert (one.truth[~np.isfinite(one.cloud.xyz[:, 0])] == 0).all()


def test_a_frame_runs_and_is_told_without_pcl(monkeypatch, tmp_path, capfd) -> None:
    monkeypatch.setattr(pcl_peers, "_build", lambda: (Path(), "PCL is missing"))
    options = ["--only", "simulated", "--every", "40", "--peers", "--json", str(tmp_path / "found.json")]
    assert benchmark.main([*options, "--set", "object_radius=0.011"]) == 0
    told = capfd.readouterr().out
    assert "without other programs: PCL is missing" in told and "Simulated, tabletop" in told
    kept = json.loads((tmp_path / "found.json").read_text())
    assert kept["set"] == ["object_radius=0.011"] and kept["machine"]["cores"] >= 1
    ((name, programs),) = kept["data"]["simulated"].items()
    assert name.startswith("tabletop") and list(programs) == [OURS] and 0.0 < programs[OURS]["wov"] <= 1.0


@pytest.mark.parametrize("name", PARTS)
def test_a_part_is_switched_off_and_on_again(name) -> None:
    part = PARTS[name]
    params = Params(output="objects")
    assert all(params.replace(**part.params).differs(changed) for changed in part.params)
    before = [getattr(module, attribute) for module, attribute, _ in part.code]
    assert part.params or part.code
    with switched_off(part):
        for (module, attribute, value), was in zip(part.code, before, strict=True):
            assert getattr(module, attribute) is value and value != was
    assert [getattr(module, attribute) for module, attribute, _ in part.code] == before


def test_borders_that_are_not_judged_again_chain_what_one_convex_border_joins() -> None:
    first, second = np.array([1, 1, 2, 3]), np.array([2, 3, 3, 4])
    pairs = np.full(4, 100.0)
    borders = Borders(first, second, pairs, pairs * [0.95, 0.05, 0.65, 0.1], np.zeros(4))
    assert united_at_once(borders, 5, 0.6).tolist() == [0, 1, 1, 1, 4]
    assert unite_convex(borders, 5, 0.6).tolist() == [0, 1, 1, 3, 4]


def test_a_frame_runs_without_each_part(monkeypatch, tmp_path, capfd) -> None:
    few = {name: PARTS[name] for name in ("without vessels", "nothing united")}
    monkeypatch.setattr(benchmark, "PARTS", few)
    options = ["--only", "simulated", "--every", "40", "--ablate", "--json", str(tmp_path / "found.json")]
    assert benchmark.main(options) == 0
    assert "  without vessels" in capfd.readouterr().out
    ((_, programs),) = json.loads((tmp_path / "found.json").read_text())["data"]["simulated"].items()
    assert list(programs) == [OURS, *few]
    assert programs["nothing united"]["reported"] > programs[OURS]["reported"]


def test_the_document_says_of_every_low_frame_why() -> None:
    document = (ROOT / "docs" / "objects.md").read_text(encoding="utf-8")
    low, _, why = document.partition("Frames below a weighted overlap")[2].partition("Why these are low")
    names = [[row.split(" | ")[0] for row in text.split("\n\n")[1].splitlines()[2:]] for text in (low, why)]
    assert names[0] and sorted(names[0]) == sorted(names[1])
