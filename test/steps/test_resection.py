# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera of an organized cloud, found from its image grid, against the pose that the cloud was made with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from topo_region_seg.data import Cloud
from topo_region_seg.steps.view.resection import camera_pose

HEIGHT, WIDTH = 48, 64
FOCAL = 55.0


def rays(distortion: float = 0.0) -> np.ndarray:
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    x, y = (u - 30.0) / FOCAL, (v - 25.0) / FOCAL
    bent = 1.0 + distortion * (x * x + y * y)
    return np.stack([x * bent, y * bent, np.ones_like(x)], axis=-1)


def relief(seed: int) -> np.ndarray:
    """Depths of a slanted table with boxes on it, and the noise of a stereo camera."""
    rng = np.random.default_rng(seed)
    v = np.mgrid[0:HEIGHT, 0:WIDTH][0]
    depth = 1.2 - 0.006 * v
    for _ in range(4):
        top, left = rng.integers(0, HEIGHT - 12), rng.integers(0, WIDTH - 12)
        depth[top : top + 12, left : left + 12] -= rng.uniform(0.05, 0.2)
    return depth + rng.normal(0.0, 0.003, depth.shape) * depth**2


def cloud(
    seed: int, directions: np.ndarray, rotation: np.ndarray, position: np.ndarray, kind: type = np.float32
) -> Cloud:
    """Some pixels have no depth: NaN, or all zeros as some drivers write them."""
    rng = np.random.default_rng(seed + 1000)
    xyz = (directions * relief(seed)[..., None]).reshape(-1, 3) @ rotation.T + position
    xyz[rng.random(len(xyz)) < 0.2] = np.nan if seed % 2 else 0.0
    return Cloud(xyz.astype(kind), None, *directions.shape[:2])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.1, 50.0))
def test_the_camera_is_found_in_any_frame(seed: int, far: float) -> None:
    rotation = Rotation.random(random_state=seed).as_matrix()
    position = far * np.random.default_rng(seed).normal(size=3)
    found = camera_pose(cloud(seed, rays(), rotation, position))
    assert found is not None
    assert np.linalg.norm(found.center - position) < 2e-3 * max(1.0, far / 10.0)
    np.testing.assert_allclose(found.axes, rotation.T, atol=5e-3)
    np.testing.assert_allclose(found.axes @ found.axes.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_parts_of_an_image_and_every_second_pixel_tell_the_same(seed: int) -> None:
    rotation, position = Rotation.random(random_state=seed).as_matrix(), np.array([0.4, -1.0, 0.7])
    whole = cloud(seed, rays(), rotation, position)
    image = whole.xyz.reshape(HEIGHT, WIDTH, 3)
    for part in (image[5:40, 10:60], image[::2, ::2], image[:, ::3]):
        found = camera_pose(Cloud(part.reshape(-1, 3), None, *part.shape[:2]))
        assert found is not None and np.linalg.norm(found.center - position) < 2e-3


@pytest.mark.parametrize("seed", range(4))
def test_a_camera_at_the_origin_is_where_clouds_are_expected_to_come_from(seed: int) -> None:
    assert camera_pose(cloud(seed, rays(), np.eye(3), np.zeros(3))) is None
    turned = Rotation.random(random_state=seed).as_matrix()
    assert camera_pose(cloud(seed, rays(), turned, np.zeros(3))) is None


@pytest.mark.parametrize("seed", range(3))
def test_what_no_pinhole_camera_saw_has_no_camera(seed: int) -> None:
    rotation, position = Rotation.random(random_state=seed).as_matrix(), np.array([0.4, -1.0, 0.7])
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    yaw, pitch = np.radians(u * 360.0 / WIDTH), np.radians(v - HEIGHT / 2)
    lidar = np.stack([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)], axis=-1)
    assert camera_pose(cloud(seed, lidar, rotation, position)) is None
    assert camera_pose(cloud(seed, rays(distortion=-0.4), rotation, position)) is None
    moved = cloud(seed, rays(), rotation, position)
    shaken = moved.xyz + np.random.default_rng(seed).normal(0.0, 0.03, moved.xyz.shape)
    assert camera_pose(replace(moved, xyz=shaken)) is None
    order = np.random.default_rng(seed).permutation(len(moved))
    assert camera_pose(replace(moved, xyz=moved.xyz[order])) is None


@pytest.mark.parametrize("noise", [0.0, 1e-4, 0.003])
def test_a_map_of_heights_has_no_camera(noise: float) -> None:
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH] * 0.02
    height = np.sin(3.0 * u) * np.cos(2.0 * v) + np.random.default_rng(1).normal(0.0, noise, u.shape)
    assert camera_pose(Cloud(np.stack([u, v, height], axis=-1).reshape(-1, 3), None, HEIGHT, WIDTH)) is None


@pytest.mark.parametrize(("side", "facet"), [(160, 8), (200, 10), (240, 12), (230, 9)])
def test_roofs_seen_along_parallel_rays_have_no_camera(side: int, facet: int) -> None:
    """In single precision, whose rounding lets rays meet millions of metres away."""
    v, u = np.mgrid[0:side, 0:side] * 0.003
    width = 0.003 * facet
    height = 1.0 + width * (np.abs((u / width) % 1.0 - 0.5) + np.abs((v / width) % 1.0 - 0.5))
    xyz = np.stack([u - 0.0015 * side, v - 0.0015 * side, height], axis=-1).astype(np.float32)
    assert camera_pose(Cloud(xyz.reshape(-1, 3), None, side, side)) is None


def test_a_plane_seen_without_noise_does_not_tell_from_where() -> None:
    directions = rays()
    depth = 1.0 / (directions @ np.array([0.1, -0.3, 0.9]))
    xyz = (directions * depth[..., None]).reshape(-1, 3) + [1.0, 0.0, 0.5]
    assert camera_pose(Cloud(xyz, None, HEIGHT, WIDTH)) is None


def test_clouds_without_a_grid_or_without_points() -> None:
    whole = cloud(1, rays(), np.eye(3), np.array([1.0, 0.0, 0.0]))
    assert camera_pose(replace(whole, height=1, width=len(whole))) is None
    assert camera_pose(replace(whole, height=len(whole), width=1)) is None
    for value in (np.nan, 0.0, np.inf):
        assert camera_pose(replace(whole, xyz=np.full_like(whole.xyz, value))) is None
    same = np.tile(np.array([[0.3, 0.2, 1.0]]), (len(whole), 1))
    assert camera_pose(replace(whole, xyz=same)) is None
    line = np.linspace(0.5, 1.0, len(whole))[:, None] * np.array([0.3, 0.2, 1.0])
    assert camera_pose(replace(whole, xyz=line)) is None
