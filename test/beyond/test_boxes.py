# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Oriented boxes: known boxes are found again, however they are turned and whatever is seen of them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from topo_region_seg.beyond.boxes.extents import BINS, STRAY
from topo_region_seg.beyond.boxes.oriented import OrientedBoxes, oriented_boxes, quaternions
from topo_region_seg.beyond.boxes.rectangles import convex_hull, smallest_rectangle

MM, DEGREES = 0.001, np.pi / 180
UP = np.array([0.0, 0.0, 1.0])


class Regions(SimpleNamespace):
    def __len__(self) -> int:
        return len(self.label)


def segmented(clouds: list[np.ndarray], plane: Any = None, labels: list[int] | None = None) -> Any:
    """Return what boxes need of a segmentation whose regions are these points."""
    labels = labels or list(range(1, len(clouds) + 1))
    label = np.repeat(np.array(labels, np.uint32), [len(cloud) for cloud in clouds])
    xyz = np.concatenate([*clouds, np.full((50, 3), 9.0)])
    return SimpleNamespace(
        points=xyz,
        point_labels=np.append(label, np.zeros(50, np.uint32)),
        regions=Regions(label=np.array(labels, np.uint32)),
        plane=plane,
        filtered=SimpleNamespace(sensor=np.zeros(3)),
    )


def boxes_of(clouds: list[np.ndarray], up: Any = None, **given: Any) -> OrientedBoxes:
    return oriented_boxes(segmented(clouds, **given), up)


def sampled_box(size: np.ndarray, faces: list[tuple[int, int]], step: float = 0.0025) -> np.ndarray:
    """Return points on faces (axis, side) of a box around the origin, edges included."""
    parts = []
    for axis, side in faces:
        a, b = (axis + 1) % 3, (axis + 2) % 3
        grid = [np.linspace(-size[c] / 2, size[c] / 2, int(size[c] / step) + 2) for c in (a, b)]
        points = np.empty((len(grid[0]) * len(grid[1]), 3))
        points[:, a], points[:, b] = (values.ravel() for values in np.meshgrid(*grid))
        points[:, axis] = side * size[axis] / 2
        parts.append(points)
    return np.concatenate(parts)


ALL = [(axis, side) for axis in range(3) for side in (-1, 1)]
sizes = st.tuples(*[st.floats(0.03, 0.3)] * 3).map(np.array)
seeds = st.integers(0, 2**32 - 1)


def visible(center: np.ndarray, rotation: np.ndarray) -> list[tuple[int, int]]:
    """Return the faces that a sensor at the origin sees."""
    toward = rotation.T @ -center
    return [(axis, 1 if toward[axis] > 0 else -1) for axis in range(3)]


def turn_between(found: np.ndarray, true: np.ndarray) -> float:
    """Return the largest angle between a true axis and the nearest found one, whichever way they point."""
    return float(np.arccos(np.clip(np.abs(true.T @ found).max(axis=1), 0.0, 1.0)).max())


def assert_is(boxes: OrientedBoxes, center: np.ndarray, rotation: np.ndarray, size: np.ndarray) -> None:
    assert np.abs(np.linalg.norm(boxes.center[0] - center)) < 5 * MM
    np.testing.assert_allclose(np.sort(boxes.size[0]), np.sort(size), atol=5 * MM)
    assert turn_between(boxes.axes[0], rotation) < 2 * DEGREES


