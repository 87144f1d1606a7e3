# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions at rest that noise divides, joins or shifts for a frame, in images and in lists of points."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from topo_region_seg.beyond.tracking.overlap import nearest_before
from topo_region_seg.beyond.tracking.steady_borders import regions_at_rest, split_off
from topo_region_seg.beyond.tracking.tracker import Tracker
from topo_region_seg.data import Cloud
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.segmentation import Segmentation

PARAMS = Params(track_regions=True, hold_regions=True, remove_floor=False, voxel_size=0.0)
COLORS = np.array([[200, 40, 40], [40, 200, 40], [40, 40, 200]])
APART, HOLD = 5, 10
"""Frames, as docs/tracking.md promises."""


def plane(color: np.ndarray, seed: int, organized: bool, shift: float = 0.0) -> tuple[Cloud, Segmentation]:
    """A plane with a color for each point of a grid of 4 mm, with noise and lost points; all `shift` (m) aside."""
    rng = np.random.default_rng(seed)
    rows, columns = np.mgrid[0 : color.shape[0], 0 : color.shape[1]]
    xyz = np.stack([0.004 * columns + shift, 0.004 * rows, np.ones(rows.shape)], axis=2)
    xyz = (xyz + rng.normal(scale=0.0002, size=xyz.shape)).astype(np.float32)
    xyz[rng.random(rows.shape) < 0.03] = np.nan
    height, width = color.shape if organized else (1, color.size)
    cloud = Cloud(xyz.reshape(-1, 3), COLORS[color.ravel()].astype(np.uint8), height, width)
    return cloud, Pipeline(PARAMS).run(cloud)


def colored(*ends: int) -> np.ndarray:
    """Colors of a grid (24, 60) in stripes that end at these columns."""
    stripe = np.searchsorted(np.array(ends), np.arange(60), side="right")
    return np.broadcast_to(stripe % 3, (24, 60)).copy()


def changed(before: Segmentation, after: Segmentation) -> float:
    both = (before.labels > 0) & (after.labels > 0)
    return float(np.mean(before.labels[both] != after.labels[both]))


@pytest.mark.parametrize("organized", [True, False])
def test_what_comes_off_a_region_at_rest_is_one_of_its_own_after_some_frames(organized: bool) -> None:
    tracker = Tracker()
    one, two = colored(60), colored(40, 60)
    frames = [tracker.follow(*plane(one, 0, organized), 0.0)]
    frames += [tracker.follow(*plane(two, stamp, organized), stamp) for stamp in range(1, APART + 2)]
    assert [len(seg.regions) for seg in frames] == [1] * (APART + 1) + [2]
    assert changed(*frames[-2:]) > 0.3
    for seg in frames:
        assert seg.regions.size.sum() == np.count_nonzero(seg.labels)


@pytest.mark.parametrize("organized", [True, False])
def test_noise_that_divides_and_joins_regions_changes_no_labels(organized: bool) -> None:
    tracker = Tracker()
    steady, divided, joined = colored(30, 60), colored(30, 45, 60), colored(60)
    stream = [steady, steady, divided, steady, joined, joined, divided, divided, steady, colored(31, 60), steady]
    frames = [tracker.follow(*plane(color, number, organized), number) for number, color in enumerate(stream)]
    assert all(len(seg.regions) == 2 for seg in frames)
    assert max(changed(a, b) for a, b in pairwise(frames)) < 0.01


@pytest.mark.parametrize("organized", [True, False])
def test_what_comes_off_a_region_that_moves_is_its_own_at_once(organized: bool) -> None:
    tracker = Tracker()
    tracker.follow(*plane(colored(60), 0, organized), 0.0)
    assert len(tracker.follow(*plane(colored(40, 60), 1, organized, shift=0.012), 1.0).regions) == 2


@pytest.mark.parametrize("organized", [True, False])
def test_nothing_is_held_where_the_camera_has_gone_elsewhere(organized: bool) -> None:
    tracker = Tracker()
    tracker.follow(*plane(colored(30, 60), 0, organized), 0.0)
    cloud, seg = plane(colored(60), 1, organized, shift=0.14)
    assert tracker.follow(cloud, seg, 1.0).regions.size.tolist() == seg.regions.size.tolist() != []


@pytest.mark.parametrize(("moved", "resting"), [((), [1, 2, 3]), ((1,), [1, 0, 3]), ((0, 1, 2), [0, 0, 0])])
def test_regions_are_at_rest_only_where_most_are(moved: tuple[int, ...], resting: list[int]) -> None:
    """By 3 mm: less than a region at rest may move, but more than all do while the camera is at rest."""
    region = np.repeat(np.arange(3), 50)
    xyz = np.random.default_rng(0).uniform(-0.01, 0.01, (150, 3)) + np.column_stack(
        [0.1 * region, 0 * region, 1 + 0 * region]
    )
    center = np.concatenate([[[np.nan] * 3], [xyz[region == r].mean(axis=0) for r in range(3)]])
    xyz[np.isin(region, moved)] += [0.003 if len(moved) == 3 else 0.006, 0.0, 0.0]
    assert regions_at_rest(region, region + 1, xyz, center).tolist() == resting


def test_lists_and_images_in_turn_begin_anew() -> None:
    tracker = Tracker()
    for number, organized in enumerate((True, False, True)):
        assert tracker.follow(*plane(colored(20, 60), number, organized), number).regions.label.tolist() == [1, 2]
    nothing = Cloud(np.full((1, 3), np.nan, np.float32), np.zeros((1, 3), np.uint8), 1, 1)
    empty = Pipeline(PARAMS).run(nothing, lambda code, text: None)
    for number, (cloud, seg) in enumerate(
        [plane(colored(60), 0, False), (nothing, empty), plane(colored(60), 1, False)]
    ):
        found = tracker.follow(cloud, seg, 10.0 + number)
        assert len(found.regions) == len(seg.regions)


def test_parts_of_a_former_region() -> None:
    region = np.array([0, 0, 0, 1, 1, 2, 2, 2, 3, -1])
    before = np.array([1, 1, 1, 1, 1, 2, 1, 2, 0, 1])
    main, origin = split_off(region, before, 4)
    assert main.tolist() == [-1, 0, -1, -1]
    assert origin.tolist() == [1, 1, 2, 0]


def test_the_nearest_point_of_the_frame_before() -> None:
    before = np.array([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0]])
    place, near = nearest_before(np.array([[0.09, 0.0, 1.0], [0.5, 0.0, 1.0]]), before, 0.02)
    assert (place.tolist(), near.tolist()) == ([1, 2], [True, False])
    assert nearest_before(np.empty((0, 3)), before, 1.0)[0].shape == (0,)
    assert nearest_before(before, np.empty((0, 3)), 1.0)[1].tolist() == [False, False]
