# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Normals from one side of a crease: against the formula as written, and what it is for."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import Array
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from topo_region_seg.api import segment
from topo_region_seg.compiled.kd_tree import position_tree
from topo_region_seg.params import Params
from topo_region_seg.steps.normals.estimate import estimate_normals
from topo_region_seg.steps.normals.sides import sided_normals

RADIUS, FEWEST = 0.01, 8


def sided(xyz: Array, radius: float | Array = RADIUS) -> Array:
    return sided_normals(xyz, position_tree(xyz), radius, FEWEST)


def plain(xyz: Array) -> Array:
    return estimate_normals(xyz, position_tree(xyz), RADIUS, FEWEST)


def edge(seed: int, noise: float, dihedral: float = 90.0, side: float = 0.05, n: int = 2500) -> tuple[Array, Array]:
    """Return points of two faces that meet at an edge towards the sensor, and which of the faces each is of."""
    rng = np.random.default_rng(seed)
    along, across = rng.random((2, n)) * side
    face = rng.integers(0, 2, n)
    slope = np.radians(90.0 - dihedral / 2.0)
    x = np.where(face == 0, -across, across) * np.cos(slope)
    xyz = np.column_stack([x, along - side / 2.0, 0.8 + across * np.sin(slope)])
    return xyz + rng.normal(0.0, noise, xyz.shape), face


def cylinder(seed: int, radius: float, noise: float, n: int = 6000) -> Array:
    """Return points of the half of an upright cylinder that the sensor sees."""
    rng = np.random.default_rng(seed)
    angle, height = np.radians(rng.uniform(-70.0, 70.0, n)), rng.uniform(-0.05, 0.05, n)
    xyz = np.column_stack([radius * np.sin(angle), height, 0.8 - radius * np.cos(angle)])
    return xyz + rng.normal(0.0, noise, xyz.shape)


def by_the_formula(xyz: Array, radius: float) -> Array:
    """Return the normals as docs/algorithm.md defines them, point by point."""
    near = [np.flatnonzero(np.linalg.norm(xyz - point, axis=1) <= radius) for point in xyz]
    normal, middle = np.zeros_like(xyz), np.zeros_like(xyz)
    variance = np.full(len(xyz), np.nan)
    for i, some in enumerate(near):
        if len(some) < FEWEST:
            continue
        middle[i] = xyz[some].mean(axis=0)
        values, vectors = np.linalg.eigh(np.cov(xyz[some].T, bias=True))
        normal[i] = vectors[:, 0] * (-1.0 if vectors[:, 0] @ xyz[i] > 0.0 else 1.0)
        variance[i] = max(values[0], 0.0) * len(some) / (len(some) - 3)
    known = np.sort(variance[np.isfinite(variance)])
    flat = 0.25 * known[int(0.25 * (len(known) - 1))] + (0.03 * radius) ** 2
    found = plain(xyz)
    for i, some in enumerate(near):
        total = np.zeros(3)
        for q in some:
            if np.isfinite(variance[q]) and abs(normal[q] @ (xyz[i] - middle[q])) <= 2.0 * np.sqrt(variance[q] + flat):
                total += max((flat / (variance[q] + flat)) ** 6, 1e-30) * normal[q]
        if total.any():
            found[i] = total / np.linalg.norm(total) * (1.0 if total @ xyz[i] <= 0.0 else -1.0)
    return found


@pytest.mark.parametrize("noise", [1e-5, 1e-3])
@pytest.mark.parametrize("seed", range(2))
def test_they_are_those_of_the_formula(seed: int, noise: float) -> None:
    xyz, _ = edge(seed, noise, n=900, side=0.03)
    cosine = (sided(xyz) * by_the_formula(xyz, RADIUS)).sum(axis=1)
    assert np.sort(cosine)[1] > 1.0 - 1e-9  # single precision may decide otherwise about one plane that just holds


@pytest.mark.parametrize(("noise", "dihedral"), [(0.0, 90.0), (0.0, 130.0), (5e-4, 90.0), (1e-3, 90.0)])
def test_up_to_the_edge_they_are_those_of_the_faces(noise: float, dihedral: float) -> None:
    xyz, face = edge(0, noise, dihedral)
    slope = np.radians(90.0 - dihedral / 2.0)
    faces = np.array([[-np.sin(slope), 0.0, -np.cos(slope)], [np.sin(slope), 0.0, -np.cos(slope)]])
    along = np.abs(xyz[:, 0]) / np.cos(slope)
    near = (along > 0.003) & (along < 0.008) & (np.abs(xyz[:, 1]) < 0.02)

    def off(normals: Array) -> float:
        cosine = np.clip((normals * faces[face]).sum(axis=1)[near], -1.0, 1.0)
        return float(np.degrees(np.quantile(np.arccos(cosine), 0.9)))

    assert off(sided(xyz)) < (1.0 if noise == 0.0 else 9.0)
    assert off(plain(xyz)) > 10.0


