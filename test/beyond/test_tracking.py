# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels that stay with their regions over frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from topo_region_seg.beyond.tracking.tracker import Tracker
from topo_region_seg.data import Cloud
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.camera import orbit
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.segmentation import Segmentation

PARAMS = Params(track_regions=True, hold_regions=True, remove_floor=False, voxel_size=0.0)
LABELS_ONLY = PARAMS.replace(hold_regions=False)
COLORS = ((200, 40, 40), (40, 200, 40), (40, 40, 200), (200, 200, 40))
HOLD, MEMORY, WAIT = 10, 10, 3
"""Frames, as docs/tracking.md promises."""
Box = tuple[int, int, int, int, int]  # rows, columns, color


def frame(*boxes: Box, organized: bool = True) -> tuple[Cloud, Segmentation]:
    """Plane patches of a color each on a grid of 4 mm; nothing elsewhere."""
    rows, columns = np.mgrid[0:48, 0:64]
    xyz = np.stack([0.004 * columns, 0.004 * rows, np.ones(rows.shape)], axis=2).astype(np.float32)
    rgb = np.zeros((48, 64, 3), np.uint8)
    filled = np.zeros((48, 64), bool)
    for top, bottom, left, right, color in boxes:
        filled[top:bottom, left:right] = True
        rgb[top:bottom, left:right] = COLORS[color]
    xyz[~filled] = np.nan
    height, width = (48, 64) if organized else (1, 48 * 64)
    cloud = Cloud(xyz.reshape(-1, 3), rgb.reshape(-1, 3), height, width)
    return cloud, Pipeline(PARAMS).run(cloud)


A, B, C = (2, 22, 2, 22, 0), (2, 18, 40, 56, 1), (30, 42, 20, 40, 2)


