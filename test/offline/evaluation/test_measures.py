# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The quality measures: by hand, by their properties, and against an independent implementation."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import quality_oracle
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from sklearn.metrics import adjusted_rand_score

from topo_region_seg.offline.evaluation import DETECTION, MEASURES, TruthReading, measure
from topo_region_seg.offline.evaluation import contingency as counting
from topo_region_seg.offline.evaluation.boundaries import boundary, tolerance
from topo_region_seg.offline.evaluation.measures import NEEDS_ALL_OBJECTS

PARTIAL = TruthReading(partial=True)


def labels(*values: int) -> np.ndarray:
    return np.array(values, np.uint32)


def grid(rows: list[str]) -> np.ndarray:
    """Letters to labels: '.' is 0, 'a' is 20, 'b' is 21, ..."""
    return np.array([[0 if c == "." else 20 + ord(c) - ord("a") for c in row] for row in rows], np.uint32)


def measured(truth: np.ndarray, found: np.ndarray, valid: np.ndarray | None = None, **shape: int) -> dict:
    return measure(truth, found, np.ones(len(truth), bool) if valid is None else valid, **shape)


def test_one_object_in_two_regions_and_one_in_a_region_that_spills_over() -> None:
    truth = labels(0, 1, 20, 20, 20, 30, 30)
    found = measured(truth, labels(1, 2, 1, 1, 3, 2, 2))
    # 20: region 1 has 2 of its 3 points and one beside it; 30: region 2 has both, and one beside.
    assert found["wov"] == pytest.approx((3 * 2 / 4 + 2 * 2 / 3) / 5)
    assert found["fos"] == pytest.approx(1 - 4 / 5)
    assert found["fus"] == pytest.approx(2 / 5)
    assert found["asa"] == 1.0
    assert found["labelled"] == 1.0
    assert found["boundary_recall"] is None and found["boundary_precision"] is None


def test_one_region_over_two_objects_and_the_table() -> None:
    found = measured(labels(1, 1, 1, 1, 20, 20, 20, 30), labels(1, 1, 1, 1, 1, 1, 1, 1))
    assert found["wov"] == pytest.approx((3 * 3 / 8 + 1 * 1 / 8) / 4)
    assert found["fos"] == 0.0
    assert found["fus"] == pytest.approx((5 + 7) / 4)
    assert found["asa"] == pytest.approx(3 / 4)
    assert found["ari"] == 0.0


def test_points_without_a_region() -> None:
    found = measured(labels(20, 20, 20, 30, 30, 1), labels(1, 0, 0, 0, 0, 0))
    assert found["wov"] == pytest.approx(3 * (1 / 3) / 5)  # the most of object 20 has no region: that is none
    assert found["fos"] == pytest.approx(4 / 5)
    assert found["fus"] == 0.0
    assert found["asa"] == pytest.approx(1 / 5)
    assert found["labelled"] == pytest.approx(1 / 6)
    nothing = measured(labels(20, 20), labels(0, 0))
    assert (nothing["wov"], nothing["fos"], nothing["fus"], nothing["asa"]) == (0.0, 1.0, 0.0, 0.0)


def test_leakage_by_hand() -> None:
    # Object 20 has ten points: four in region 1, five in region 2, which is mostly table, one in region 3, all of 30.
    truth = labels(*10 * [20], *6 * [1], *3 * [30], 0)
    found = measured(truth, labels(1, 1, 1, 1, 2, 2, 2, 2, 2, 3, *6 * [2], 3, 3, 3, 1))
    assert found["achievable"] == pytest.approx((4 + 3) / 13)  # the table's region loses its five points
    assert found["spill"] == pytest.approx((1 + 1) / 13)  # the unknown point of region 1, and that of 20 in region 3
    assert found["pieces"] == pytest.approx((3 + 1) / 2)
    assert found["asa"] == pytest.approx((4 + 5 + 3) / 13)


def test_faces_leak_nothing() -> None:
    found = measured(labels(20, 20, 20, 20, 1), labels(1, 1, 2, 3, 0))
    assert (found["achievable"], found["spill"], found["pieces"]) == (1.0, 0.0, 3.0)