def test_hardly_a_normal_lies_between_those_of_exact_faces() -> None:
    xyz, _ = edge(1, 0.0)

    def between(normals: Array) -> float:
        return float(np.mean(np.abs(normals[:, 0]) < np.sin(np.radians(40.0))))

    assert between(sided(xyz)) < 0.01
    assert between(plain(xyz)) > 0.1


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_the_points_does_not_matter(seed: int) -> None:
    xyz, _ = edge(seed, 1e-3)
    order = np.random.default_rng(seed).permutation(len(xyz))
    np.testing.assert_allclose(sided(xyz[order]), sided(xyz)[order], atol=1e-5)


def test_they_turn_with_the_cloud() -> None:
    xyz, _ = edge(2, 1e-3)
    turn = Rotation.random(random_state=2)
    apart = np.linalg.norm(sided(turn.apply(xyz)) - turn.apply(sided(xyz)), axis=1)
    assert np.sort(apart)[-3] < 1e-4  # rounding may decide otherwise about planes that just hold a point


@pytest.mark.parametrize("scale", [0.25, 8.0])
def test_they_stay_when_cloud_and_radius_are_scaled(scale: float) -> None:
    xyz, _ = edge(3, 1e-3)
    np.testing.assert_allclose(sided(scale * xyz, scale * RADIUS), sided(xyz), atol=1e-6)


def test_points_far_from_any_plane_keep_their_own() -> None:
    near = np.array([[x, y, 1.0] for x in np.arange(5) * 0.02 for y in np.arange(5) * 0.02])
    lonely = np.array([[3.0, 3.0, 1.0], [3.0, 3.001, 1.0]])
    xyz = np.vstack([near, lonely])
    np.testing.assert_array_equal(sided(xyz), plain(xyz))
    assert sided(np.zeros((0, 3))).shape == (0, 3)


def test_a_radius_below_zero_gives_none() -> None:
    xyz, _ = edge(4, 1e-3, n=600, side=0.02)
    radius = np.where(np.arange(len(xyz)) % 3 == 0, -1.0, RADIUS)
    found = sided(xyz, radius)
    assert np.isnan(found[radius < 0.0]).all()
    assert np.isfinite(found[radius > 0.0]).all()


@pytest.mark.parametrize("noise", [0.0, 5e-4, 1e-3])
def test_creases_part_regions_unless_they_are_ignored(noise: float) -> None:
    xyz, face = edge(5, noise)
    rgb = np.full(xyz.shape, 90, np.uint8)
    parted = segment(xyz, rgb, Params(remove_floor=False)).labels
    assert len(np.unique(parted)) == 2
    assert max(np.mean((parted == parted.max()) == (face == side)) for side in (0, 1)) > 0.93
    if noise > 0.0:  # without, some normals in between are missing
        ignored = segment(xyz, rgb, Params(remove_floor=False, creases="ignore")).labels
        assert len(np.unique(ignored)) == 1


@pytest.mark.parametrize("noise", [0.0, 5e-4, 1e-3])
@pytest.mark.parametrize("radius", [0.025, 0.03, 0.05])
def test_a_cylinder_does_not_fall_into_strips(radius: float, noise: float) -> None:
    xyz = cylinder(0, radius, noise)
    labels = segment(xyz, np.full(xyz.shape, 90, np.uint8), Params(remove_floor=False)).labels
    assert len(np.unique(labels)) == 1


def test_a_ball_is_one_region() -> None:
    rng = np.random.default_rng(6)
    out = rng.normal(size=(9000, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    xyz = 0.04 * out[out[:, 2] < -0.2] + [0.0, 0.0, 0.8]
    assert cKDTree(xyz).query(xyz, k=2)[0][:, 1].max() < RADIUS
    labels = segment(xyz, np.full(xyz.shape, 90, np.uint8), Params(remove_floor=False)).labels
    assert len(np.unique(labels)) == 1
