# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The support plane: found where there is one, of several the one that carries things, and none invented."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import Array
from scipy.spatial.transform import Rotation

from topo_region_seg.data import Cloud, Plane
from topo_region_seg.parameter_table import ParameterError
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.steps.support.hypotheses import best_hypothesis
from topo_region_seg.steps.support.level import ANY_WAY
from topo_region_seg.steps.support.search import MISS, find_support
from topo_region_seg.steps.support.surfaces import _fitted as weighed


def support(xyz: Array) -> Plane | None:
    return find_support(xyz, 0.01, 0.3, 0).plane


def balls(n: int, seed: int, points: int = 400) -> Array:
    """Halves of balls of 5 cm that face the sensor, spread over a room."""
    rng = np.random.default_rng(seed)
    found = []
    for center in rng.uniform([-0.6, -0.4, 0.7], [0.6, 0.4, 1.1], (n, 3)):
        d = rng.normal(size=(2 * points, 3))
        d /= np.linalg.norm(d, axis=1)[:, None]
        found.append(center + 0.05 * d[d @ center < 0.0])
    return np.concatenate(found)


def table(points: int, seed: int, noise: float = 0.002) -> Array:
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(-0.4, 0.4, (points, 2)), 1.2 + rng.normal(0.0, noise, points)])


@pytest.mark.parametrize("seed", range(10))
def test_no_plane_among_things_in_the_air(seed: int) -> None:
    assert support(balls(50, seed)) is None


@pytest.mark.parametrize("seed", range(10))
def test_no_plane_in_points_all_over_a_room(seed: int) -> None:
    xyz = np.random.default_rng(seed).uniform([-0.5, -0.5, 0.6], [0.5, 0.5, 1.6], (20_000, 3))
    assert support(xyz) is None


@pytest.mark.parametrize("share", [0.1, 0.15, 0.3])
@pytest.mark.parametrize("seed", range(8))
def test_a_table_with_a_tenth_of_the_points_is_found(share: float, seed: int) -> None:
    points = 20_000
    clutter = balls(50, seed)[: int((1.0 - share) * points)]
    plane = support(np.concatenate([table(int(share * points), seed), clutter]))
    assert plane is not None
    assert abs(plane.normal[2]) > 0.999 and plane.offset == pytest.approx(1.2, abs=0.005)


def room(with_box: bool) -> tuple[Array, Array]:
    """A level camera half a metre above a floor that ends at a wall, 1.6 m away; which points are the wall's."""
    u, v = np.meshgrid((np.arange(320) - 160) / 262.5, (np.arange(240) - 120) / 262.5)
    rays = np.stack([u, v, np.ones_like(u)], axis=-1)
    floor = np.where(v > 1e-6, 0.5 / np.maximum(v, 1e-6), np.inf)
    wall = floor > 1.6
    z = np.minimum(floor, 1.6)
    if with_box:
        box = (np.abs(u * 1.2) < 0.1) & (v * 1.2 > 0.3) & (v * 1.2 < 0.5)
        z, wall = np.where(box, 1.2, z), wall & ~box
    z = z + np.random.default_rng(0).normal(0.0, 0.0012, z.shape) * z**2
    return (rays * z[..., None]).reshape(-1, 3), wall.ravel()


def test_a_floor_that_carries_a_box_is_chosen_before_a_larger_wall() -> None:
    xyz, wall = room(with_box=True)
    assert wall.mean() > 0.5
    plane = support(xyz)
    assert plane is not None and plane.normal[1] < -0.99


def test_where_nothing_stands_on_either_the_larger_plane_goes() -> None:
    plane = support(room(with_box=False)[0])
    assert plane is not None and plane.normal[2] < -0.99


UP = np.array([0.0, -1.0, 0.0])


@pytest.mark.parametrize("with_box", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_where_up_is_known_the_floor_goes_however_the_camera_is_turned(with_box: bool, seed: int) -> None:
    xyz, _ = room(with_box)
    turn = Rotation.random(random_state=seed)
    found = find_support(turn.apply(xyz), 0.01, 0.3, 0, up=turn.apply(UP)).plane
    assert found is not None
    assert np.array(found.normal) @ turn.apply(UP) > 0.999 and found.offset == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("tilt", "level"), [(8.0, True), (13.0, False)])
def test_a_plane_that_is_not_level_carries_nothing(tilt: float, level: bool) -> None:
    up = Rotation.from_euler("z", tilt, degrees=True).apply(UP)
    assert (find_support(room(False)[0], 0.01, 0.3, 0, up=up).plane is not None) == level


def test_a_ceiling_carries_nothing() -> None:
    xyz = room(with_box=False)[0] * [1.0, -1.0, 1.0]
    assert find_support(xyz, 0.01, 0.3, 0, up=-UP).plane is not None
    assert find_support(xyz, 0.01, 0.3, 0, up=UP).plane is None