def test_a_region_of_as_much_table_as_object_is_table() -> None:
    found = measured(labels(20, 20, 1, 1), labels(1, 1, 1, 1))
    assert (found["achievable"], found["spill"], found["pieces"]) == (0.0, 0.0, 1.0)


def test_overlap_and_detection_by_hand() -> None:
    truth = labels(1, 1, 1, 20, 20, 20, 20, 30, 30, 30, 40, 0, 0, 0)
    found = measured(truth, labels(5, 5, 1, 1, 1, 1, 2, 2, 3, 0, 0, 7, 7, 7))
    # Objects of 4, 3 and 1 points. Region 1 (4 points) has 3 of object 20: F 3/4, over union 3/5. Region 2 (2 points)
    # has one of 20 and one of 30, region 3 (1 point) one of 30: F with 30 are 2/5 and 1/2, so 30 takes 3. Region 5 is
    # on the table. Region 7 is where the truth is unknown and counts nowhere. Object 40 has none.
    assert found["overlap_precision"] == pytest.approx((3 + 1) / (4 + 2 + 1 + 2))
    assert found["overlap_recall"] == pytest.approx((3 + 1) / (4 + 3 + 1))
    assert found["overlap_f"] == pytest.approx(2 * 4 / (9 + 8))
    assert found["f75"] == 0.0  # 3/4 is not above 0.75
    assert found["precision_50"] == pytest.approx(1 / 4) and found["recall_50"] == pytest.approx(1 / 3)
    assert found["precision_75"] == found["recall_75"] == 0.0
    assert found["false_objects"] == 3.0


def test_the_assignment_has_the_largest_sum_of_f_not_the_best_pair_first() -> None:
    # Region 1 fits object 20 best, but then region 2 and object 30 have nothing.
    truth = labels(20, 20, 20, 20, 20, 30, 30)
    result = measured(truth, labels(2, 2, 1, 1, 1, 1, 0))
    f = {(20, 1): 6 / 9, (20, 2): 4 / 7, (30, 1): 2 / 6}
    assert f[20, 1] < f[20, 2] + f[30, 1]
    assert result["overlap_recall"] == pytest.approx((2 + 1) / 7)
    assert result["overlap_precision"] == pytest.approx((2 + 1) / 6)


def test_of_segments_that_fit_equally_well_that_with_more_points_is_assigned() -> None:
    truth = labels(20, 20, 30, 30, 30, 30, 30, 30, 30, 30, 1)
    found = measured(truth, labels(1, 0, 1, 1, 0, 0, 0, 0, 0, 0, 1))  # F 2/6 and 4/12
    assert found["overlap_recall"] == pytest.approx(2 / 10)


@pytest.mark.parametrize("seed", range(4))
def test_with_many_segments_the_assignment_is_that_of_a_linear_program(seed) -> None:
    rng = np.random.default_rng(seed)
    truth = rng.integers(20, 32, 3000).astype(np.uint32)
    found = np.where(rng.random(3000) < 0.3, truth - 15, rng.integers(0, 20, 3000)).astype(np.uint32)
    wanted = quality_oracle.measures(truth, found, np.ones(3000, bool), 1, 3000)
    assert measured(truth, found) == {n: None if v is None else pytest.approx(v) for n, v in wanted.items()}


def test_a_region_mostly_where_the_truth_is_unknown_is_neither_right_nor_false() -> None:
    truth = labels(0, 0, 0, 1, 1, 20, 20, 20)
    assert measured(truth, labels(2, 2, 2, 2, 2, 1, 1, 1))["precision_50"] == 1.0
    half = measured(truth, labels(0, 2, 2, 2, 2, 1, 1, 1))
    assert (half["precision_50"], half["false_objects"], half["overlap_precision"]) == (0.5, 1.0, pytest.approx(3 / 7))
    # One that an object has been assigned to counts with all of its points.
    assigned = measured(truth, labels(2, 2, 2, 0, 0, 2, 2, 0))
    assert (assigned["overlap_precision"], assigned["overlap_recall"]) == (pytest.approx(2 / 5), pytest.approx(2 / 3))
    assert (assigned["precision_50"], assigned["false_objects"]) == (None, 0.0)


def test_intersection_over_union_of_exactly_a_half_is_not_found() -> None:
    result = measured(labels(20, 20), labels(1, 2))
    assert (result["recall_50"], result["false_objects"]) == (0.0, 2.0)


