# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Hollow shapes, scenes beyond tabletops and other cameras: against sampled solids, and by their properties."""

from __future__ import annotations

import math

import numpy as np
import pytest

from topo_region_seg.offline.simulation import Body, Box, Camera, Cylinder, Paint, Scene, Sphere, simulate
from topo_region_seg.offline.simulation.heap import heap
from topo_region_seg.offline.simulation.hollow import Compound, Cup
from topo_region_seg.offline.simulation.kinds import SCENES, SENSORS, simulated
from topo_region_seg.offline.simulation.stereo import ActiveStereo
from topo_region_seg.offline.simulation.time_of_flight import TimeOfFlight
from topo_region_seg.offline.simulation.vessels import bottle, mug, tray

CAMERA = Camera.kinect(160, 120)
GRAY = Paint((120, 120, 120))
HOLLOW = [Cup(0.1, 0.2, 0.02), mug(0.08, 0.15), bottle(0.07, 0.3), tray(0.3, 0.2, 0.1)]
FOCAL = 525.0


def inside(shape, points: np.ndarray) -> np.ndarray:
    """Whether points of the shape's own frame lie in it."""
    if isinstance(shape, Compound):
        return np.any([inside(part, points - offset) for part, offset in shape.parts], axis=0)
    across = np.hypot(points[:, 0], points[:, 1])
    level = np.abs(points[:, 2]) <= shape.half_height
    if isinstance(shape, Box):
        return (np.abs(points) <= np.asarray(shape.size) / 2).all(axis=1)
    if isinstance(shape, Sphere):
        return np.linalg.norm(points, axis=1) <= shape.radius
    if isinstance(shape, Cylinder):
        return level & (across <= shape.radius)
    hollow = (across < shape.radius - shape.wall) & (points[:, 2] > shape.wall - shape.half_height)
    return level & (across <= shape.radius) & ~hollow


@pytest.mark.parametrize("shape", HOLLOW, ids=lambda shape: type(shape).__name__)
@pytest.mark.parametrize("seed", range(3))
def test_rays_enter_where_the_first_sample_along_them_is_inside(shape, seed) -> None:
    rng = np.random.default_rng(seed)
    step, far = 0.0005, 2 * shape.bounding_radius
    origin = rng.normal(size=3)
    origin *= far / np.linalg.norm(origin)
    aim = rng.uniform(-1, 1, (400, 3)) * 0.6 * shape.bounding_radius
    directions = aim - origin
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    entry = shape.enter(origin, directions)
    along = np.arange(0.0, 2 * far, step)
    samples = inside(shape, (origin + along[:, None, None] * directions).reshape(-1, 3)).reshape(len(along), -1)
    first = np.where(samples.any(axis=0), along[samples.argmax(axis=0)], np.inf)
    # A ray that only cuts a corner may pass between two samples.
    missed = np.isinf(first) & np.isfinite(entry.t)
    assert missed.mean() < 0.02
    assert np.isinf(entry.t[~missed]).tolist() == np.isinf(first[~missed]).tolist()
    both = np.isfinite(first)
    late = first[both] - entry.t[both]
    assert (late > -1e-9).all() and np.mean(late <= step + 1e-9) > 0.98
    normal = entry.normal[both]
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-9)
    assert (np.einsum("ij,ij->i", normal, directions[both]) <= 1e-9).all()
    # Just outside along the normal, the solid ends; just inside, it begins.
    hit = origin + entry.t[both, None] * directions[both]
    assert np.mean(inside(shape, hit - 1e-6 * normal)) > 0.98 and np.mean(inside(shape, hit + 1e-6 * normal)) < 0.02


def test_from_above_the_floor_and_the_inner_wall_of_a_cup_are_seen() -> None:
    origin = np.array([0.05, 0.02, 0.6])
    x, y = (grid.ravel() for grid in np.meshgrid(*2 * (np.linspace(-0.2, 0.2, 60),)))
    entry = Cup(0.1, 0.15, 0.01).enter(origin, np.column_stack([x, y, np.full(x.size, -0.5)]))
    assert set(entry.face[np.isfinite(entry.t)].tolist()) == {2, 3, 4}


@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.parametrize("seed", range(4))
def test_bodies_do_not_run_into_each_other(kind, seed) -> None:
    scene = SCENES[kind].scene(seed)
    rng = np.random.default_rng(seed)
    for body in scene.objects:
        reach = body.shape.bounding_radius
        points = rng.uniform(-reach, reach, (4000, 3))
        world = points[inside(body.shape, 1.002 * points)] @ body.rotation.T + body.position
        for other in scene.bodies:
            if other is not body:
                shared = inside(other.shape, (world - other.position) @ other.rotation)
                assert shared.mean() < 0.01, (type(body.shape), type(other.shape), body.position, other.position)


def test_a_heap_lies_on_its_ground_and_within_its_bounds() -> None:
    bodies = heap(np.random.default_rng(2), 20, (0.2, 0.25), 0.5)
    assert len(bodies) > 12
    for body in bodies:
        reach = body.shape.bounding_radius
        points = np.random.default_rng(0).uniform(-reach, reach, (20_000, 3))
        world = points[inside(body.shape, points)] @ body.rotation.T + body.position
        assert world[:, 2].min() > 0.5 - 1e-9
        assert (np.abs(world[:, :2]) <= (0.2, 0.25)).all()
    assert max(body.position[2] for body in bodies) > 0.56  # things lie on things