@pytest.mark.parametrize("output", ["regions", "objects"])
def test_the_parameter_up_leaves_the_wall(output: str) -> None:
    """A wall that a shelf stands out of carries things, too, and is larger."""
    xyz, wall = room(with_box=False)
    grid = xyz.reshape(240, 320, 3)
    shelf = np.zeros((240, 320), np.bool_)
    shelf[40:60, 60:260] = True
    grid[shelf] *= (1.5 / grid[shelf][:, 2])[:, None]
    rgb = np.where(wall[:, None], [[120, 130, 140]], [[150, 150, 150]]).astype(np.uint8)
    cloud = Cloud(grid.reshape(-1, 3), rgb, 240, 320)
    wall &= ~shelf.ravel()
    floor = ~wall & ~shelf.ravel()

    def labeled(params: Params) -> tuple[float, float]:
        seg = Pipeline(params).run(cloud, lambda *_: None)
        return float((seg.labels[wall] > 0).mean()), float((seg.labels[floor] > 0).mean())

    blind = Params(output="regions")
    assert labeled(blind)[0] < 0.1, "the wall goes where up is not known"
    found = labeled(Params(output=output, up=(0.0, -2.0, 0.0)))
    assert found[1] < 0.1, "the floor goes"
    assert found[0] > 0.9 or output == "objects", "and the wall stays, unless only things do"


def test_up_needs_a_direction() -> None:
    with pytest.raises(ParameterError, match=r"up \[0.0, 0.0, 0.0\]: must have a direction"):
        Params(up=(0.0, 0.0, 0.0))


def test_a_plane_that_the_scene_is_seen_through_is_none() -> None:
    """A frame of 0.1 m round an opening, through which a rough heap is seen behind it."""
    rng = np.random.default_rng(0)
    rim = rng.uniform([-0.4, -0.4, 0.0], [0.4, 0.4, 0.0], (20_000, 3)) + [0.0, 0.0, 0.8]
    rim = rim[np.max(np.abs(rim[:, :2]), axis=1) > 0.3]
    heap = balls(60, 1) + [0.0, 0.0, 0.3]
    heap = heap[np.max(np.abs(heap[:, :2] / heap[:, 2:]), axis=1) < 0.3 / 0.8]
    assert len(heap) > 0.5 * len(rim)
    assert support(np.concatenate([rim, heap])) is None
    assert support(np.concatenate([rim, heap[: len(heap) // 20]])) is not None


def test_triples_are_drawn_until_a_miss_is_unlikely() -> None:
    """Only the last of the triples lies on the plane: it counts where planes of that share must not be missed."""
    rng = np.random.default_rng(0)
    xyz = np.concatenate([np.column_stack([rng.random((400, 2)), np.zeros(400)]), rng.random((600, 3)) + [0, 0, 5]])
    xyz = xyz[rng.permutation(1000)]
    on = np.flatnonzero(np.abs(xyz[:, 2]) < 1e-9)
    off = np.flatnonzero(xyz[:, 2] > 1.0)
    triples = np.concatenate([rng.choice(off, (500, 3)), on[None, :3]])
    near = np.full(1000, 1e-3)
    assert best_hypothesis(xyz, triples, near, 100.0, MISS, ANY_WAY, 0.0)[2] == 400
    assert best_hypothesis(xyz, triples, near, 400.0, MISS, ANY_WAY, 0.0)[2] < 400


@pytest.mark.parametrize("seed", range(5))
def test_each_point_is_on_a_plane_within_a_distance_of_its_own(seed: int) -> None:
    """One triple, so one plane: its inliers, and the fit to them, against NumPy."""
    rng = np.random.default_rng(seed)
    xyz = np.column_stack([rng.random((300, 2)), 2.0 + rng.normal(0.0, 0.01, 300)])
    near = rng.uniform(0.001, 0.03, 300)
    normal, offset, inliers = best_hypothesis(xyz, np.array([[0, 1, 2]]), near, 3.0, MISS, ANY_WAY, 0.0)
    wanted = np.cross(xyz[1] - xyz[0], xyz[2] - xyz[0])
    wanted /= np.linalg.norm(wanted)
    assert abs(wanted @ normal) == pytest.approx(1.0)
    on = np.abs((xyz - xyz[0]) @ wanted) <= near
    if 2 * on[:128].sum() * 300 >= 3.0 * 128:
        assert inliers == on.sum() and offset == pytest.approx(-normal @ xyz[0])


def test_a_plane_is_fitted_to_the_points_within_their_distances() -> None:
    """Half of the points lie 5 mm higher, too far for them, though not for the others."""
    rng = np.random.default_rng(0)
    xyz = np.column_stack([rng.random((300, 2)), 2.0 + rng.normal(0.0, 0.001, 300)])
    xyz[150:, 2] += 0.005
    fit, far = weighed(xyz, np.repeat([0.01, 0.0005], 150), np.array([0.0, 0.0, -1.0]), 2.0)
    on = np.abs(xyz @ fit + far) <= np.repeat([0.01, 0.0005], 150)
    assert on[:150].all() and not on[150:].any()
    middle = xyz[:150].mean(axis=0)
    least = np.linalg.svd(xyz[:150] - middle)[2][2]
    assert abs(least @ fit) == pytest.approx(1.0, abs=1e-9) and far == pytest.approx(-fit @ middle)


@pytest.mark.parametrize("places", [1, 2, 5, 20])
def test_many_points_at_few_places(places: int) -> None:
    rng = np.random.default_rng(places)
    xyz = rng.uniform(-1.0, 1.0, (places, 3))[rng.integers(0, places, 20_000)]
    assert support(xyz) is None