def test_of_two_regions_that_cover_as_much_the_larger_counts() -> None:
    found = measured(labels(20, 20, 1), labels(1, 2, 2))
    assert (found["wov"], found["fus"]) == (pytest.approx(1 / 3), pytest.approx(1 / 2))


def test_invalid_points_do_not_count_whatever_their_label() -> None:
    truth, found = labels(20, 20, 30, 30), labels(1, 1, 0, 0)
    valid = np.array([True, True, False, False])
    assert measured(truth, found, valid) == measured(truth[:2], found[:2])
    truth[2:] = 0
    assert measured(truth, found, valid)["wov"] == 1.0


def test_what_is_not_defined_is_none() -> None:
    no_object = measured(labels(0, 1, 19), labels(0, 1, 1))
    known = {name: value for name, value in no_object.items() if value is not None}
    # Without an object nothing can be missed, but a region on the surroundings is a false one.
    wrong = {"overlap_precision": 0.0, "precision_50": 0.0, "precision_75": 0.0, "false_objects": 1.0}
    assert known == {"labelled": pytest.approx(2 / 3), **wrong}
    empty = measured(labels(), labels())
    assert empty == dict.fromkeys(MEASURES)
    no_edge = measured(labels(20, 20, 20, 20), labels(1, 1, 1, 1), height=2)
    assert no_edge["boundary_recall"] is None and no_edge["boundary_precision"] is None


def test_labels_as_large_as_the_type_allows() -> None:
    top = 2**32 - 1
    assert measured(labels(top, top, 20), labels(top, top, top - 1))["wov"] == 1.0


def test_arrays_of_different_lengths_are_refused() -> None:
    with pytest.raises(ValueError, match="3 true labels, 2 labels"):
        measure(labels(1, 2, 3), labels(1, 2), np.ones(2, bool))


def test_boundary_pixels_lie_on_both_sides_and_not_beside_invalid_ones() -> None:
    valid = np.ones((3, 4), bool)
    cells = grid(["aabb", "aabb", "aabb"])
    assert boundary(cells, valid).tolist() == [[False, True, True, False]] * 3
    valid[:, 1] = False
    assert not boundary(cells, valid).any()


@pytest.mark.parametrize(("shift", "recall"), [(0, 1.0), (1, 1.0), (2, 1.0), (3, 0.5), (4, 0.0)])
def test_boundaries_up_to_two_pixels_away_are_found(shift: int, recall: float) -> None:
    truth = grid(["a" * 8 + "b" * 8] * 6)
    found = grid(["a" * (8 + shift) + "b" * (8 - shift)] * 6)
    result = measured(truth.ravel(), found.ravel(), height=6)
    assert result["boundary_recall"] == result["boundary_precision"] == recall


def test_recall_and_precision_tell_too_few_boundaries_from_too_many() -> None:
    truth = grid(["aaaaabbbbb.....ccccc"] * 4).ravel()
    few = measured(truth, grid(["aaaaaaaaaa.....ccccc"] * 4).ravel(), height=4)
    assert few["boundary_recall"] == pytest.approx(2 / 3) and few["boundary_precision"] == 1.0
    # The extra boundary is 5 pixels from any other.
    many = measured(grid(["aaaaaaaaaabbbbbbbbbb"] * 4).ravel(), grid(["aaaaabbbbbcccccddddd"] * 4).ravel(), height=4)
    assert many["boundary_recall"] == 1.0 and many["boundary_precision"] == pytest.approx(1 / 3)


@pytest.mark.parametrize(("shift", "near"), [(0, 1.0), (1, 1.0), (2, 0.0)])
def test_outlines_of_objects_and_their_regions_may_be_a_share_of_the_diagonal_apart(shift: int, near: float) -> None:
    assert [tolerance(6, 21), tolerance(480, 640), tolerance(1080, 1920)] == [1, 3, 7]
    truth = grid(["." * 7 + "a" * 7 + "." * 7] * 6)
    found = grid(["." * (7 + shift) + "a" * 7 + "." * (7 - shift)] * 6)
    assert measured(truth.ravel(), found.ravel(), height=6)["boundary_f"] == near


