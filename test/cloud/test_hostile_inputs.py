# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What may arrive, and which tests prove what the software does with it; those that no other file has are here."""

from __future__ import annotations

import ast
import tracemalloc

import numpy as np
import pytest
from clouds import TYPES, message
from places import TEST

from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.labeled import labeled_points
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.data import Cloud
from topo_region_seg.parameter_table import ParameterError
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

CODEC = "test_pointcloud2.py"
NODE = "test_ros_hostile.py::test_bad_clouds_are_rejected_with_a_reason"
ODD = "test_ros_hostile.py::test_odd_clouds_are_answered_as_the_pipeline_does"

PROOFS: dict[int, tuple[str, tuple[str, ...]]] = {
    1: ("sizes whose product is absurd or wraps", (f"{CODEC}::test_clouds_too_large_are_refused_at_once", NODE)),
    2: (
        "more points than max_points",
        (
            f"{CODEC}::test_clouds_too_large_are_refused_at_once",
            NODE,
            "test_hostile_inputs.py::test_a_cloud_over_max_points_is_thinned_where_that_is_wanted",
            "test_preprocessing.py::test_thinning_to_a_number_never_leaves_more",
            "test_ros_hostile.py::test_a_cloud_over_max_points_is_thinned_and_answered_whole",
        ),
    ),
    3: ("point_step 0 or too small", (f"{CODEC}::test_point_step_smaller_than_the_fields", NODE)),
    4: ("data cut short", (f"{CODEC}::test_data_cut_short", NODE)),
    5: ("data longer than needed", (f"{CODEC}::test_data_longer_than_needed", ODD)),
    6: ("stale row_step, packed data", (f"{CODEC}::test_stale_row_step_with_packed_data", ODD)),
    7: ("padded rows", (f"{CODEC}::test_reads_the_layouts_of_drivers", f"{CODEC}::test_last_row_without_padding", ODD)),
    8: ("row_step too small", (f"{CODEC}::test_small_row_step_that_does_not_fit_the_data", NODE)),
    9: ("no fields; x, y or z missing", (f"{CODEC}::test_missing_fields", NODE)),
    10: (
        "no color",
        (
            "test_pipeline.py::test_color_is_needed_unless_the_features_do_without",
            "test_tools.py::test_segment_without_color",
            "test_ros_node.py::test_a_cloud_without_color_is_rejected_until_color_is_not_needed",
        ),
    ),
    11: (
        "color as rgb, rgba, or r, g, b",
        (f"{CODEC}::test_reads_the_layouts_of_drivers", "test_drivers.py::test_the_same_scene_gives_the_same_regions"),
    ),
    12: (
        "datatype, count, duplicate, overlap, offset of a needed field",
        (
            f"{CODEC}::test_datatype_of_a_coordinate",
            f"{CODEC}::test_datatype_of_the_color",
            f"{CODEC}::test_count_of_zero",
            f"{CODEC}::test_duplicate_and_overlapping_fields",
            f"{CODEC}::test_offset_near_the_end_of_32_bits",
            NODE,
        ),
    ),
    13: ("unknown datatype that is not needed", (f"{CODEC}::test_fields_that_are_not_needed_may_be_anything", ODD)),
    14: ("absurd numbers of fields", (f"{CODEC}::test_absurd_fields_are_refused", NODE)),
    15: ("float64 coordinates", (f"{CODEC}::test_float64_beyond_float32_becomes_infinite", ODD)),
    16: ("integer coordinates", (f"{CODEC}::test_datatype_of_a_coordinate", NODE)),
    17: ("big-endian", (f"{CODEC}::test_reads_the_layouts_of_drivers", ODD)),
    18: ("packed color that is NaN as a float", (f"{CODEC}::test_color_that_is_nan_as_a_float", ODD)),
    19: (
        "coordinates that are not finite, whatever is_dense says",
        (
            "test_hostile_inputs.py::test_is_dense_is_ignored",
            "test_preprocessing.py::test_crop_drops_what_is_not_a_point",
        ),
    ),
    20: ("(0, 0, 0) as no depth", ("test_hostile_inputs.py::test_zeros_are_no_points_unless_they_are_wanted",)),
    21: (
        "no valid point; no point",
        (
            f"{CODEC}::test_empty_clouds",
            "test_hostile_inputs.py::test_nothing_valid_gives_an_empty_answer",
            "test_ros_node.py::test_an_empty_cloud_gets_an_empty_answer",
            "test_ros_node.py::test_a_cloud_without_a_valid_point_gets_label_0_everywhere",
        ),
    ),
    22: ("fewer points than neighbors", ("test_pipeline.py::test_tiny_and_invalid_clouds", ODD)),
    23: (
        "identical, collinear, coplanar, black, tiny",
        ("test_hostile_inputs.py::test_degenerate_clouds_are_finite_and_repeatable", ODD),
    ),
    24: ("huge coordinates, far outliers", ("test_hostile_inputs.py::test_far_points_change_nothing_near", ODD)),
    25: (
        "a dense ball",
        (
            "test_hostile_inputs.py::test_a_dense_ball_stays_small",
            "test_filtration.py::test_a_dense_ball_needs_little_memory",
        ),
    ),
    26: ("the same points shuffled", ("test_pipeline.py::test_shuffled_points_get_the_same_labels",)),
    27: (
        "size or organization changes",
        ("test_ros_hostile.py::test_size_organization_and_frame_may_change_from_cloud_to_cloud",),
    ),
    28: (
        "empty or changing frame_id",
        ("test_ros_hostile.py::test_size_organization_and_frame_may_change_from_cloud_to_cloud", ODD),
    ),
    29: ("nanosec of a second and more; stamp 0", (f"{CODEC}::test_stamp", NODE)),
    30: (
        "stamps going back or repeating",
        ("test_ros_hostile.py::test_stamps_may_go_back_repeat_and_be_zero_or_negative",),
    ),
    31: (
        "frames faster than processing",
        (
            "test_worker.py::test_the_newest_waiting_item_wins_and_displacement_is_told",
            "test_ros_node.py::test_the_newest_of_a_burst_wins_and_drops_are_counted",
            "test_ros_hostile.py::test_every_cloud_is_answered_dropped_or_rejected_even_when_the_input_closes",
        ),
    ),
    32: (
        "reliable, best-effort and incompatible publishers",
        (
            "test_ros_node.py::test_best_effort_publishers_are_heard_beside_reliable_ones",
            "test_ros_hostile.py::test_publishers_that_cannot_be_heard_are_named",
        ),
    ),
    33: (
        "invalid parameters",
        (
            "test_hostile_inputs.py::test_contradictory_parameters_name_their_values",
            "test_ros_node.py::test_invalid_parameters_are_rejected_with_the_reason",
            "test_ros_lifecycle.py::test_invalid_start_values_are_named_in_one_line",
        ),
    ),
    34: (
        "Ctrl-C in a frame; an exception in a frame",
        (
            "test_ros_lifecycle.py::test_a_signal_ends_the_node_cleanly",
            "test_ros_processor.py::test_an_exception_in_a_frame_is_counted_and_the_next_one_answered",
            "test_tools.py::test_replay_goes_on_after_an_error_in_a_frame",
            "test_tools.py::test_ctrl_c_keeps_what_is_done_and_leaves_nothing_torn",
        ),
    ),
    35: (
        "a recording cut short",
        (
            "test_bags.py::test_every_cut_of_a_recording",
            "test_bags.py::test_whole_messages_of_a_cut_chunk",
            "test_tools.py::test_replay_of_a_cut_recording",
        ),
    ),
    36: (
        "a bit flip in a chunk",
        ("test_bags.py::test_bit_flip_in_a_chunk", "test_tools.py::test_replay_of_a_damaged_recording"),
    ),
    37: (
        "what is no recording; split ones",
        (
            "test_bags.py::test_what_is_no_recording",
            "test_bags.py::test_folder_without_metadata_names_the_file_in_it",
            "test_bags.py::test_split_files_follow_in_the_order_of_the_metadata",
            "test_tools.py::test_recordings_that_cannot_be_used",
        ),
    ),
    38: (
        "log times not in order",
        (
            "test_bags.py::test_order_is_that_of_log_times",
            "test_bags.py::test_equal_log_times_keep_the_order_of_the_file",
        ),
    ),
    39: (
        "no, several or wrong topics",
        ("test_bags.py::test_several_topics_are_listed_ready_to_paste", "test_bags.py::test_topic_of_another_type"),
    ),
    40: (
        "a type of the right name with another layout",
        (
            "test_bags.py::test_type_of_the_right_name_with_another_layout",
            "test_bags.py::test_message_with_garbage_is_refused_and_the_rest_read",
            "test_ros_hostile.py::test_bytes_that_are_no_message_end_nothing",
        ),
    ),
    41: (
        "a chunk that claims a huge size",
        (
            "test_bags.py::test_chunk_that_claims_a_huge_size",
            "test_bags.py::test_chunk_that_holds_more_than_it_claims",
        ),
    ),
    42: (
        "outputs that cannot be written",
        (
            "test_bags.py::test_places_that_cannot_be_written",
            "test_bags.py::test_full_disk",
            "test_tools.py::test_replay_refuses_outputs_before_the_work",
            "test_cloud_files.py::test_outputs_are_checked_before_the_work",
            "test_killed.py::test_a_replay_killed_at_any_moment_leaves_no_torn_recording",
        ),
    ),
}


