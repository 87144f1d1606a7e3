# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The quality measures: by hand, by their properties, and against an independent implementation."""

from __future__ import annotations

import numpy as np
import pytest
import quality_oracle
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from sklearn.metrics import adjusted_rand_score

from topo_region_seg.offline.evaluation import MEASURES, measure
from topo_region_seg.offline.evaluation.boundaries import boundary


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
    assert [name for name, value in no_object.items() if value is not None] == ["labelled"]
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
        for name, value in wanted.items():
            assert result[name] == (None if value is None else pytest.approx(value, abs=1e-12)), name


@given(truths, segmentations, masks)
@settings(deadline=None)
def test_bounds(truth, found, valid) -> None:
    result = {k: v for k, v in measure(truth, found, valid, ROWS).items() if v is not None}
    assert result.pop("fus", 0.0) >= 0.0
    assert -1.0 <= result.pop("ari", 0.0) <= 1.0
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