def test_outlines_that_no_object_has_are_wrong_and_those_without_a_region_are_missed() -> None:
    truth = grid(["aabbbbaaaaccccaa"] * 2).ravel() - 20 + np.uint32(1)  # 1 is the table
    truth[truth > 1] += 20
    first, between = np.where(truth == 22, 7, 0), grid(["......cccc......"] * 2).ravel() // 22 * 8
    one = measured(truth, first.astype(np.uint32), height=2)
    assert one["boundary_f"] == pytest.approx(2 * 1.0 * 0.5 / 1.5)
    assert measured(truth, (first + between).astype(np.uint32), height=2)["boundary_f"] == pytest.approx(0.5)


@pytest.mark.parametrize("few", [1, 40, 2**22])
def test_counting_in_a_table_and_by_sorting_is_the_same(few: int, monkeypatch) -> None:
    monkeypatch.setattr(counting, "_FEW", few)
    rng = np.random.default_rng(3)
    truth, found = (rng.choice(labels(0, 3, 20, 39, 2**31), 500) for _ in range(2))
    counted = counting.contingency(truth, found)
    pairs = list(zip(counted.truths[counted.truth], counted.labels[counted.label], strict=True))
    wanted = Counter(zip(truth.tolist(), found.tolist(), strict=True))
    assert dict(zip(pairs, counted.count, strict=True)) == wanted and pairs == sorted(wanted)
    assert dict(zip(counted.truths, counted.truth_size, strict=True)) == Counter(truth.tolist())
    assert dict(zip(counted.labels, counted.label_size, strict=True)) == Counter(found.tolist())


# --- properties ---

ROWS, COLUMNS = 5, 7


def cells(*values: int) -> st.SearchStrategy[np.ndarray]:
    return hnp.arrays(np.uint32, ROWS * COLUMNS, elements=st.sampled_from(values))


truths = cells(0, 1, 3, 20, 21, 30)
segmentations = cells(0, 1, 2, 3, 40)
masks = hnp.arrays(np.bool_, ROWS * COLUMNS, elements=st.integers(0, 9).map(bool))


@given(truths, segmentations, masks)
@settings(deadline=None, max_examples=200)
def test_the_same_as_the_independent_implementation(truth, found, valid) -> None:
    for height, width in ((ROWS, COLUMNS), (1, ROWS * COLUMNS)):
        wanted = quality_oracle.measures(truth, found, valid, height, width)
        result = measure(truth, found, valid, height, width)
        assert result.keys() == wanted.keys()
        tied = quality_oracle.tied(truth, found, valid)
        for name, value in wanted.items():
            if name in ("boundary_f", "f75") and tied:
                continue  # of regions that fit equally well, any may be compared
            assert result[name] == (None if value is None else pytest.approx(value, abs=1e-12)), name


@given(truths, segmentations, masks)
@settings(deadline=None)
def test_bounds(truth, found, valid) -> None:
    result = {k: v for k, v in measure(truth, found, valid, ROWS).items() if v is not None}
    assert result.pop("fus", 0.0) >= 0.0
    assert -1.0 <= result.pop("ari", 0.0) <= 1.0
    assert result.pop("false_objects", 0.0) >= 0.0
    assert result.pop("spill", 0.0) >= 0.0 and result.pop("pieces", 0.0) >= 0.0
    assert all(0.0 <= value <= 1.0 for value in result.values())
    if "wov" in result:
        assert result["wov"] <= 1.0 - result["fos"] + 1e-12


@given(truths, masks)
@settings(deadline=None)
def test_a_perfect_segmentation(truth, valid) -> None:
    found = np.where(truth >= 20, truth, 0).astype(np.uint32)
    result = measure(truth, found, valid, ROWS)
    if not (valid & (truth >= 20)).any():
        assert result["wov"] is None
        return
    assert (result["wov"], result["fos"], result["fus"], result["ari"], result["asa"]) == (1.0, 0.0, 0.0, 1.0, 1.0)
    assert result["boundary_recall"] in (1.0, None) and result["boundary_precision"] in (1.0, None)
    assert result.pop("boundary_f") in (1.0, None) and result.pop("false_objects") == 0.0
    assert {result[name] for name in DETECTION[:-2]} == {1.0}


