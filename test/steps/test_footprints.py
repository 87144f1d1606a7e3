# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Footprints of surfaces: their points, what is before them and seen through them, against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from topo_region_seg.steps.support.footprints import HIGH, SEEN_THROUGH, seen_around, weighed_scatter
from topo_region_seg.steps.support.surfaces import _outer

NORMAL, OFFSET = np.array([0.0, 0.6, -0.8]), 0.9


def cloud(seed: int, count: int = 3_000):
    rng = np.random.default_rng(seed)
    points = np.asfortranarray(rng.uniform([-1.0, -1.0, 0.3], [1.0, 1.0, 3.0], (count, 3)))
    return points, rng.uniform(0.005, 0.2, count)


@pytest.mark.parametrize("seed", range(4))
def test_scatter_is_that_of_numpy(seed: int) -> None:
    points, near = cloud(seed)
    count, center, scatter = weighed_scatter(points, near, NORMAL, OFFSET)
    on = np.abs(points @ NORMAL + OFFSET) < near
    assert count == np.count_nonzero(on) > 10
    np.testing.assert_allclose(center, np.average(points[on], axis=0, weights=near[on] ** -2.0))
    apart = (points[on] - center) / near[on, None]
    np.testing.assert_allclose(scatter, apart.T @ apart)


@pytest.mark.parametrize("seed", range(4))
def test_points_before_a_footprint_and_seen_through_it_are_counted(seed: int) -> None:
    points, near = cloud(seed)
    center, axes = np.array([0.1, -0.2, 0.975]), np.array([[1.0, 0.0], [0.0, 0.8], [0.0, 0.6]])
    hull = ConvexHull(np.random.default_rng(seed).normal(size=(12, 2)) * 0.3).equations
    height = points @ NORMAL + OFFSET
    ray = -OFFSET / np.minimum(points @ NORMAL, -1e-9)
    behind = (height < -SEEN_THROUGH * near) & (ray > 0.0) & (ray < 1.0)
    before = (height > near) & (height < HIGH)

    def inside(places: np.ndarray) -> int:
        return int(np.count_nonzero(((places - center) @ axes @ hull[:, :2].T + hull[:, 2] <= 0.0).all(axis=1)))

    expected = inside(points[before]), inside(points[behind] * ray[behind, None])
    assert min(expected) > 5
    assert seen_around(points, near, NORMAL, OFFSET, center, axes, hull) == expected


@pytest.mark.parametrize("seed", range(6))
def test_the_hull_of_the_outer_points_is_that_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    flat = rng.normal(size=(4_000, 2)) * [1.0, 0.1] if seed % 2 else np.round(rng.random((4_000, 2)), 2)
    outer = _outer(flat)
    assert len(outer) < len(flat) / 4
    hull, expected = ConvexHull(outer), ConvexHull(flat)
    assert hull.volume == pytest.approx(expected.volume, rel=1e-12)
    corners = {tuple(place) for place in outer[hull.vertices]}
    assert corners == {tuple(place) for place in flat[expected.vertices]}