@pytest.mark.parametrize("seen", ["all faces", "three faces"])
@given(sizes, seeds)
@settings(deadline=None, max_examples=60)
def test_a_box_in_any_pose_is_found_again(seen: str, size: np.ndarray, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rotation, center = Rotation.random(random_state=seed % 2**31).as_matrix(), rng.uniform(-1, 1, 3) + [0, 0, 2]
    faces = ALL if seen == "all faces" else visible(center, rotation)
    boxes = boxes_of([sampled_box(size, faces) @ rotation.T + center])
    assert_is(boxes, center, rotation, size)
    assert (np.diff(boxes.size[0]) <= 0).all(), "the longest side first"
    assert boxes.axes[0, :, 2] @ boxes.center[0] <= 0.0, "z points to the side of the sensor"


@pytest.mark.parametrize("seen", ["all faces", "three faces", "two sides"])
@given(sizes, st.floats(-3.2, 3.2), seeds)
@settings(deadline=None, max_examples=60)
def test_an_upright_box_is_found_again(seen: str, size: np.ndarray, yaw: float, seed: int) -> None:
    tilt = Rotation.random(random_state=seed % 2**31).as_matrix()  # what is up in the frame of the sensor
    turn = Rotation.from_rotvec(yaw * UP).as_matrix()
    center = np.array([0.1, -0.3, 1.2])
    faces = {"all faces": ALL, "three faces": [(0, 1), (1, -1), (2, 1)], "two sides": [(0, 1), (1, -1)]}[seen]
    boxes = boxes_of([(sampled_box(size, faces) @ turn.T + center) @ tilt.T], 3.0 * tilt @ UP)
    assert_is(boxes, tilt @ center, tilt @ turn, size)
    np.testing.assert_allclose(boxes.axes[0, :, 2], tilt @ UP, atol=1e-12)
    assert boxes.size[0, 0] >= boxes.size[0, 1]
    assert abs(boxes.size[0, 2] - size[2]) < 5 * MM, "z is the height"


def test_up_is_the_normal_of_the_support_unless_it_is_given() -> None:
    cloud = sampled_box(np.array([0.2, 0.1, 0.05]), ALL) @ Rotation.from_rotvec([0.0, 0.3, 0.2]).as_matrix().T
    plane = SimpleNamespace(normal=(0.0, 0.6, 0.8), offset=1.0)
    np.testing.assert_allclose(boxes_of([cloud], plane=plane).axes[0, :, 2], [0.0, 0.6, 0.8], atol=1e-12)
    np.testing.assert_allclose(boxes_of([cloud], [0, 0, 2], plane=plane).axes[0, :, 2], UP, atol=1e-12)


@pytest.mark.parametrize("up", [(0, 0, 0), (0, 0), (0, 0, np.nan), (np.inf, 0, 0)])
def test_an_up_that_is_no_direction_is_refused(up: Any) -> None:
    with pytest.raises(ValueError, match="three finite numbers"):
        boxes_of([np.zeros((3, 3))], up)


shapes = st.integers(1, 40).flatmap(lambda n: st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=n, max_size=n))


@pytest.mark.parametrize("up", [None, (0.0, 0.6, -0.8)])
@given(st.lists(shapes, min_size=0, max_size=4))
@settings(deadline=None, max_examples=80)
def test_few_points_of_any_kind_lie_in_their_boxes(up: Any, parts: list[list[tuple[float, ...]]]) -> None:
    clouds = [np.array(part) for part in parts]
    boxes = boxes_of(clouds, up)
    assert len(boxes) == len(clouds)
    for r, cloud in enumerate(clouds):
        axes = boxes.axes[r]
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-9)
        assert np.linalg.det(axes) > 0.0, "a rotation"
        local = (cloud - boxes.center[r]) @ axes
        np.testing.assert_allclose(local.max(axis=0) - local.min(axis=0), boxes.size[r], atol=1e-9)
        np.testing.assert_allclose(local.max(axis=0), boxes.size[r] / 2, atol=1e-9)
        turned = Rotation.from_quat(boxes.quaternion[r]).as_matrix()
        np.testing.assert_allclose(turned, axes, atol=1e-9)
        assert boxes.quaternion[r, 3] >= 0.0


