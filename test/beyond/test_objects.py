# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Objects: regions united across convex borders, and across no others."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from oracles import unite_by_hand
from places import SHARED
from scipy.spatial import cKDTree

from topo_region_seg.beyond.objects.continuation import regions_along
from topo_region_seg.beyond.objects.convexity import Borders, find_borders
from topo_region_seg.beyond.objects.curvature import mean_curvatures
from topo_region_seg.beyond.objects.unite import _unite_convex
from topo_region_seg.compiled.kd_tree import position_tree
from topo_region_seg.compiled.leaf_blocks import leaf_blocks
from topo_region_seg.compiled.partition import uniform_regions
from topo_region_seg.data import Cloud
from topo_region_seg.growth import growth_of_output
from topo_region_seg.parameter_table import ParameterError
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

Floats = npt.NDArray[np.float64]
OBJECTS = Params(output="objects", remove_floor=False, voxel_size=0.0)
SPACING = 0.003
LABELED = SHARED / "bags" / "tabletop_labelled"


def face(origin: Floats, u: Floats, v: Floats, length: float = 0.09) -> Floats:
    """Return the points of a square, SPACING apart."""
    steps = np.arange(SPACING / 2, length, SPACING)
    a, b = (grid.ravel()[:, None] for grid in np.meshgrid(steps, steps))
    return origin + a * u + b * v


X, Y, Z = np.eye(3)


def box(corner: Floats, length: float = 0.09) -> Floats:
    """Return the three faces of a cube that the sensor sees when it looks along (1, 1, 1)."""
    return np.concatenate([face(corner, X, Y, length), face(corner, Y, Z, length), face(corner, Z, X, length)])


def objects(xyz: Floats, params: Params = OBJECTS) -> npt.NDArray[np.uint32]:
    return Pipeline(params).run(Cloud(xyz, None, 1, len(xyz))).labels


def same_partition(a: npt.NDArray[np.uint32], b: npt.NDArray[np.uint32]) -> bool:
    pairs = np.unique(np.column_stack([a, b]), axis=0)
    return len(pairs) == len(np.unique(a)) == len(np.unique(b))


CORNER = np.array([0.5, 0.5, 0.5])


def test_the_faces_of_a_box_are_one_object() -> None:
    xyz = box(CORNER)
    faces = Params(
        features="normals",
        max_radius=OBJECTS.object_radius,
        angle_threshold=OBJECTS.object_angle_threshold,
        normal_radius=OBJECTS.object_normal_radius,
        remove_floor=False,
        voxel_size=0.0,
    )
    regions = Pipeline(faces).run(Cloud(xyz, None, 1, len(xyz))).labels
    assert len(np.unique(regions[regions > 0])) >= 3
    assert (objects(xyz) == 1).all()


def test_a_box_on_a_wall_stays_apart_from_it() -> None:
    # The wall is the plane z = 0.59 behind the box; both side faces meet it at a concave edge.
    wall = face(np.array([0.40, 0.40, 0.59]), X, Y, 0.3)
    wall = wall[~((wall[:, 0] >= 0.5) & (wall[:, 0] < 0.59) & (wall[:, 1] >= 0.5) & (wall[:, 1] < 0.59))]
    thing = box(CORNER)
    labels = objects(np.concatenate([thing, wall]))
    most = [np.bincount(part).argmax() for part in (labels[: len(thing)], labels[len(thing) :])]
    assert most[0] != most[1] and min(most) > 0
    assert np.mean(labels[: len(thing)] == most[0]) > 0.9
    assert np.mean(labels[len(thing) :] == most[1]) > 0.9


def test_two_boxes_with_a_gap_are_two_objects() -> None:
    labels = objects(np.concatenate([box(CORNER), box(CORNER + 0.2 * X)]))
    assert len(np.unique(labels)) == 2


def test_objects_are_unions_of_regions_and_counted_from_one() -> None:
    rng = np.random.default_rng(1)
    xyz = np.concatenate([box(CORNER), box(CORNER + [0.2, 0.05, 0.0])]) + rng.normal(scale=0.0004, size=(5400, 3))
    seg = Pipeline(OBJECTS).run(Cloud(xyz, None, 1, len(xyz)))
    for root in np.unique(seg.components.root):
        assert len(np.unique(seg.labels[seg.components.root == root])) == 1
    assert np.array_equal(np.unique(seg.labels[seg.labels > 0]), np.arange(1, len(seg.regions) + 1))
    assert seg.regions.size.sum() == (seg.labels > 0).sum()


def test_neither_order_nor_a_turn_about_the_sensor_matters() -> None:
    rng = np.random.default_rng(2)
    xyz = np.concatenate([box(CORNER), box(CORNER + 0.13 * X)]) + rng.normal(scale=0.0004, size=(5400, 3))
    labels = objects(xyz)
    order = rng.permutation(len(xyz))
    np.testing.assert_array_equal(objects(xyz[order]), labels[order])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    assert same_partition(objects(xyz @ turn.T), labels)