def at(seg: Segmentation, box: Box) -> int:
    return int(seg.labels.reshape(48, 64)[(box[0] + box[1]) // 2, (box[2] + box[3]) // 2])


def permuted(seg: Segmentation, rng: np.random.Generator) -> Segmentation:
    table = np.concatenate([[0], 1 + rng.permutation(len(seg.regions))]).astype(np.uint32)
    regions = replace(seg.regions, label=table[seg.regions.label])
    return replace(seg, labels=table[seg.labels], regions=regions, point_labels=table[seg.point_labels])


@pytest.mark.parametrize("organized", [True, False])
def test_whatever_labels_the_frames_come_with(organized: bool) -> None:
    rng, tracker, plain = np.random.default_rng(0), Tracker(), Tracker()
    for shift in range(6):
        boxes = [(t + shift, b + shift, left, right, color) for t, b, left, right, color in (A, B, C)]
        cloud, seg = frame(*boxes, organized=organized)
        mixed = tracker.follow(cloud, permuted(seg, rng), shift)
        assert np.array_equal(mixed.labels, plain.follow(cloud, seg, shift).labels)
        assert [at(mixed, box) for box in boxes] == [1, 2, 3]


def test_the_partition_stays_and_rows_carry_their_labels() -> None:
    tracker = Tracker()
    for stamp, boxes in enumerate(((A, B, C), (B, C), (C, A), (A,))):
        cloud, seg = frame(*boxes)
        done = tracker.follow(cloud, seg, stamp)
        pairs = np.unique(np.stack([seg.labels, done.labels]), axis=1)
        assert len(np.unique(pairs[0])) == len(np.unique(pairs[1])) == pairs.shape[1]
        assert np.array_equal(done.labels == 0, seg.labels == 0)
        for row, label in enumerate(done.regions.label):
            assert done.regions[row].label == label
            assert np.count_nonzero(done.labels == label) == done.regions.size[row]
        assert set(done.barcode.label) <= {0, *done.regions.label}


@pytest.mark.parametrize(("gone", "same"), [(1, True), (MEMORY, True), (MEMORY + 1, False)])
def test_a_region_that_returns_within_memory_is_itself(gone: int, same: bool) -> None:
    tracker = Tracker()
    first = tracker.follow(*frame(A, B), 0.0)
    for stamp in range(gone):
        tracker.follow(*frame(A), 1.0 + stamp)
    back = tracker.follow(*frame(A, B), 100.0)
    assert at(back, A) == at(first, A)
    assert (at(back, B) == at(first, B)) is same
    if not same:
        assert at(back, B) > 2  # others have been free for longer


def test_the_bigger_part_keeps_the_label() -> None:
    tracker = Tracker()
    whole, big, small = (2, 22, 2, 42, 0), (2, 22, 2, 26, 0), (2, 22, 34, 42, 0)
    label = at(tracker.follow(*frame(whole), 0.0), whole)
    parts = tracker.follow(*frame(big, small), 1.0)
    assert at(parts, big) == label
    assert at(parts, small) > label


def test_what_has_become_one_is_held_apart_for_some_frames() -> None:
    tracker = Tracker()
    whole, big, small = (2, 22, 2, 42, 0), (2, 22, 2, 24, 0), (2, 22, 32, 42, 0)
    parts = tracker.follow(*frame(big, small), 0.0)
    for stamp in range(1, HOLD + 1):
        cloud, seg = frame(whole)
        held = tracker.follow(cloud, seg, stamp)
        assert (at(held, big), at(held, small)) == (at(parts, big), at(parts, small))
        assert len(seg.regions) == 1 and len(held.regions) == 2
        # What nothing was known of, in the middle, goes with what is nearest.
        assert set(held.labels[held.labels > 0]) == {at(parts, big), at(parts, small)}
        assert held.regions.size.sum() == seg.regions.size.sum()
    merged = tracker.follow(*frame(whole), HOLD + 1)
    assert at(merged, whole) == at(parts, big) and len(merged.regions) == 1, "the larger label stays"
    again = tracker.follow(*frame(big, small), HOLD + 2)
    assert (at(again, big), at(again, small)) == (at(parts, big), at(parts, small))


def test_what_is_seen_behind_a_thing_that_has_gone_has_not_joined_it() -> None:
    tracker = Tracker()
    cloud, seg = frame((2, 22, 2, 42, 0))
    forward = np.where(cloud.xyz[:, :1] > 0.11, cloud.xyz - np.float32([0.0, 0.0, 0.05]), cloud.xyz)
    before = replace(cloud, xyz=forward)
    parts = tracker.follow(before, Pipeline(PARAMS).run(before), 0.0)
    assert len(parts.regions) == 2
    assert len(tracker.follow(cloud, seg, 1.0).regions) == len(seg.regions) == 1


def test_a_border_at_rest_moves_when_it_has_done_so_for_some_frames() -> None:
    tracker = Tracker()
    left, right = (2, 22, 2, 22, 0), (2, 22, 22, 42, 1)
    wide, narrow = (2, 22, 2, 24, 0), (2, 22, 24, 42, 1)
    others = (30, 46, 2, 18, 1), (30, 46, 26, 42, 1), (30, 46, 50, 62, 1)  # by which the camera is seen to be at rest
    first = tracker.follow(*frame(left, right, *others), 0.0)
    strip = np.s_[2:22, 22:24]
    for stamp in range(1, WAIT):
        cloud, seg = frame(wide, narrow, *others)
        held = tracker.follow(cloud, seg, stamp)
        assert (held.labels.reshape(48, 64)[strip] == at(first, right)).all()
        assert held.regions.size.sum() == seg.regions.size.sum()
        for row, label in enumerate(held.regions.label):
            assert np.count_nonzero(held.labels == label) == held.regions.size[row]
    over = tracker.follow(*frame(wide, narrow, *others), WAIT)
    assert (over.labels.reshape(48, 64)[strip] == at(first, left)).all()


def test_a_border_that_moves_with_its_regions_is_not_held() -> None:
    tracker = Tracker()
    first = tracker.follow(*frame((2, 22, 2, 22, 0), (2, 22, 22, 42, 1)), 0.0)
    cloud, seg = frame((2, 22, 6, 26, 0), (2, 22, 26, 46, 1))
    moved = tracker.follow(cloud, seg, 1.0)
    assert (moved.labels.reshape(48, 64)[2:22, 22:26] == at(first, (2, 22, 2, 22, 0))).all()


def test_another_thing_at_another_place_is_new() -> None:
    tracker = Tracker()
    tracker.follow(*frame(A), 0.0)
    assert at(tracker.follow(*frame(C), 1.0), C) == 2


def test_starts_again_where_time_jumps_back_or_it_was_off() -> None:
    tracker = Tracker()
    tracker.follow(*frame(A, B, C), 5.0)
    assert at(tracker.follow(*frame(C), 4.0), C) == 1
    tracker.follow(*frame(A, B, C), 5.0)
    cloud, seg = frame(B)
    off = replace(seg, params=PARAMS.replace(track_regions=False))
    assert tracker.follow(cloud, off, 6.0) is off
    assert at(tracker.follow(cloud, seg, 7.0), B) == 1


def test_nothing_to_track() -> None:
    tracker = Tracker()
    assert not tracker.follow(*frame(), 0.0).labels.any()
    assert at(tracker.follow(*frame(A), 1.0), A) == 1
    assert not tracker.follow(*frame(), 2.0).labels.any()
    assert at(tracker.follow(*frame(A), 3.0), A) == 1


def labels_only(seg: Segmentation) -> Segmentation:
    return replace(seg, params=LABELS_ONLY)


def test_with_labels_alone_the_regions_are_those_of_the_frame() -> None:
    tracker, plain = Tracker(), Pipeline(PARAMS.replace(track_regions=False, hold_regions=False))
    scene, camera = tabletop(1), Camera.kinect(160, 120)
    renamed = False
    for stamp, view in enumerate(orbit(camera, 6)):
        cloud = simulate(scene, view, stamp).cloud
        alone, seg = plain.run(cloud), Pipeline(LABELS_ONLY).run(cloud)
        done = tracker.follow(cloud, seg, stamp)
        table = np.zeros(len(alone.regions) + 1, np.uint32)
        table[alone.regions.label] = done.regions.label
        assert len(np.unique(table)) == len(table)
        assert np.array_equal(done.labels, table[alone.labels])
        assert np.array_equal(done.barcode.label, table[alone.barcode.label])
        for name, column in vars(alone.regions).items():
            assert name == "label" or np.array_equal(getattr(done.regions, name), column, equal_nan=True)
        assert np.array_equal(done.barcode.death, alone.barcode.death)
        renamed |= not np.array_equal(done.labels, alone.labels)
    assert renamed


def test_with_labels_alone_regions_that_become_one_are_one() -> None:
    tracker = Tracker()
    whole, big, small = (2, 22, 2, 42, 0), (2, 22, 2, 24, 0), (2, 22, 32, 42, 0)
    cloud, seg = frame(big, small)
    label = at(tracker.follow(cloud, labels_only(seg), 0.0), big)
    cloud, seg = frame(whole)
    done = tracker.follow(cloud, labels_only(seg), 1.0)
    assert done.regions.label.tolist() == [label]


def test_holding_ends_when_it_is_turned_off() -> None:
    tracker = Tracker()
    whole, big, small = (2, 22, 2, 42, 0), (2, 22, 2, 24, 0), (2, 22, 32, 42, 0)
    tracker.follow(*frame(big, small), 0.0)
    cloud, seg = frame(whole)
    assert len(tracker.follow(cloud, seg, 1.0).regions) == 2
    assert len(tracker.follow(cloud, labels_only(seg), 2.0).regions) == 1


def test_another_frame_id_or_image_size_begins_a_new_stream() -> None:
    tracker = Tracker()
    tracker.follow(*frame(A, B, C), 0.0, "left")
    assert at(tracker.follow(*frame(C), 1.0, "left"), C) == 3
    assert at(tracker.follow(*frame(C), 2.0, "right"), C) == 1
    tracker.follow(*frame(A, B, C), 3.0, "right")
    assert at(tracker.follow(*frame(B), 4.0, "right"), B) == 3
    cloud, seg = frame(B)
    assert at(tracker.follow(replace(cloud, height=96, width=32), seg, 5.0, "right"), B) == 1
    tracker.follow(replace(cloud, height=96, width=32), frame(A, B, C)[1], 6.0, "right")
    row_by_row = replace(cloud, height=1, width=len(cloud))
    assert at(tracker.follow(row_by_row, frame(A)[1], 7.0, "right"), A) == 1


def test_the_same_stamp_again_is_the_same_stream() -> None:
    tracker = Tracker()
    tracker.follow(*frame(A, B, C), 0.0)
    assert at(tracker.follow(*frame(C), 0.0), C) == 3


def test_two_streams_do_not_mix() -> None:
    one, other, alone = Tracker(), Tracker(), Tracker()
    for stamp, boxes in enumerate(((A, B, C), (C,), (B, C), (A, C))):
        cloud, seg = frame(*boxes)
        other.follow(*frame(*boxes[::-1][:1], (30, 44, 50, 60, 3)), 10.0 - stamp)
        assert np.array_equal(one.follow(cloud, seg, stamp).labels, alone.follow(cloud, seg, stamp).labels)


def test_a_region_hidden_for_some_frames_comes_back_beside_one_alike() -> None:
    tracker = Tracker()
    one, alike = (2, 18, 2, 18, 0), (2, 18, 26, 42, 0)
    first = tracker.follow(*frame(one, alike), 0.0)
    for stamp in range(1, 6):
        tracker.follow(*frame(alike), stamp)
    back = tracker.follow(*frame(one, alike), 6.0)
    assert (at(back, one), at(back, alike)) == (at(first, one), at(first, alike))


def test_regions_alike_that_gain_speed_are_looked_for_where_they_should_be() -> None:
    """In the end each has moved nearer to the place of the next one than to its own, and overlaps neither."""
    tracker, left = Tracker(), 0
    columns = (2, 18, 34)
    labels = []
    for stamp, step in enumerate((0, 2, 4, 6, 9, 9)):
        left += step
        boxes = [(2, 22, left + column, left + column + 5, 0) for column in columns]
        done = tracker.follow(*frame(*boxes), stamp)
        labels.append([at(done, box) for box in boxes if box[3] <= 64])
    assert all(later == labels[0][: len(later)] for later in labels)


@pytest.mark.parametrize("colors", [(0, 1), (1, 0)])
def test_regions_that_change_places_between_frames_are_told_apart_by_color(colors: tuple[int, int]) -> None:
    """Each lies nearer to where the other one was, and overlaps neither."""
    tracker = Tracker()
    first, second = (2, 10, 2, 10, colors[0]), (2, 10, 20, 28, colors[1])
    before = tracker.follow(*frame(first, second), 0.0)
    moved = (16, 24, 15, 23, colors[0]), (16, 24, 2, 10, colors[1])
    after = tracker.follow(*frame(*moved), 1.0)
    assert [at(after, box) for box in moved] == [at(before, first), at(before, second)]