def test_every_kind_of_input_has_tests_that_exist() -> None:
    assert list(PROOFS) == list(range(1, 43))
    named = {proof for _, proofs in PROOFS.values() for proof in proofs}
    there = {
        f"{file.name}::{node.name}"
        for file in TEST.rglob("test_*.py")
        for node in ast.parse(file.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef)
    }
    assert named - there == set()


def colored(xyz: np.ndarray, value: int = 90) -> Cloud:
    xyz = np.ascontiguousarray(xyz, np.float32)
    return Cloud(xyz, np.full((len(xyz), 3), value, np.uint8), 1, len(xyz))


def patch(side: int = 30, step: float = 0.002) -> np.ndarray:
    x, y = (step * grid.ravel() for grid in np.meshgrid(np.arange(side), np.arange(side)))
    return np.column_stack([x, y, np.ones(side * side)])


@pytest.mark.parametrize("is_dense", [True, False])
def test_is_dense_is_ignored(is_dense: bool) -> None:
    xyz = patch().astype(np.float32)
    xyz[:3] = [[np.nan, 0, 1], [0, np.inf, 1], [0, 0, -np.inf]]
    msg = message(xyz, np.full((900, 3), 90, np.uint8), height=30)
    msg.is_dense = is_dense
    cloud = decode(msg, max_points=10**4)
    seg = Pipeline(Params()).run(cloud)
    assert (seg.labels[:3] == 0).all()
    assert (seg.labels[3:] == 1).all()
    assert not labeled_points(TYPES, Answer(msg, cloud, seg)).is_dense