@pytest.mark.parametrize("seed", range(5))
def test_borders_are_those_of_all_pairs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    xyz, normals = rng.random((400, 3)) * [0.1, 0.1, 0.01], rng.normal(size=(400, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    region, reach, tolerance = rng.integers(0, 40, 400), 0.02, 0.1
    loose = rng.random(400) < 0.1
    normals[loose], region[loose] = np.nan, -1
    tree = position_tree(xyz)
    blocks, uniform = leaf_blocks(tree, xyz, normals), uniform_regions(tree, region)
    found = find_borders(tree, blocks, region[tree.order], uniform, reach, tolerance, 0, 0)
    a, b = cKDTree(xyz).query_pairs(reach, output_type="ndarray").T
    judged = (region[a] != region[b]) & ~loose[a] & ~loose[b]
    a, b = a[judged], b[judged]
    apart = xyz[a] - xyz[b]
    distance = np.linalg.norm(apart, axis=1)
    opening = ((normals[a] - normals[b]) * apart).sum(axis=1)
    expected: dict[tuple[int, int], list[float]] = {}
    low_of, high_of = np.minimum(region[a], region[b]), np.maximum(region[a], region[b])
    for low, high, d, o in zip(low_of, high_of, distance, opening, strict=True):
        row = expected.setdefault((int(low), int(high)), [0.0, 0.0, np.inf])
        row[0] += 1
        row[1] += bool(o > -tolerance * d)
        row[2] = min(row[2], d)
    assert list(zip(found.first.tolist(), found.second.tolist(), strict=True)) == sorted(expected)
    rows = np.array([expected[key] for key in sorted(expected)])
    np.testing.assert_array_equal(np.column_stack([found.pairs, found.convex]), rows[:, :2])
    np.testing.assert_allclose(found.nearest, rows[:, 2], rtol=1e-12)


@pytest.mark.parametrize("middle", [0.0, 1000.0])
def test_turns_are_those_of_all_pairs(middle: float) -> None:
    rng = np.random.default_rng(5)
    xyz, normals = middle + rng.random((500, 3)) * [0.1, 0.1, 0.01], rng.normal(size=(500, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals[rng.random(500) < 0.1] = np.nan
    normals[0] = np.nan
    tree, radius, turn = position_tree(xyz), 0.015, np.empty(500)
    mean_curvatures(tree, leaf_blocks(tree, xyz, normals), radius, 0, len(tree.start), turn)
    known = ~np.isnan(normals[:, 0])
    for i in range(500):
        apart = xyz[i] - xyz
        near = known & (np.linalg.norm(apart, axis=1) <= radius)
        opening = ((normals[i] - normals[near]) * apart[near]).sum()
        expected = radius * opening / (apart[near] ** 2).sum() if known[i] and near.sum() > 1 else np.nan
        np.testing.assert_allclose(turn[i], expected, rtol=1e-4, atol=1e-5)


def test_the_turn_on_a_sphere_is_that_of_its_normals() -> None:
    directions = np.random.default_rng(6).normal(size=(20_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    tree, turn = position_tree(0.06 * directions), np.empty(20_000)
    for sign in (1.0, -1.0):  # seen from outside, and from inside
        blocks = leaf_blocks(tree, 0.06 * directions, sign * directions)
        mean_curvatures(tree, blocks, 0.012, 0, len(tree.start), turn)
        np.testing.assert_allclose(turn, sign * 0.2, rtol=1e-3)


def bent(inwards: bool, bend: float = 0.012) -> Floats:
    """Return two plates at a right angle, joined by an arc of radius `bend`, the edge towards or from the sensor."""
    arc = bend * np.arange(0.0, np.pi / 2, 0.05)
    along = np.concatenate([np.arange(-0.09, 0.0, 0.0015), arc, bend * np.pi / 2 + np.arange(0.0, 0.09, 0.0015)])
    turned = np.clip(along / bend, 0.0, np.pi / 2) - np.pi / 4
    before, behind = np.minimum(along, 0.0), np.maximum(along - bend * np.pi / 2, 0.0)
    side = bend * np.sin(turned) + (before + behind) * np.sqrt(0.5)
    depth = -bend * np.cos(turned) + (behind - before) * np.sqrt(0.5)
    steps = np.arange(-0.045, 0.045, 0.0015)
    a, row = (grid.ravel() for grid in np.meshgrid(steps, np.arange(len(along))))
    return np.column_stack([side[row], a, 1.0 + (-depth if inwards else depth)[row]])


def test_a_rounded_groove_parts_and_a_rounded_edge_does_not() -> None:
    groove = objects(bent(inwards=True))
    halves = [np.bincount(groove[side]).argmax() for side in (bent(True)[:, 0] < 0, bent(True)[:, 0] > 0)]
    assert sorted(halves) == [1, 2] and (groove > 0).all()
    assert (objects(bent(inwards=False)) == 1).all()
    assert (objects(bent(inwards=True), OBJECTS.replace(object_groove_angle=180.0)) == 1).all()


def test_points_continue_the_surface_that_they_lie_on() -> None:
    # Of the two walls of a corner the one that the point lies on, though the other one is nearer.
    floor, wall = face(np.zeros(3), X, Y) + [0.009, 0.0, 0.0], face(np.zeros(3), Z, Y) + [0.0, 0.0, 0.003]
    xyz = np.concatenate([floor, wall, [[0.003, 0.045, 0.0]], [[5.0, 5.0, 5.0]]])
    normals = np.repeat([Z, X, Z, Z], [len(floor), len(wall), 1, 1], axis=0)
    region = np.repeat([0, 1, 2, 2], [len(floor), len(wall), 1, 1])
    tree, points = position_tree(xyz), np.array([len(xyz) - 2, len(xyz) - 1])
    for across, expected in ((0.0, 1), (3.0, 0)):
        found = region.copy()
        given = tree, xyz, normals, region, uniform_regions(tree, region), 2, 0.015, across, points
        regions_along(*given, 0, 2, found)
        assert found[-2:].tolist() == [expected, 2]


def test_objects_have_parameters_of_their_own() -> None:
    params = Params(output="objects", object_radius=0.02, radius=0.005, angle_threshold=30.0)
    used = growth_of_output(params)
    assert (used.uses_color, used.max_radius, used.radius, used.angle) == (False, 0.02, 0.02, (0.0, 4.0))
    assert growth_of_output(params.replace(output="regions")).angle == (0.0, 30.0)
    assert list(params.without_effect()) == ["angle_threshold", "radius"]
    with pytest.raises(ParameterError, match="object_convexity"):
        Params(object_convexity=0.3)


@pytest.mark.parametrize("xyz", [np.zeros((0, 3)), np.ones((1, 3)), np.full((200, 3), 0.5), np.full((9, 3), np.nan)])
def test_degenerate_clouds(xyz: Floats) -> None:
    assert objects(xyz).shape == (len(xyz),)


def mean_measures(params: Params, whole_objects: bool) -> dict[str, float]:
    """Return the means over the labelled recording, by parts or by whole objects."""
    from topo_region_seg.offline.evaluation.measures import TruthReading
    from topo_region_seg.offline.evaluation.run import evaluate
    from topo_region_seg.offline.evaluation.source import Source, Task
    from topo_region_seg.offline.evaluation.version import program_version

    source = Source("tabletop", str(LABELED), reading=TruthReading(whole_objects))
    frames = evaluate(Task(source, params, program_version(), 0, None, 12)).frames
    return {name: float(np.mean([frame.measures[name] for frame in frames])) for name in ("wov", "fos", "fus")}


@pytest.mark.skipif(not LABELED.is_dir(), reason="needs ../shared/data")
def test_objects_of_the_labelled_recording() -> None:
    # The truth has the inside of a vessel as a part of its own.
    mean = mean_measures(Params(output="objects", object_vessels=False), whole_objects=False)
    # In one frame the handle of a cup and two parts of its body are one object; that is most of Fus.
    assert mean["wov"] > 0.975 and mean["fos"] < 0.017 and mean["fus"] < 0.06


@pytest.mark.skipif(not LABELED.is_dir(), reason="needs ../shared/data")
def test_whole_objects_of_the_labelled_recording() -> None:
    mean = mean_measures(Params(output="objects"), whole_objects=True)
    assert mean["wov"] > 0.94 and mean["fus"] < 0.01


@pytest.mark.parametrize("seed", range(40))
def test_convex_borders_are_opened_in_the_order_of_their_surety(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 14
    first, second = np.triu_indices(n, 1)
    there = rng.random(len(first)) < 0.35
    first, second = first[there], second[there]
    pairs = np.round(10.0 ** rng.uniform(1.0, 3.0, len(first)))
    convex = np.round(pairs * rng.uniform(0.55, 1.0, len(first)))
    body = rng.random(n) < 0.9
    borders = Borders(first, second, pairs, convex, rng.random(len(first)))
    wanted = unite_by_hand(borders, body, 0.75)
    np.testing.assert_array_equal(_unite_convex(borders, body, 0.75), wanted)
    assert len(np.unique(wanted)) < n


def test_a_border_of_few_pairs_is_less_sure_than_one_of_many() -> None:
    """Regions 0 and 2 meet concavely: 1 goes to the one with the surer border, though its share is the smaller one."""
    borders = Borders(
        np.array([0, 1, 0]), np.array([1, 2, 2]), np.array([4000.0, 25.0, 4000.0]), np.array([3800.0, 25.0, 0.0]), X
    )
    assert _unite_convex(borders, np.ones(3, bool), 0.8).tolist() == [0, 0, 2]


@pytest.mark.parametrize(("radius", "united"), [(0.008, False), (0.02, True)])
def test_faces_farther_apart_than_the_border_radius_are_not_compared(radius: float, united: bool) -> None:
    """Two faces of a box whose common edge the sensor did not see: a strip of 10 mm is missing."""
    xyz = np.concatenate([face(CORNER + 0.01 * X, X, Y), face(CORNER, Y, Z)])
    labels = objects(xyz, OBJECTS.replace(object_border_radius=radius))
    assert (len(np.unique(labels[labels > 0])) == 1) == united
