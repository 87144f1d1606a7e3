# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The simulator: exact geometry without noise, honest truth, noise that grows with the square of the distance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from topo_region_seg.offline.simulation import (
    Body,
    Box,
    Camera,
    Cylinder,
    DepthNoise,
    Paint,
    PartNumbers,
    Scene,
    Sphere,
    orbit,
    simulate,
    tabletop,
)

CAMERA = Camera.kinect(160, 120)
RED = Paint((200, 40, 40))


def one(shape, position=(0.0, 0.0, 0.8), **pose) -> Scene:
    return Scene((), (Body(shape, RED, position, **pose),))


def in_frame_of(body: Body, camera: Camera, xyz: np.ndarray) -> np.ndarray:
    world = xyz @ camera.rotation.T + camera.eye
    return (world - body.position) @ body.rotation


def distance_to_surface(shape, local: np.ndarray) -> np.ndarray:
    if isinstance(shape, Sphere):
        return np.abs(np.linalg.norm(local, axis=1) - shape.radius)
    if isinstance(shape, Box):
        return np.abs((np.abs(local) - np.asarray(shape.size) / 2).max(axis=1))
    across = np.hypot(local[:, 0], local[:, 1]) - shape.radius
    return np.abs(np.maximum(across, np.abs(local[:, 2]) - shape.height / 2))


@pytest.mark.parametrize("shape", [Box((0.2, 0.3, 0.15)), Cylinder(0.1, 0.25), Sphere(0.12)])
@pytest.mark.parametrize("tilt", [0.0, 0.7])
def test_points_lie_on_the_surface_and_normals_face_the_camera(shape, tilt) -> None:
    scene = one(shape, yaw=0.4, tilt=tilt)
    frame = simulate(scene, CAMERA, noise=None)
    seen = frame.labels > 0
    assert seen.sum() > 200
    local = in_frame_of(scene.objects[0], CAMERA, frame.xyz[seen])
    assert distance_to_surface(shape, local).max() < 1e-9
    normals = frame.normals[seen]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-9)
    assert (np.einsum("ij,ij->i", normals, frame.xyz[seen]) < 0).all()
    np.testing.assert_allclose(frame.cloud.xyz[seen], frame.xyz[seen], atol=1e-6)


def test_normals_agree_with_finite_differences_of_the_points() -> None:
    frame = simulate(one(Sphere(0.15)), CAMERA, noise=None)
    grid = frame.xyz.reshape(120, 160, 3)
    across = np.cross(grid[2:, 1:-1] - grid[:-2, 1:-1], grid[1:-1, 2:] - grid[1:-1, :-2])
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    angle = np.degrees(
        np.arccos(np.clip(np.einsum("...i,...i", across, frame.normals.reshape(grid.shape)[1:-1, 1:-1]), -1, 1))
    )
    inner = np.isfinite(angle)
    assert inner.sum() > 1000
    assert np.percentile(angle[inner], 90) < 2.0


def test_pixels_project_back_to_themselves() -> None:
    frame = simulate(tabletop(1), CAMERA, noise=None)
    x, y, z = frame.xyz.reshape(120, 160, 3)[70, 33]
    assert CAMERA.fx * x / z + CAMERA.cx == pytest.approx(33)
    assert CAMERA.fy * y / z + CAMERA.cy == pytest.approx(70)


@pytest.mark.parametrize("post_first", [False, True])
def test_the_nearer_body_hides_the_farther_and_cuts_it_into_parts(post_first) -> None:
    wide = Body(Box((0.05, 0.6, 0.2)), RED, (0.3, 0.0, 0.82))
    post = Body(Box((0.05, 0.05, 0.6)), RED, (0.0, 0.0, 0.85))
    camera = CAMERA.look((-0.8, 0.0, 0.82), (0.3, 0.0, 0.82))
    bodies = (post, wide) if post_first else (wide, post)
    labels = simulate(Scene((), bodies), camera, noise=None).labels.reshape(120, 160)
    row = labels[60]
    middle = row[80]
    assert middle // 10 == (2 if post_first else 3)
    left, right = row[row > 0][0], row[row > 0][-1]
    assert {left, right} == ({30, 31} if post_first else {20, 21})