@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.parametrize("sensor", SENSORS)
def test_each_kind_of_scene_is_seen_by_each_kind_of_camera(kind, sensor) -> None:
    frame = simulated(kind, sensor, 3, 160, 120)
    depth = frame.cloud.xyz[:, 2]
    np.testing.assert_array_equal(frame.labels == 0, np.isnan(depth))
    assert np.mean(frame.labels > 0) > 0.7
    assert len(np.unique(frame.labels[frame.labels >= 20] // 10)) >= 4
    wrong = np.abs(depth - frame.xyz[:, 2]) / frame.xyz[:, 2]
    assert np.nanmedian(wrong) < 0.03
    again = simulated(kind, sensor, 3, 160, 120)
    np.testing.assert_array_equal(frame.cloud.xyz, again.cloud.xyz)
    assert not np.array_equal(frame.labels, simulated(kind, sensor, 4, 160, 120).labels)


def step_edge() -> np.ndarray:
    """A wall at 1.5 m with a square at 1 m before it."""
    depth = np.full((120, 160), 1.5)
    depth[40:80, 60:100] = 1.0
    return depth


def observed(sensor, depth, seed=0, cosine=1.0) -> np.ndarray:
    return sensor.observed(depth, np.full(depth.shape, cosine), FOCAL, np.random.default_rng(seed))


def test_stereo_noise_grows_with_the_square_of_the_distance_and_is_alike_over_a_window() -> None:
    sensor = ActiveStereo()
    for z in (0.6, 1.2, 2.4):
        error = observed(sensor, np.full((200, 200), z)) - z
        wanted = sensor.disparity_sigma * z * z / (FOCAL * sensor.baseline)
        assert np.nanstd(error) == pytest.approx(wanted, rel=0.1)
        beside, away = (np.nanmean(error[:, :-shift] * error[:, shift:]) / np.nanvar(error) for shift in (1, 12))
        assert beside > 0.7 and abs(away) < 0.1


def test_stereo_leaves_rims_and_smears_outlines() -> None:
    sensor = ActiveStereo(blob_loss=0.0, disparity_sigma=0.0, disparity_step=1e-6)
    seen = observed(sensor, step_edge())
    rim = np.zeros(seen.shape, bool)
    rim[38:82, 58:102], rim[43:77, 63:97] = True, False
    assert 0.3 < np.isnan(seen[rim]).mean() < 0.9
    assert not np.isnan(seen[50:70, 70:90]).any() and not np.isnan(seen[:30]).any()
    # What the second camera does not see, at the left side as it is at the right.
    band = FOCAL * sensor.baseline * (1 / 1.0 - 1 / 1.5)
    hidden = np.isnan(seen[60, 40:60])
    assert hidden.sum() >= band - 2 and np.isnan(seen[60, 100:110]).sum() < band
    between = (seen > 1.03) & (seen < 1.45)
    assert between.sum() > 20 and not between[:34].any() and not between[46:74, 66:94].any()


def test_time_of_flight_noise_grows_with_the_distance_and_with_the_angle() -> None:
    sensor = TimeOfFlight(wiggle=(0.0, 1.0), blur=0.01)
    for z, cosine in ((0.5, 1.0), (2.0, 1.0), (1.0, 0.25)):
        error = observed(sensor, np.full((200, 200), z), cosine=cosine) - z
        assert np.nanstd(error) == pytest.approx(sensor.sigma * z / math.sqrt(cosine), rel=0.05)
    assert np.isnan(observed(sensor, np.full((20, 20), 4.0), cosine=0.1)).all()  # too dim


def test_time_of_flight_errs_the_same_in_every_frame() -> None:
    sensor = TimeOfFlight(sigma=0.0)
    depth = np.broadcast_to(np.linspace(0.8, 2.3, 300), (20, 300))
    first, other = (observed(sensor, depth, seed) - depth for seed in (1, 2))
    np.testing.assert_allclose(first, other)
    assert np.nanmax(np.abs(first)) == pytest.approx(sensor.wiggle[0], rel=0.1)


def test_time_of_flight_mixes_two_surfaces_in_a_pixel_and_drops_some_of_them() -> None:
    for dropped in (0.0, 0.5, 1.0):
        seen = observed(TimeOfFlight(sigma=0.0, wiggle=(0.0, 1.0), dropped=dropped), step_edge())
        mixed = (seen > 1.05) & (seen < 1.45)
        assert not mixed[:38].any() and not mixed[42:78, 62:98].any()
        assert (mixed.sum() > 50) == (dropped < 1.0)
        assert (np.isnan(seen).sum() > 100) == (dropped > 0.0)


def test_parts_of_a_hollow_object_have_labels_of_one_ten() -> None:
    scene = Scene((), (Body(mug(0.12, 0.25), GRAY, (0.0, 0.0, 0.8)),))
    labels = simulate(scene, CAMERA.look((-0.5, 0.0, 1.5), (0.0, 0.0, 0.8)), noise=None).labels
    assert len(np.unique(labels)) >= 4 and set(np.unique(labels[labels > 0] // 10).tolist()) == {2}
