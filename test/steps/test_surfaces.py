# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Surfaces of a frame: what carries things is the support, walls are structure, and none are invented."""

from __future__ import annotations

import numpy as np
import pytest
from frames import GRAY, TOP, Frame, box, kinect, looking, on_table

from topo_region_seg.offline.simulation import Body, Camera, Scene, Sphere
from topo_region_seg.steps.support.ground import MOST_MARGIN, margins, scene_of
from topo_region_seg.steps.support.surfaces import find_surfaces
from topo_region_seg.steps.view.scene import BEHIND, FREE, NOTHING, STRUCTURE, SUPPORT
from topo_region_seg.steps.view.scene import Scene as Seen

CAMERA = Camera.kinect(320, 240)
LEAST = 0.004
TABLE, FLOOR, WALL, LEG = range(4)
BOXES = on_table(box(0.0, 0.0), box(0.1, 0.3))


def seen(frame: Frame) -> Seen:
    surfaces = find_surfaces(frame.grid, frame.model, 0.3, 0)
    return scene_of(frame.grid, frame.model, surfaces, LEAST, exact=False, axes=np.eye(3))


def share(scene: Seen, of: np.ndarray, kind: int) -> float:
    return float(np.mean(scene.classes[of] == kind))


LEVEL = CAMERA.look((-1.0, 0.0, 1.3), (0.3, 0.0, 0.9))


@pytest.mark.parametrize("camera", [CAMERA, CAMERA.look((-0.9, 0.5, 1.5)), LEVEL], ids=["front", "corner", "level"])
def test_the_table_is_the_support_and_not_the_wall(camera) -> None:
    frame = looking(camera, BOXES)
    scene = seen(frame)
    assert scene.support is not None
    up = camera.rotation[2]
    assert scene.support.normal @ up > np.cos(np.radians(1.0))
    assert scene.support.offset == pytest.approx(camera.eye[2] - TOP, abs=0.005)
    assert share(scene, frame.body == TABLE, SUPPORT) > 0.95
    assert share(scene, frame.body == FLOOR, BEHIND) > 0.97
    assert share(scene, frame.body >= 4, FREE) > 0.9
    if camera is LEVEL:  # what is lower than the table is behind it
        wall = frame.body == WALL
        assert wall.mean() > 1.5 * (frame.body == TABLE).mean()
        assert share(scene, wall, FREE) < 0.05 and share(scene, wall, STRUCTURE) > 0.5


def test_where_up_is_known_it_decides_which_surface_carries_things() -> None:
    """Whatever way the image is turned: the wall would be the floor if up were towards the camera."""
    frame = looking(LEVEL, BOXES)
    surfaces = find_surfaces(frame.grid, frame.model, 0.3, 0)
    up = LEVEL.rotation[2]
    towards = LEVEL.rotation.T @ np.array([-1.0, 0.0, 0.0])
    sideways = LEVEL.rotation.T @ np.array([0.0, 1.0, 0.0])
    for axes in (np.eye(3), np.eye(3)[[1, 0, 2]], -np.eye(3)):

        def support(direction: np.ndarray, axes: np.ndarray = axes):
            given = frame.grid, frame.model, surfaces, LEAST
            return scene_of(*given, exact=False, axes=axes, up=direction).support

        table = support(up)
        assert table is not None and table.normal @ up > 0.999
        wall = support(towards)
        assert wall is not None and wall.normal @ towards > 0.999
        assert support(sideways) is None, "nothing is level then"