def test_labels_of_a_tabletop_follow_the_scheme() -> None:
    scene = tabletop(2)
    frame = simulate(scene, CAMERA)
    labels = frame.labels
    assert labels.dtype == np.uint32
    invalid = ~np.isfinite(frame.cloud.xyz).all(axis=1)
    np.testing.assert_array_equal(labels == 0, invalid)
    assert set(np.unique(labels[labels < 20])) <= {0, 1, 2, 3, 4}
    objects = np.unique(labels[labels >= 20] // 10) - 2
    assert len(objects) >= 5
    assert objects.max() < len(scene.objects)
    assert frame.cloud.organized
    assert frame.cloud.rgb is not None
    assert frame.cloud.rgb.dtype == np.uint8


def test_a_band_is_a_part_of_its_own() -> None:
    plain = one(Cylinder(0.1, 0.3))
    banded = Scene((), (Body(Cylinder(0.1, 0.3), Paint((200, 40, 40), band=(20, 20, 200)), (0.0, 0.0, 0.8)),))
    assert len(np.unique(simulate(plain, CAMERA, noise=None).labels)) == 3
    assert len(np.unique(simulate(banded, CAMERA, noise=None).labels)) == 5


def test_same_seed_same_frame_other_seed_other_noise() -> None:
    first, again, other = (simulate(tabletop(3), CAMERA, seed) for seed in (7, 7, 8))
    np.testing.assert_array_equal(first.cloud.xyz, again.cloud.xyz)
    np.testing.assert_array_equal(first.cloud.rgb, again.cloud.rgb)
    np.testing.assert_array_equal(first.labels, again.labels)
    assert (first.cloud.rgb != other.cloud.rgb).any()


@pytest.mark.parametrize("distance", [0.8, 1.6, 3.2])
def test_depth_noise_grows_with_the_square_of_the_distance(distance) -> None:
    noise = DepthNoise()
    measured = noise.measured(np.full(200_000, distance), np.random.default_rng(0))
    khoshelham = 1.425e-3 * distance**2  # metres, from the noise alone; rounding adds to it
    assert np.std(measured) == pytest.approx(np.hypot(khoshelham, khoshelham / np.sqrt(3)), rel=0.06)
    assert np.std(measured) == pytest.approx(noise.depth_sigma(distance), rel=0.05)
    assert np.mean(measured) == pytest.approx(distance, abs=0.05 * khoshelham + 1e-4)


def test_depth_is_rounded_to_steps_of_disparity() -> None:
    noise = DepthNoise()
    measured = noise.measured(np.linspace(0.6, 3.0, 5000), np.random.default_rng(0))
    steps = noise.focal * noise.baseline / measured / noise.disparity_step
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)


def test_points_are_lost_at_edges_in_shadows_and_at_grazing_angles_not_elsewhere() -> None:
    depth = np.full((60, 80), 1.5)
    depth[20:40, 30:50] = 1.0
    facing = np.ones_like(depth)
    lost = DepthNoise().lost(depth, facing, 131.0, np.random.default_rng(0))
    assert lost[:15].mean() < 0.02
    assert lost[22:38, 32:48].mean() < 0.02
    shadow = DepthNoise().shadowed(depth, 131.0)
    width = 131.0 * 0.075 * (1 / 1.0 - 1 / 1.5)  # pixels: difference of the disparities
    assert shadow[30].sum() == pytest.approx(width, abs=1)
    assert shadow[30, 27:30].all()
    assert not shadow[:19].any()
    grazing = DepthNoise().lost(
        np.full((60, 80), 1.0), np.full((60, 80), np.cos(np.radians(85))), 131.0, np.random.default_rng(0)
    )
    assert grazing.mean() > 0.6


def test_an_empty_scene_gives_an_all_invalid_cloud() -> None:
    frame = simulate(Scene((), ()), CAMERA)
    assert np.isnan(frame.cloud.xyz).all()
    assert not frame.labels.any()


def test_orbit_keeps_the_distance_and_the_target() -> None:
    cameras = orbit(CAMERA, 5)
    assert len({c.eye for c in cameras}) == 5
    for camera in cameras:
        assert np.linalg.norm(np.subtract(camera.eye, camera.target)) == pytest.approx(
            np.linalg.norm(np.subtract(CAMERA.eye, CAMERA.target))
        )
    assert orbit(CAMERA, 1) == [CAMERA]


def test_too_many_background_bodies_are_refused() -> None:
    with pytest.raises(ValueError, match="at most 9 background bodies, not 10"):
        Scene((Body(Sphere(0.1), RED, (0.0, 0.0, 0.0)),) * 10, ())


def test_parts_keep_their_labels_where_the_camera_moves_around_them() -> None:
    box = Body(Box((0.2, 0.2, 0.2)), Paint((200, 60, 50)), (0.0, 0.0, 0.8), yaw=math.radians(45.0))
    numbers, steady, ranked = PartNumbers(), [], []
    for camera in orbit(Camera.kinect(160, 120), 2, math.radians(20.0)):
        kept = simulate(Scene((), (box,)), camera, noise=None, numbers=numbers)
        # The two sides, apart by the direction in which they face.
        way = kept.normals @ camera.rotation.T
        sides = [np.abs(way @ np.array([-1.0, sign, 0.0]) / np.sqrt(2) - 1) < 1e-6 for sign in (-1.0, 1.0)]
        steady.append([np.unique(kept.labels[side]).tolist() for side in sides])
        alone = simulate(Scene((), (box,)), camera, noise=None)
        ranked.append([np.unique(alone.labels[side]).tolist() for side in sides])
    assert steady[0] == steady[1] and steady[0][0] != steady[0][1]
    # Numbered by size in each frame, the sides trade labels.
    assert ranked[0] == ranked[1][::-1] == steady[0]


def test_numbers_of_parts_that_are_out_of_sight_are_given_again_last() -> None:
    numbers = PartNumbers()
    assert numbers.of(3, [(face, 0) for face in range(9)]) == list(range(9))
    assert numbers.of(4, [(5, 0)]) == [0]
    assert numbers.of(3, [(0, 0), (9, 0)]) == [0, 9]
    assert numbers.of(3, [(10, 0), (2, 0), (9, 0)]) == [1, 2, 9]
    assert numbers.of(5, [(face, 0) for face in range(12)]) == [*range(10), 9, 9]
