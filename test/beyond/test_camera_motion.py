# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Tracking with a camera whose motion is known: what is at rest is found where it is, wherever it is in the image."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from topo_region_seg.beyond.tracking.motion import camera_motion, inverse, moved_points, seen_from_here
from topo_region_seg.beyond.tracking.overlap import seen_in
from topo_region_seg.beyond.tracking.tracker import Tracker
from topo_region_seg.cloud.placing import Transform
from topo_region_seg.data import Cloud
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.segmentation import Segmentation

PARAMS = Params(max_radius=0.02, track_regions=True, remove_floor=False, voxel_size=0.0)
PERIOD = 0.12
"""Distance of the patches, metres."""
COLORS = np.array([(200, 40, 40), (40, 200, 40)], np.uint8)


def wall(shift: float, organized: bool = True, *, towards: float = 0.0) -> tuple[Cloud, Segmentation, list[int]]:
    """What a camera sees of a row of patches on a wall at 1 m, all alike, from `shift` metres to the right of it.

    The last result is the number of the patch at each pixel, -1 for none. The base does not move.
    """
    u, v = np.meshgrid(np.arange(96), np.arange(64))
    depth = 1.0 - towards
    xyz = np.stack([(u - 47.5) / 120.0 * depth, (v - 31.5) / 120.0 * depth, np.full(u.shape, depth)], axis=2)
    across = xyz[..., 0] + shift
    patch = np.floor(across / PERIOD).astype(int)
    inside = (across - PERIOD * patch < 0.08) & (np.abs(xyz[..., 1]) < 0.1)
    xyz[~inside] = np.nan
    rgb = np.broadcast_to(COLORS[0], (64, 96, 3)).reshape(-1, 3).copy()
    height, width = (64, 96) if organized else (1, 64 * 96)
    # The origin of the base's frame is where the camera was before it moved.
    pose = (-shift, 0.0, -towards, 1.0, 0.0, 0.0, 0.0)
    cloud = Cloud(xyz.reshape(-1, 3).astype(np.float32), rgb, height, width, base_pose=pose)
    return cloud, Pipeline(PARAMS).run(cloud), np.where(inside, patch, -1).ravel().tolist()


def labels_of_patches(seg: Segmentation, patch: list[int]) -> dict[int, int]:
    pairs = {(one, label) for one, label in zip(patch, seg.labels.tolist(), strict=True) if one >= 0 and label}
    found = dict(pairs)
    assert len(found) == len(pairs)
    return found


@pytest.mark.parametrize("organized", [True, False])
def test_patches_alike_keep_their_labels_where_the_camera_moves_by_their_distance(organized: bool) -> None:
    followed, blind = Tracker(), Tracker()
    seen, guessed = [], []
    for stamp in range(3):
        cloud, seg, patch = wall(PERIOD * stamp, organized)
        seen.append(labels_of_patches(followed.follow(cloud, seg, stamp), patch))
        unknown = replace(cloud, base_pose=None)
        guessed.append(labels_of_patches(blind.follow(unknown, seg, stamp), patch))
    for before, now in pairwise(seen):
        both = set(before) & set(now)
        assert len(both) >= 3 and all(before[one] == now[one] for one in both)
        assert not {now[one] for one in set(now) - both} & set(before.values())
    both = set(guessed[0]) & set(guessed[1])
    assert any(guessed[0][one] != guessed[1][one] for one in both), "in the image each is where another one was"


def test_the_frame_before_is_seen_from_where_the_camera_is_now() -> None:
    before, seg_before, patch_before = wall(0.0)
    now, seg, patch = wall(0.05, towards=0.1)
    motion = camera_motion((None, before.base_pose), (None, now.base_pose))
    assert motion is not None
    seen, place = seen_from_here(seen_in(before, seg_before), now, np.flatnonzero(seg.labels), motion, 0.02)
    known = np.flatnonzero(seen.row)
    assert len(known) > 0.8 * np.count_nonzero(seg.labels)
    assert np.array_equal(np.array(patch)[known], np.array(patch_before)[place[known]])
    # Half a pixel is 4 mm here.
    np.testing.assert_allclose(seen.cloud_xyz[known], now.xyz[known], atol=0.0045)


def test_what_another_thing_hid_is_not_known() -> None:
    before, seg_before, _ = wall(0.0)
    now, seg, _ = wall(0.05)
    nearer = replace(before, xyz=before.xyz * np.float32(0.9))
    motion = camera_motion((None, before.base_pose), (None, now.base_pose))
    assert motion is not None
    seen, _ = seen_from_here(seen_in(nearer, seg_before), now, np.flatnonzero(seg.labels), motion, 0.02)
    assert not seen.row.any()


def test_motion_is_that_of_the_base_and_else_of_the_sensor_in_a_frame_at_rest() -> None:
    rng = np.random.default_rng(3)
    first, second = (Transform(Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3)) for seed in (1, 2))
    in_base = rng.normal(size=(5, 3))
    motion = camera_motion((None, first.pose), (None, second.pose))
    assert motion is not None
    np.testing.assert_allclose(moved_points(moved_points(in_base, first), motion), moved_points(in_base, second))
    np.testing.assert_allclose(moved_points(moved_points(in_base, motion), inverse(motion)), in_base)
    # The frame of the clouds is at rest, and the sensor moves in it, alone or with a robot.
    for base in ((None, None), (first.pose, second.pose), (first.pose, first.pose)):
        still = camera_motion((first.pose, base[0]), (second.pose, base[1]))
        assert still is not None
        np.testing.assert_array_equal(moved_points(in_base, still), in_base)


@pytest.mark.parametrize(
    ("before", "now"),
    [
        ((None, None), (None, None)),
        ((None, (0.0,) * 3 + (1.0, 0.0, 0.0, 0.0)), (None, None)),
        ((None, (0.0,) * 3 + (1.0, 0.0, 0.0, 0.0)), (None, (0.0005, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))),
        (((1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0), None), ((1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0), None)),
    ],
    ids=["unknown", "lost", "trembles", "at rest"],
)
def test_a_camera_that_is_not_known_to_move_is_at_rest(before: tuple, now: tuple) -> None:
    assert camera_motion(before, now) is None