@pytest.mark.parametrize("up", [None, (0.1, 0.7, 0.7)])
@given(seeds, st.floats(0.2, 5.0))
@settings(deadline=None, max_examples=30)
def test_boxes_move_and_grow_with_the_points_and_do_not_know_their_order(up: Any, seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    rotation = Rotation.random(random_state=seed % 2**31).as_matrix()
    if up is not None:  # standing; of a box that leans several upright ones are about as small
        z = np.array(up) / np.linalg.norm(up)
        x = np.cross(rotation[:, 1], z) / np.linalg.norm(np.cross(rotation[:, 1], z))
        rotation = np.column_stack([x, np.cross(z, x), z])
    cloud = sampled_box(np.array([0.21, 0.13, 0.06]), [(0, 1), (1, 1), (2, 1)], 0.01) @ rotation.T + [0, 0, 1.5]
    first = boxes_of([cloud], up)
    moved = boxes_of([rng.permutation(cloud) * scale + [0.3, -0.2, 0.4]], up)
    np.testing.assert_allclose(moved.size, scale * first.size, rtol=0.01)
    assert np.linalg.norm(moved.center[0] - (scale * first.center[0] + [0.3, -0.2, 0.4])) < 5 * MM * scale
    assert turn_between(moved.axes[0], first.axes[0]) < DEGREES


def test_each_region_has_the_box_of_its_own_points_whatever_its_label() -> None:
    rng = np.random.default_rng(3)
    clouds = [rng.normal(size=(n, 3)) * [0.1, 0.05, 0.02] + [n, 0, 0] for n in (40, 7, 300)]
    together = boxes_of(clouds, labels=[7, 2, 60_000])
    assert together.label.tolist() == [7, 2, 60_000]
    for r, cloud in enumerate(clouds):
        alone = boxes_of([cloud])
        for name in ("center", "axes", "size"):
            np.testing.assert_array_equal(getattr(together, name)[r], getattr(alone, name)[0])


def test_strays_do_not_stretch_a_box() -> None:
    size, rng = np.array([0.2, 0.15, 0.1]), np.random.default_rng(0)
    cloud = sampled_box(size, ALL)
    strays = rng.uniform(0.15, 0.2, (int(STRAY * len(cloud)), 3))
    boxes = boxes_of([np.concatenate([cloud, strays * [1, 0.2, 0.1]])], UP)
    assert boxes.size[0, 0] < size[0] + 0.1 / BINS + MM


def test_a_flat_region_is_boxed_along_its_surface_although_it_is_noisy() -> None:
    rng = np.random.default_rng(0)
    rotation = Rotation.from_rotvec([0.4, -0.3, 0.9]).as_matrix()
    sheet = rng.uniform(-1, 1, (4000, 3)) * [0.1, 0.06, 0.0] + rng.normal(size=(4000, 3)) * [0, 0, 0.002]
    boxes = boxes_of([sheet @ rotation.T + [0, 0, 1.0]])
    assert np.abs(boxes.axes[0, :, 2] @ rotation[:, 2]) > np.cos(DEGREES)
    assert turn_between(boxes.axes[0], rotation) < 4 * DEGREES


planar = st.lists(st.tuples(st.integers(-6, 6), st.integers(-6, 6)), min_size=1, max_size=25)


@given(planar)
@settings(deadline=None)
def test_the_hull_is_that_of_qhull_and_the_rectangle_the_smallest_of_all_angles(points: list[tuple[int, int]]) -> None:
    places = np.array(points, np.float64)
    hull = convex_hull(places)
    x, y, size = smallest_rectangle(places, 0.0)
    assert np.hypot(x, y) == pytest.approx(1.0)
    angles = np.arange(0.0, 90.0, 0.25) * DEGREES
    turned = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    along, across = places @ turned.T, places @ np.column_stack([-turned[:, 1], turned[:, 0]]).T
    assert size <= (np.ptp(along, axis=0) * np.ptp(across, axis=0)).min() + 1e-9
    if np.linalg.matrix_rank(places - places[0]) == 2:
        oracle = places[ConvexHull(places).vertices]
        assert {tuple(p) for p in hull} == {tuple(p) for p in oracle}
    else:
        assert size == pytest.approx(0.0, abs=1e-9)


def test_quaternions_of_half_turns_too() -> None:
    turns = np.concatenate([Rotation.random(200, random_state=1).as_matrix(), *[np.diag(d)[None] for d in
                            ([1.0, 1, 1], [1.0, -1, -1], [-1.0, 1, -1], [-1.0, -1, 1])]])  # fmt: skip
    np.testing.assert_allclose(Rotation.from_quat(quaternions(turns)).as_matrix(), turns, atol=1e-12)