def test_zeros_are_no_points_unless_they_are_wanted() -> None:
    xyz = patch() - [0.03, 0.03, 1.0]
    cloud = colored(np.concatenate([xyz, np.zeros((5, 3))]))
    params = Params(remove_floor=False)
    assert (Pipeline(params).run(cloud).labels[-5:] == 0).all()
    assert (Pipeline(params.replace(drop_zeros=False)).run(cloud).labels[-5:] == 1).all()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0])
def test_nothing_valid_gives_an_empty_answer(value: float) -> None:
    seg = Pipeline(Params()).run(colored(np.full((50, 3), value)))
    assert len(seg.regions) == 0
    assert (seg.labels == 0).all()


LINE = np.outer(np.arange(400), [0.001, 0.0005, 0.0]) + [0.0, 0.0, 1.0]
DEGENERATE = {
    "identical": np.ones((400, 3)),
    "duplicates": np.repeat(patch(12), 5, axis=0),
    "collinear": LINE,
    "plane": patch(),
    "tiny spacing": np.linspace([0, 0, 1], [1e-20, 1e-20, 1], 400),
    "denormal": 1e-40 * np.random.default_rng(0).random((400, 3)) + [0, 0, 1],
}


@pytest.mark.parametrize("name", DEGENERATE)
@pytest.mark.parametrize("brightness", [0, 128, 255])
@pytest.mark.parametrize("voxel_size", [0.0, 0.002])
def test_degenerate_clouds_are_finite_and_repeatable(name: str, brightness: int, voxel_size: float) -> None:
    cloud = colored(DEGENERATE[name], brightness)
    pipeline = Pipeline(Params(voxel_size=voxel_size, min_region_size=1))
    first, second = pipeline.run(cloud), pipeline.run(cloud)
    np.testing.assert_array_equal(first.labels, second.labels)
    table = first.regions
    for column in (table.centroid, table.minimum, table.maximum, table.mean_lab):
        assert np.isfinite(column).all()
    # What thinning leaves alone has no surface to be normal to.
    assert np.isfinite(table.mean_normal).all() or len(first.index) == 1
    # A line has no surface direction of its own, so its points may be one region or several; a patch is one.
    if name in ("plane", "duplicates"):
        assert len(table) == 1