@given(truths, masks)
@settings(deadline=None)
def test_nothing_found_is_no_precision_and_no_recall(truth, valid) -> None:
    result = measure(truth, np.zeros_like(truth), valid, ROWS)
    assert (result["overlap_precision"], result["precision_50"], result["precision_75"]) == (None, None, None)
    assert result["false_objects"] == (0.0 if (valid & (truth > 0)).any() else None)
    missed = {result[name] for name in ("overlap_recall", "overlap_f", "f75", "recall_50", "recall_75")}
    assert missed == ({0.0} if (valid & (truth >= 20)).any() else {None})
    assert result["boundary_f"] in (0.0, None)


@given(truths, segmentations, masks)
@settings(deadline=None)
def test_whole_objects_are_those_of_labels_that_are_their_tens(truth, found, valid) -> None:
    tens = np.where(truth >= 20, truth // 10 * 10, truth).astype(np.uint32)
    assert measure(truth, found, valid, ROWS, reading=TruthReading(whole_objects=True)) == measure(
        tens, found, valid, ROWS
    )


@given(truths, segmentations, masks)
@settings(deadline=None)
def test_partial_truth_leaves_out_what_counts_false_objects_and_changes_nothing_else(truth, found, valid) -> None:
    whole, partial = measure(truth, found, valid, ROWS), measure(truth, found, valid, ROWS, reading=PARTIAL)
    assert all(partial[name] is None for name in NEEDS_ALL_OBJECTS)
    assert {**partial, **{name: whole[name] for name in NEEDS_ALL_OBJECTS}} == whole


@given(truths, segmentations, masks)
@settings(deadline=None)
def test_what_partial_truth_keeps_does_not_depend_on_regions_elsewhere(truth, found, valid) -> None:
    """A region without a point of an object may as well not be there."""
    touching = set(found[valid & (truth >= 20)].tolist())
    less = np.where(np.isin(found, list(touching)), found, 0).astype(np.uint32)
    kept, all_of_them = (measure(truth, labels, valid, ROWS, reading=PARTIAL) for labels in (less, found))
    for name in set(MEASURES) - {"labelled", "boundary_recall"}:
        assert kept[name] == all_of_them[name], name


@given(truths, segmentations, masks)
@settings(deadline=None)
def test_a_larger_threshold_finds_no_more_and_well_segmented_is_in_between(truth, found, valid) -> None:
    result = measure(truth, found, valid)
    if result["recall_50"] is not None:
        # F above 0.75 is intersection over union above 0.6.
        assert result["recall_75"] <= result["f75"] <= result["recall_50"]


@given(truths, segmentations, masks, st.permutations([1, 2, 3, 40]), st.permutations([20, 21, 30]))
@settings(deadline=None)
def test_names_of_labels_change_nothing(truth, found, valid, regions, objects) -> None:
    renamed_regions, renamed_objects = found.copy(), truth.copy()
    for old, new in zip([1, 2, 3, 40], regions, strict=True):
        renamed_regions[found == old] = new
    for old, new in zip([20, 21, 30], objects, strict=True):
        renamed_objects[truth == old] = new
    first = measure(truth, found, valid, ROWS)
    second = measure(renamed_objects, renamed_regions, valid, ROWS)
    if quality_oracle.tied(truth, found, valid):
        for name in ("boundary_f", "f75"):
            del first[name], second[name]
    assert second == {name: None if v is None else pytest.approx(v, abs=1e-12) for name, v in first.items()}


@given(truths, segmentations, masks, st.randoms(use_true_random=False))
@settings(deadline=None)
def test_the_order_of_points_changes_nothing(truth, found, valid, random) -> None:
    order = list(range(len(truth)))
    random.shuffle(order)
    assert measure(truth[order], found[order], valid[order]) == measure(truth, found, valid)


@pytest.mark.parametrize("seed", range(5))
def test_the_adjusted_rand_index_of_many_points_is_that_of_scikit_learn(seed) -> None:
    rng = np.random.default_rng(seed)
    truth = rng.integers(20, 40, 100_000).astype(np.uint32)
    found = np.where(rng.random(len(truth)) < 0.8, truth, rng.integers(0, 50, len(truth))).astype(np.uint32)
    assert measured(truth, found)["ari"] == pytest.approx(adjusted_rand_score(truth, found), abs=1e-12)
