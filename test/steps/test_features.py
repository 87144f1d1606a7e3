# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Colors and normals against published values and brute force."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import Array, unit
from scipy.spatial.transform import Rotation

from topo_region_seg.compiled.kd_tree import position_tree
from topo_region_seg.params import Params
from topo_region_seg.steps.color import srgb_to_lab
from topo_region_seg.steps.normals.estimate import estimate_normals

# sRGB primaries and neutrals in CIELAB under D65, as published (two decimals).
PUBLISHED = {
    (255, 255, 255): (100.0, 0.0, 0.0),
    (0, 0, 0): (0.0, 0.0, 0.0),
    (255, 0, 0): (53.24, 80.09, 67.20),
    (0, 255, 0): (87.73, -86.18, 83.18),
    (0, 0, 255): (32.30, 79.19, -107.86),
    (255, 255, 0): (97.14, -21.55, 94.48),
    (119, 119, 119): (50.03, 0.0, 0.0),
}


def test_lab_of_published_colors() -> None:
    rgb = np.array(list(PUBLISHED), np.uint8)
    np.testing.assert_allclose(srgb_to_lab(rgb), np.array(list(PUBLISHED.values())), atol=0.012)


def test_lab_is_that_of_the_formulas_of_the_cie() -> None:
    """IEC 61966-2-1 and CIE 15, with the cube root of the C library; all grays, corners and many other colors."""
    corners = np.array(np.meshgrid([0, 1, 9, 10, 11, 254, 255], [0, 1, 255], [0, 1, 255])).reshape(3, -1).T
    grays = np.repeat(np.arange(256)[:, None], 3, axis=1)
    rgb = np.concatenate([corners, grays, np.random.default_rng(0).integers(0, 256, (20_000, 3))]).astype(np.uint8)
    value = rgb / 255.0
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    to_xyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    t = linear @ np.array(to_xyz).T / [0.95047, 1.0, 1.08883]
    x, y, z = np.where(t > (6 / 29) ** 3, np.cbrt(t), t * (29 / 6) ** 2 / 3 + 4 / 29).T
    np.testing.assert_allclose(
        srgb_to_lab(rgb), np.column_stack([116 * y - 16, 500 * (x - y), 200 * (y - z)]), atol=1e-9
    )


def test_lab_rises_with_gray_and_is_neutral() -> None:
    lab = srgb_to_lab(np.repeat(np.arange(256, dtype=np.uint8)[:, None], 3, axis=1))
    assert (np.diff(lab[:, 0]) > 0.0).all()
    np.testing.assert_allclose(lab[:, 1:], 0.0, atol=1e-3)


def normals_of(xyz: Array, params: Params) -> Array:
    return estimate_normals(xyz, position_tree(xyz), params.normal_radius, params.normal_min_neighbors)


def brute_force_normals(xyz: Array, radius: float) -> Array:
    normals = np.empty_like(xyz)
    for i, point in enumerate(xyz):
        near = xyz[np.linalg.norm(xyz - point, axis=1) <= radius]
        normals[i] = np.linalg.eigh(np.cov(near.T, bias=True))[1][:, 0]
        if normals[i] @ point > 0.0:
            normals[i] *= -1.0
    return normals


@pytest.mark.parametrize("seed", range(4))
def test_normals_equal_brute_force(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, y = rng.random((2, 1500)) * 0.06
    xyz = np.column_stack([x, y, 0.7 + 0.01 * np.sin(60.0 * x) * np.cos(40.0 * y) + rng.normal(0.0, 3e-4, 1500)])
    xyz = Rotation.random(random_state=seed).apply(xyz)
    params = Params(normal_radius=0.008, normal_min_neighbors=5)
    cosine = (normals_of(xyz, params) * brute_force_normals(xyz, 0.008)).sum(axis=1)
    assert cosine.min() > 1.0 - 1e-9


def test_normals_face_the_sensor_and_are_unit() -> None:
    rng = np.random.default_rng(0)
    sphere = unit(rng.normal(size=(4000, 3)))
    xyz = sphere * 0.1 + [0.0, 0.0, 1.0]
    normals = normals_of(xyz, Params(normal_radius=0.02))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
    assert ((normals * xyz).sum(axis=1) <= 0.0).all()
    grazing = np.abs((sphere * unit(xyz)).sum(axis=1)) < 0.3
    outward = np.sign(-(sphere * xyz).sum(axis=1))[:, None] * sphere
    assert (normals * outward).sum(axis=1)[~grazing].min() > 0.97


def test_sparse_points_take_their_nearest_and_lonely_ones_have_none() -> None:
    near = np.array([[x, y, 1.0] for x in np.arange(5) * 0.02 for y in np.arange(5) * 0.02])
    lonely = np.array([[3.0, 3.0, 1.0], [3.0, 3.001, 1.0]])
    normals = normals_of(np.vstack([near, lonely]), Params(normal_radius=0.01, normal_min_neighbors=5))
    np.testing.assert_allclose(normals[:25], np.tile([0.0, 0.0, -1.0], (25, 1)), atol=1e-12)
    assert np.isnan(normals[25:]).all()


@pytest.mark.parametrize(
    "xyz",
    [
        np.tile([0.1, 0.2, 0.9], (50, 1)),
        np.column_stack([np.linspace(0.0, 0.01, 50), np.zeros(50), np.ones(50)]),
        np.outer(np.linspace(0.9, 0.91, 50), [0.0, 0.0, 1.0]),
        np.outer(np.linspace(0.9, 0.91, 50), [0.5, 0.3, 1.0]),
        np.tile([0.1, 0.2, 0.9], (50, 1)) + np.arange(150).reshape(50, 3) * 1e-20,
    ],
    ids=["coinciding", "line", "line through the sensor", "slanted line through the sensor", "1e-20 apart"],
)
def test_degenerate_neighborhoods_give_finite_normals(xyz: Array) -> None:
    normals = normals_of(xyz, Params())
    assert np.isfinite(normals).all()
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    assert ((normals * xyz).sum(axis=1) <= 1e-9).all()
    np.testing.assert_array_equal(normals, normals_of(xyz, Params()))


def test_no_points() -> None:
    assert normals_of(np.zeros((0, 3)), Params()).shape == (0, 3)
    assert srgb_to_lab(np.zeros((0, 3), np.uint8)).shape == (0, 3)


@pytest.mark.parametrize("direction", [[0.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.3, -0.2, 0.9], [-0.5, 0.5, 0.7]])
def test_points_on_a_line_through_the_sensor_have_one_normal(direction: list[float]) -> None:
    ray = np.array(direction) / np.linalg.norm(direction)
    xyz = np.linspace(0.5, 0.55, 50)[:, None] * ray
    normals = normals_of(xyz, Params())
    assert np.allclose(normals @ ray, 0.0, atol=1e-6)
    assert np.ptp(normals, axis=0).max() < 1e-9


def test_points_on_a_line_beside_the_sensor_look_towards_it() -> None:
    xyz = np.column_stack([np.full(50, 0.1), np.zeros(50), np.linspace(0.5, 0.55, 50)])
    assert np.allclose(normals_of(xyz, Params()), [-1.0, 0.0, 0.0], atol=1e-6)
