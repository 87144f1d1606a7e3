# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What the benchmarks beyond the paper count, on cases that can be counted by hand."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from places import ROOT

sys.path.append(str(ROOT))  # last, so that an installed copy of the package is the one that is tested

from benchmarks.beyond.__main__ import BEGIN, END, PARTS, with_measured
from benchmarks.beyond.supervoxels import undersegmentation_error, whole_objects
from benchmarks.beyond.tracking import Step, changed, mismatches, switches
from topo_region_seg.data import Cloud

CLOUD = Cloud(np.zeros((6, 3), np.float32), None, 2, 3)


def step(truth: list[int], plain: list[int]) -> Step:
    labels = np.array(plain, np.uint32)
    return Step(CLOUD, labels, labels, np.array(truth, np.uint32), 0.0)


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 4)), min_size=1, max_size=40))
def test_undersegmentation_error_counts_the_smaller_side_of_each_crossing(points: list[tuple[int, int]]) -> None:
    truth, labels = (np.array(column, np.uint32) for column in zip(*points, strict=True))
    expected = 0
    for patch in set(labels.tolist()) - {0}:
        for segment in set(truth[labels == patch].tolist()):
            inside = int(np.sum((labels == patch) & (truth == segment)))
            expected += min(inside, int(np.sum(labels == patch)) - inside)
    assert undersegmentation_error(truth, labels) == pytest.approx(expected / len(points))


def test_parts_of_an_object_are_one() -> None:
    assert whole_objects(np.array([0, 3, 20, 29, 31], np.uint32)).tolist() == [0, 3, 20, 20, 30]


def test_a_segment_switches_when_its_label_is_not_the_one_that_it_had_last() -> None:
    truth = [20, 20, 20, 30, 30, 5]
    steps = [step(truth, row) for row in ([1, 1, 1, 2, 2, 9], [2, 2, 2, 1, 1, 9], [2, 2, 2, 1, 1, 9])]
    assert switches(steps, [one.plain for one in steps]) == (2, 6)


def test_a_segment_that_no_label_covers_is_not_sighted_but_remembered() -> None:
    truth = [20, 20, 20, 20, 5, 5]
    steps = [step(truth, row) for row in ([1, 1, 1, 1, 0, 0], [1, 0, 0, 2, 0, 0], [3, 3, 3, 3, 0, 0])]
    assert switches(steps, [one.plain for one in steps]) == (1, 2)


def test_changed_looks_at_points_with_a_label_in_both_frames() -> None:
    labels = [np.array(row, np.uint32) for row in ([1, 1, 2, 0], [1, 2, 2, 2], [1, 2, 2, 0])]
    assert changed(labels) == pytest.approx((1 / 3 + 0) / 2)


def test_mismatches_are_of_regions_that_lie_on_one_another() -> None:
    steps = [step([0] * 6, [1, 1, 1, 2, 2, 3]), step([0] * 6, [2, 2, 2, 1, 1, 1])]
    assert mismatches(steps, [one.plain for one in steps]) == (2, 2)


@pytest.mark.parametrize("name", PARTS)
def test_each_part_has_its_document_with_markers(name: str) -> None:
    text = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    assert "one figure" in with_measured(text, "one figure")
    assert text.index(BEGIN) < text.index(END)