def test_far_points_change_nothing_near() -> None:
    near = patch()
    far = np.array([[1e6, 0, 1e6], [1e30, 1e30, 1e30], [3e38, 3e38, 3e38], [0, 0, 9.99], [-1e15, 0, 1]])
    expected = Pipeline(Params()).run(colored(near)).labels
    for voxel_size in (0.0, 0.002, 1e-6):
        seg = Pipeline(Params(voxel_size=voxel_size)).run(colored(np.concatenate([near, far])))
        np.testing.assert_array_equal(seg.labels[: len(near)] > 0, expected > 0)
        assert (seg.labels[len(near) :][[0, 1, 2, 4]] == 0).all()


def test_a_dense_ball_stays_small() -> None:
    rng = np.random.default_rng(2)
    direction = rng.normal(size=(20_000, 3))
    radius = 0.008 * rng.random((20_000, 1)) ** (1 / 3)
    xyz = [0, 0, 1] + radius * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    pipeline = Pipeline(Params(voxel_size=0.0, remove_floor=False, angle_threshold=180.0))
    pipeline.run(colored(xyz[:100]))
    tracemalloc.start()
    try:
        seg = pipeline.run(colored(xyz))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert (seg.labels == 1).all()
    assert peak < 64e6, "a list of the 2e8 pairs would take gigabytes"


def test_a_cloud_over_max_points_is_thinned_where_that_is_wanted() -> None:
    xyz = np.concatenate([patch(60), patch(60) + [0.0, 0.3, 0.0], np.full((10, 3), np.nan), [[20.0, 0.0, 0.0]]])
    cloud = colored(xyz)
    free = Params(voxel_size=0.0, normal_radius=0.05, max_radius=0.03)
    params = free.replace(max_points=2000, over_max_points="thin")
    assert (params.point_limit, params.replace(over_max_points="reject").point_limit) == (8000, 2000)
    said: list[str] = []
    seg = Pipeline(params).run(cloud, lambda code, text: said.append(f"{code}: {text}"))
    assert 500 < len(seg.index) <= 2000
    np.testing.assert_array_equal(seg.labels, Pipeline(free).run(cloud).labels)
    assert seg.regions.size.tolist() == [3600, 3600], "counted in points of the input"
    (line,) = said
    assert line.startswith("thinned: of 7211 points, 7200 were left after the crop, more than max_points = 2000")
    assert f"thinned to {len(seg.index)} with voxels of " in line
    said.clear()
    Pipeline(params.replace(max_points=7200)).run(cloud, lambda code, text: said.append(text))
    Pipeline(free).run(cloud, lambda code, text: said.append(text))
    assert not said


def test_contradictory_parameters_name_their_values() -> None:
    with pytest.raises(ParameterError, match=r"min_range \(3.0\) is greater than max_range \(2.0\)"):
        Params(min_range=3.0, max_range=2.0)
    with pytest.raises(ParameterError, match="max_radius = nan"):
        Params(max_radius=float("nan"))