def test_surfaces_are_finite_planes_with_unit_normals_towards_the_sensor() -> None:
    frame = looking(LEVEL, BOXES)
    surfaces = find_surfaces(frame.grid, frame.model, 0.3, 0)
    assert len(surfaces) >= 2
    for surface in surfaces:
        assert np.linalg.norm(surface.normal) == pytest.approx(1.0) and surface.offset > 0.0
        np.testing.assert_allclose(surface.axes.T @ surface.axes, np.eye(2), atol=1e-9)
        np.testing.assert_allclose(surface.axes.T @ surface.normal, 0.0, atol=1e-9)
        assert abs(surface.center @ surface.normal + surface.offset) < 1e-6
        assert (surface.hull[:, 2] <= 0.0).all()  # its middle is within its footprint
        assert surface.side >= 0.3
    table = max(surfaces, key=lambda surface: surface.normal @ LEVEL.rotation[2])
    # The table is 0.9 m deep; its front edge is out of the view or a little nearer.
    assert 0.5 < table.side < 1.0
    assert sum(surface.share for surface in surfaces) <= 1.0


def test_a_surface_owns_the_part_of_its_outline_that_hides_what_is_beyond() -> None:
    """Counted from the bodies that are seen: a table hides the floor, but not where the image or a box ends it."""
    frame = looking(CAMERA, BOXES)
    table = next(s for s in find_surfaces(frame.grid, frame.model, 0.3, 0) if s.normal @ CAMERA.rotation[2] > 0.9)
    body = np.pad(frame.body.reshape(frame.height, frame.width), 1, constant_values=-1)
    own = ends = 0
    for step in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        beyond = np.roll(body, step, axis=(0, 1))[body == TABLE]
        own += np.count_nonzero((beyond == FLOOR) | (beyond == WALL) | (beyond == LEG))
        ends += np.count_nonzero(beyond != TABLE)
    assert table.own == pytest.approx(own / ends, abs=0.06)


def test_too_small_a_surface_is_none() -> None:
    frame = looking(CAMERA, BOXES)
    assert all(surface.side < 2.0 for surface in find_surfaces(frame.grid, frame.model, 0.3, 0))
    assert find_surfaces(frame.grid, frame.model, 2.0, 0) == []


@pytest.mark.parametrize("seed", range(4))
def test_there_is_no_surface_among_balls_in_the_air(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform([-0.3, -0.6, 0.5], [0.8, 0.6, 1.3], (60, 3)).tolist()
    balls = tuple(Body(Sphere(0.05), GRAY, tuple(place)) for place in places)
    frame = looking(CAMERA, Scene((), balls), seed=seed)
    scene = seen(frame)
    assert (scene.support, scene.structure, scene.margin) == (None, (), None)
    assert set(np.unique(scene.classes)) == {NOTHING, FREE}


def test_margins_grow_with_the_noise_and_with_the_depth() -> None:
    found = []
    for factor in (1.0, 3.0, 6.0):
        frame = looking(CAMERA, BOXES, lambda z, factor=factor: factor * kinect(z))
        scene = seen(frame)
        assert scene.support is not None and scene.margin is not None
        assert (np.diff(scene.margin.value) >= -1e-4).all()
        assert scene.margin.value[-1] > scene.margin.value[0]
        depth = np.median(frame.grid.depth[frame.body == TABLE])
        found.append(np.interp(depth, frame.model.depths, scene.margin.value))
        # The height of a point above a tilted plane is less than the noise of its depth.
        assert LEAST <= found[-1] <= 3.3 * factor * kinect(depth) + LEAST
    assert found[0] < found[1] < found[2] <= MOST_MARGIN


def test_a_distance_that_was_set_holds_at_every_depth() -> None:
    frame = looking(CAMERA, BOXES)
    support = seen(frame).support
    assert support is not None
    np.testing.assert_allclose(margins(frame.grid, frame.model, support, 0.0123, exact=True).value, 0.0123)
    assert (margins(frame.grid, frame.model, support, 0.0123).value >= 0.0123).all()


def test_without_surfaces_everything_with_a_depth_is_free() -> None:
    frame = looking(CAMERA, BOXES)
    scene = scene_of(frame.grid, frame.model, [], LEAST, exact=False, axes=np.eye(3))
    assert scene.support is None
    np.testing.assert_array_equal(scene.classes, np.where(np.isfinite(frame.grid.depth), FREE, NOTHING))
