# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Identity over frames: by hand, against every possible assignment, and from a recording to the table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from places import ROOT
from scipy.optimize import linear_sum_assignment

from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.evaluation.identity import IDENTITY, Identity, IdentityMeter, summed
from topo_region_seg.offline.evaluation.measures import AS_LABELED, Measures, TruthReading

BAG = ROOT / "bags" / "tabletop_sim"
Frame = tuple[Sequence[int], Sequence[int]]


def counted(frames: Sequence[Frame], reading: TruthReading = AS_LABELED, height: int = 2) -> Identity:
    meter = IdentityMeter(reading)
    for truth, labels in frames:
        known = np.ones(len(truth), bool)
        meter.add(np.array(truth, np.uint32), np.array(labels, np.uint32), known, height, len(truth) // height)
    return meter.identity()


def measured(frames: Sequence[Frame], reading: TruthReading = AS_LABELED) -> Measures:
    return counted(frames, reading).measures()


def test_labels_that_stay_are_perfect() -> None:
    found = measured([([20, 20, 30, 30], [7, 7, 4, 4])] * 3)
    assert found == {
        "idf1": 1.0,
        "id_precision": 1.0,
        "id_recall": 1.0,
        "switches": 0,
        "hits": 6,
        "flicker": 0.0,
    }


def test_a_label_that_changes_once_and_one_that_comes_back() -> None:
    # Object 20 is 1, 1, 2, 1: two switches, three of its four hits are of the label that is assigned to it. Object 30
    # is 5 throughout. 8 segments, 8 regions, 7 right.
    truth = [20, 20, 30, 30]
    found = measured([(truth, [first, first, 5, 5]) for first in (1, 1, 2, 1)])
    assert (found["switches"], found["hits"]) == (2, 8)
    assert found["idf1"] == found["id_precision"] == found["id_recall"] == pytest.approx(7 / 8)
    assert found["flicker"] == pytest.approx((2 + 2) / (3 * 4))


def test_two_objects_that_trade_labels_share_them_over_the_whole_recording() -> None:
    # Either way of assigning 1 and 2 to the objects is right in 2 of 4 frames and for 2 objects: 4 of 8.
    truth = [20, 20, 30, 30]
    found = measured([(truth, [1, 1, 2, 2])] * 2 + [(truth, [2, 2, 1, 1])] * 2)
    assert (found["idf1"], found["switches"]) == (pytest.approx(4 / 8), 2)


def test_a_label_is_assigned_to_one_object_alone() -> None:
    # Label 1 is first the one, then the other: it can stand for one of them. 4 segments, 2 hits, 4 regions, 1 right.
    found = measured([([20, 20, 30, 30], [1, 1, 8, 9]), ([20, 20, 30, 30], [8, 9, 1, 1])])
    assert (found["hits"], found["switches"]) == (2, 0)
    assert (found["id_precision"], found["id_recall"]) == (pytest.approx(1 / 6), pytest.approx(1 / 4))
    assert found["idf1"] == pytest.approx(2 * 1 / (4 + 6))


def test_a_switch_counts_after_frames_without_a_hit_too() -> None:
    truth = [20, 20, 20, 20]
    assert measured([(truth, [1] * 4), (truth, [0] * 4), (truth, [2] * 4)])["switches"] == 1


def test_half_an_object_is_no_hit() -> None:
    found = measured([([20, 20, 20, 20], [1, 1, 2, 2])] * 2)
    assert (found["hits"], found["idf1"], found["id_recall"]) == (0, 0.0, 0.0)


def test_flicker_is_of_points_of_the_same_thing_with_a_region_in_both_frames() -> None:
    # Of eight points one is unknown, one is another thing now, one has no region any more, one had none; the region of
    # two of the other four has another label.
    before = [0, 20, 20, 20, 1, 1, 20, 20], [3, 3, 3, 0, 4, 4, 3, 3]
    now = [0, 30, 20, 20, 1, 1, 20, 20], [5, 5, 0, 3, 4, 6, 3, 5]
    found = counted([before, now])
    assert (found.kept, found.changed) == (4, 2)


def test_points_without_an_image_grid_have_no_flicker() -> None:
    found = counted([([20, 20], [1, 1]), ([20, 20], [2, 2])], height=1)
    assert (found.measures()["flicker"], found.switches) == (None, 1)


def test_partial_truth_leaves_out_what_needs_all_objects() -> None:
    found = measured([([20, 20, 0, 1], [1, 1, 2, 3])], TruthReading(partial=True))
    assert (found["idf1"], found["id_precision"], found["id_recall"]) == (None, None, 1.0)


def test_parts_of_whole_objects_are_one() -> None:
    frames = [([20, 21, 22, 1], [1, 1, 1, 0]), ([21, 21, 22, 1], [1, 1, 1, 0])]
    assert measured(frames, TruthReading(whole_objects=True))["id_recall"] == 1.0


def test_frames_without_objects_define_nothing() -> None:
    found = measured([([1, 1], [1, 1])])
    assert [found[name] for name in IDENTITY[:3]] == [None, None, None]
    assert measured([])["flicker"] is None


def test_recordings_add_up_with_trajectories_of_their_own() -> None:
    one, two = Identity(1, 2, 3, 4, 5, 6, 7), Identity(10, 20, 30, 40, 50, 60, 70)
    assert summed([one, None, two]) == Identity(11, 22, 33, 44, 55, 66, 77)
    assert summed([one, Identity(10, 20, None)]) == Identity(11, 22, None, 4, 5, 6, 7)
    assert summed([None, None]) is None


@pytest.mark.parametrize("seed", range(30))
def test_no_other_assignment_is_better(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frames = []
    for _ in range(6):
        truth = np.repeat(rng.permutation([20, 30, 40, 1])[:3], 4)
        own = np.where(rng.random(12) < 0.1, 9, truth // 10 + rng.integers(0, 2) * (truth > 20))
        frames.append((truth.tolist(), own.tolist()))
    found = counted(frames)
    right, switches, table = independent(frames)
    assert (found.right, found.switches, found.hits) == (right, switches, int(table.sum()))
    assert found.right == table[linear_sum_assignment(table, maximize=True)].sum()


def independent(frames: Sequence[Frame]) -> tuple[int, int, np.ndarray]:
    """Count hits with sets of points, and try all assignments; the table is of hits by object and label."""
    objects, labels = [20, 30, 40], list(range(1, 10))
    table, switches = np.zeros((len(objects), len(labels)), int), 0
    last: dict[int, int] = {}
    for truth, own in frames:
        for row, segment in enumerate(objects):
            mine = {i for i, value in enumerate(truth) if value == segment}
            for column, label in enumerate(labels):
                region = {i for i, value in enumerate(own) if value == label}
                if mine and 2 * len(mine & region) > len(mine | region):
                    table[row, column] += 1
                    switches += segment in last and last[segment] != label
                    last[segment] = label
    best = max(sum(table[row, column] for row, column in enumerate(some)) for some in permutations(range(9), 3))
    return int(best), switches, table


def test_from_a_recording_to_table_and_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "found.json"
    assert main(["evaluate", str(BAG), "--json", str(out), "--set", "track_regions=true"]) == 0
    found = json.loads(out.read_text())
    assert list(found["identity"]) == list(IDENTITY) and found["bags"][0]["identity"] == found["identity"]
    text = capsys.readouterr().out
    assert "IDF1" in text and f"{found['identity']['idf1']:.3f}" in text
    # The same labels, as a replay writes them.
    assert main(["replay", str(BAG), "-o", str(tmp_path / "out.mcap"), "--set", "track_regions=true"]) == 0
    again = tmp_path / "again.json"
    arguments = ["evaluate", str(tmp_path / "out.mcap"), "--recorded-labels", "--truth-bag", str(BAG)]
    assert main([*arguments, "--json", str(again)]) == 0
    assert json.loads(again.read_text())["identity"] == found["identity"]
    # Ranks by size are not meant to stay.
    assert main(["evaluate", str(BAG), "--json", str(out)]) == 0
    assert json.loads(out.read_text())["identity"] is None
