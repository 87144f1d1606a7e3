# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Small regions, numbering and properties of regions, against plain Python."""

from __future__ import annotations

from dataclasses import astuple
from typing import Any

import numpy as np
import pytest
from oracles import Points, random_points, same_partition, unit

import topo_region_seg as trs
from topo_region_seg.api import persistent_components
from topo_region_seg.compiled.kd_tree import position_tree
from topo_region_seg.data import Features
from topo_region_seg.growth import growth_of_regions
from topo_region_seg.params import Params
from topo_region_seg.steps.homogeneity import criterion, homogeneity_channels
from topo_region_seg.steps.regions import describe_regions, number_regions
from topo_region_seg.steps.small_regions import settle as settling
from topo_region_seg.steps.small_regions.ranks import ranks_of
from topo_region_seg.steps.small_regions.settle import CANDIDATES, REACH, settle_small_regions


def merge_by_hand(points: Points, root: np.ndarray, params: Params) -> np.ndarray:
    """Smallest region first: join the region of the most alike of the nearest foreign points within reach.

    Regions that end small get -1, unless there is but one.
    """
    region = root.copy()
    limit = 2.0 * np.sin(np.radians(params.angle_threshold) / 2.0)
    reach = REACH * growth_of_regions(params).radius
    keys = np.column_stack([points.xyz, points.lab, points.normals])
    stuck: set[int] = set()
    while True:
        names = [r for r in np.unique(region) if r not in stuck]
        order = sorted((np.sum(region == r), *min(keys[region == r].tolist()), r) for r in names)
        if not order or order[0][0] >= params.min_region_size:
            if len(names) + len(stuck) > 1:
                region[np.bincount(region, minlength=len(region))[region] < params.min_region_size] = -1
            return region
        name = order[0][-1]
        members = np.flatnonzero(region == name)
        p = min(members, key=lambda i: keys[i].tolist())
        low, high = points.xyz[members].min(axis=0), points.xyz[members].max(axis=0)
        beside = np.linalg.norm(points.xyz - np.clip(points.xyz, low, high), axis=1) <= reach
        foreign = np.flatnonzero((region != name) & beside)
        if len(foreign) == 0:
            stuck.add(name)
            continue
        offset = points.xyz[foreign] - points.xyz[p]
        d2 = offset[:, 0] ** 2 + offset[:, 1] ** 2 + offset[:, 2] ** 2
        near = sorted(zip(d2, keys[foreign].tolist(), foreign, strict=True))[:CANDIDATES]
        difference = [
            np.sum((points.lab[q] - points.lab[p]) ** 2) / params.color_threshold**2
            + np.sum((points.normals[q] - points.normals[p]) ** 2) / limit**2
            for _, _, q in near
        ]
        best = near[int(np.argmin(difference))][2]
        region[members] = region[best]
        stuck.discard(region[best])


def settle(xyz: np.ndarray, features: Features, root: np.ndarray, weight: np.ndarray, params: Params) -> np.ndarray:
    growth = growth_of_regions(params)
    channels = homogeneity_channels(xyz, features.lab, features.normals, growth)
    return settle_small_regions(channels, position_tree(xyz), root, weight, criterion(growth, growth.radius), params)


def ignore(code: str, text: str) -> None:
    """Take a warning."""


def roots(points: Points, params: Params) -> np.ndarray:
    return persistent_components(points.xyz, points.lab, points.normals, params).root


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(
    ("min_size", "angle", "radius"),
    [(2, 5.0, 0.012), (6, 5.0, 0.012), (40, 5.0, 0.012), (40, 180.0, 0.012), (2, 5.0, 0.002), (40, 5.0, 0.0005)],
)
def test_merging_equals_plain_python(seed: int, min_size: int, angle: float, radius: float) -> None:
    """Where all angles are allowed, normals are still compared: in units of the largest."""
    points = random_points(seed, 120)
    params = Params(max_radius=radius, min_region_size=min_size, angle_threshold=angle)
    if angle == 180.0:
        points = Points(points.xyz, points.lab, unit(np.random.default_rng(seed).normal(size=(120, 3))))
    root = roots(points, params)
    region = settle(points.xyz, Features(points.lab, points.normals), root, np.ones(120, int), params)
    assert same_partition(region, merge_by_hand(points, root, params))
    assert (region == -1).any() == (merge_by_hand(points, root, params) == -1).any()
    sizes = np.bincount(region[region >= 0])
    assert sizes.min(initial=min_size) >= min_size or len(np.unique(region)) == 1


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("radius", [0.001, 0.01])
def test_merging_does_not_depend_on_the_order(seed: int, radius: float) -> None:
    points, params = random_points(seed, 900), Params(max_radius=radius, min_region_size=30)
    order = np.random.default_rng(seed).permutation(900)
    shuffled, ones = points.take(order), np.ones(900, int)
    region = settle(points.xyz, Features(points.lab, points.normals), roots(points, params), ones, params)
    again = settle(shuffled.xyz, Features(shuffled.lab, shuffled.normals), roots(shuffled, params), ones, params)
    assert same_partition(region[order], again)
    np.testing.assert_array_equal(region[order] == -1, again == -1)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("factor", [0.25, 64.0])
def test_merging_follows_the_scale(seed: int, factor: float) -> None:
    points, ones = random_points(seed, 300), np.ones(300, int)
    params = Params(max_radius=0.002, min_region_size=12)
    large = Points(points.xyz * factor, points.lab, points.normals)
    region = settle(points.xyz, Features(points.lab, points.normals), roots(points, params), ones, params)
    params = params.replace(max_radius=0.002 * factor)
    again = settle(large.xyz, Features(large.lab, large.normals), roots(large, params), ones, params)
    np.testing.assert_array_equal(region, again)


@pytest.mark.parametrize("apart", [0.5, 2.9, 3.1, 200.0])
def test_a_speck_joins_what_is_within_reach_and_else_loses_its_label(apart: float) -> None:
    """Reach is counted in radii from the nearest face of the small region's box, not from its representative."""
    params = Params(features="color", max_radius=0.01, min_region_size=10)
    thread = np.column_stack([np.zeros(9), np.zeros(9), 1.0 + 0.009 * np.arange(9)])
    patch = np.column_stack([np.zeros(10), np.zeros(10), 1.072 + 0.01 * apart + 0.001 * np.arange(10)])
    xyz = np.concatenate([thread, patch])
    root = np.repeat([0, 9], [9, 10])
    region = settle(xyz, Features(np.zeros((19, 3)), None), root, np.ones(19, int), params)
    np.testing.assert_array_equal(region, np.repeat([0 if apart < REACH else -1, 0], [9, 10]))


@pytest.mark.parametrize("seed", range(8))
def test_no_box_grows_farther_than_the_small_regions_reach(seed: int) -> None:
    """Far points join nothing: what is added to a cloud beyond reach of it changes none of its regions."""
    points, params = random_points(seed, 300), Params(max_radius=0.002, min_region_size=12)
    rng = np.random.default_rng(seed)
    far = Points(rng.random((5, 3)) * 4.0 + 1.5, points.lab[:5], points.normals[:5])
    both = Points(*(np.concatenate(pair) for pair in zip(astuple(points), astuple(far), strict=True)))
    alone = settle(points.xyz, Features(points.lab, points.normals), roots(points, params), np.ones(300, int), params)
    region = settle(both.xyz, Features(both.lab, both.normals), roots(both, params), np.ones(305, int), params)
    np.testing.assert_array_equal(region, np.append(alone, np.full(5, -1)))


def test_removing_takes_the_label_of_small_regions_only() -> None:
    points, params = random_points(1, 900), Params(max_radius=0.01, min_region_size=30, small_regions="remove")
    root = roots(points, params)
    region = settle(points.xyz, Features(points.lab, points.normals), root, np.ones(900, int), params)
    sizes = np.bincount(root, minlength=900)
    np.testing.assert_array_equal(region == -1, sizes[root] < 30)
    assert same_partition(region[region >= 0], root[region >= 0])


def test_size_counts_the_input_points_that_a_point_stands_for() -> None:
    xyz = np.array([[0.0, 0.0, 1.0], [0.5, 0.0, 1.0], [1.0, 0.0, 1.0]])
    params = Params(features="color", min_region_size=10, small_regions="remove")
    region = settle(xyz, Features(np.zeros((3, 3)), None), np.arange(3), np.array([9, 10, 11]), params)
    np.testing.assert_array_equal(region, [-1, 0, 1])


def test_a_region_alone_stays_however_small() -> None:
    features, root = Features(np.zeros((3, 3)), None), np.zeros(3, int)
    region = settle(np.eye(3) * 0.001, features, root, np.ones(3, int), Params(features="color"))
    np.testing.assert_array_equal(region, [0, 0, 0])


def test_where_all_regions_stay_small_none_is_left_and_a_notice_says_so() -> None:
    cloud = trs.Cloud(np.eye(3) + 1.0, None, 3, 1)
    seg = trs.Pipeline(Params(features="normals", remove_floor=False)).run(cloud, ignore)
    assert not seg.labels.any()
    assert [notice.code for notice in seg.notices] == ["no_regions"]
    assert "the largest of 1, and stay below it when merged" in seg.notices[0].text


@pytest.mark.parametrize("min_size", [20, 1_000, 10_000_000])
def test_no_more_is_done_for_a_size_that_no_region_can_reach(min_size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    points = random_points(1, 200)
    asked: list[int] = []
    merge = settling.merge_small_regions

    def asking(*given: Any) -> Any:
        asked.append(given[9])
        return merge(*given)

    monkeypatch.setattr(settling, "merge_small_regions", asking)
    params = Params(max_radius=0.01, min_region_size=min_size)
    settle(points.xyz, Features(points.lab, points.normals), roots(points, params), np.ones(200, int), params)
    assert asked == [min(min_size, 201)]


def test_numbers_go_by_size_then_by_coordinates() -> None:
    xyz = np.array([[5, 0, 0], [4, 0, 0], [1, 2, 0], [1, 3, 0], [9, 9, 9], [0, 0, 0], [0, 0, 1], [7, 7, 7]], float)
    region = np.array([2, 2, 0, 0, -1, 1, 1, 1])
    np.testing.assert_array_equal(number_regions(xyz, region, np.ones(8, int)), [3, 3, 2, 2, 0, 1, 1, 1])
    weight = np.array([1, 9, 1, 1, 1, 1, 1, 1])
    np.testing.assert_array_equal(number_regions(xyz, region, weight), [1, 1, 3, 3, 0, 2, 2, 2])


def test_properties_of_regions() -> None:
    rng = np.random.default_rng(0)
    n = 500
    xyz, lab = rng.random((n, 3)), rng.random((n, 3)) * 100.0
    normals = random_points(0, n).normals
    labels = rng.integers(0, 5, n).astype(np.uint32)
    weight = rng.integers(1, 4, n)
    persistence = rng.random(4)
    table = describe_regions(xyz, Features(lab, normals), labels, weight, persistence)
    assert len(table) == 4
    for region in table:
        mine = labels == region.label
        assert region.size == weight[mine].sum()
        np.testing.assert_allclose(region.centroid, np.average(xyz[mine], axis=0, weights=weight[mine]))
        np.testing.assert_allclose(region.mean_lab, np.average(lab[mine], axis=0, weights=weight[mine]))
        np.testing.assert_array_equal(region.minimum, xyz[mine].min(axis=0))
        np.testing.assert_array_equal(region.maximum, xyz[mine].max(axis=0))
        assert np.linalg.norm(region.mean_normal) == pytest.approx(1.0)
        assert region.persistence == persistence[region.label - 1]
    with pytest.raises(IndexError):
        table[4]


def test_no_regions() -> None:
    table = describe_regions(
        np.ones((3, 3)),
        Features(None, None),
        np.zeros(3, np.uint32),
        np.ones(3, int),
        np.zeros(0),
    )
    assert len(table) == 0
    assert list(table) == []


@pytest.mark.parametrize("seed", [3, 7, 11])
def test_of_neighbors_that_are_equally_alike_the_nearest_is_joined(seed: int) -> None:
    """On a lattice, with one color and one normal: distances decide, and the order of coordinates where they tie."""
    points = random_points(seed, 120)
    alike = Points(points.xyz, np.full((120, 3), 50.0), np.tile([0.0, 0.0, -1.0], (120, 1)))
    root = roots(points, Params(max_radius=0.005))
    params = Params(max_radius=0.005, min_region_size=5)
    region = settle(alike.xyz, Features(alike.lab, alike.normals), root, np.ones(120, int), params)
    assert same_partition(region, merge_by_hand(alike, root, params))
    assert 1 < len(np.unique(region)) < len(np.unique(root))


def test_a_region_of_exactly_the_smallest_size_stays() -> None:
    xyz = np.array([[0.0, 0.0, 1.0], [0.5, 0.0, 1.0]])
    params = Params(features="color", min_region_size=10)
    region = settle(xyz, Features(np.zeros((2, 3)), None), np.arange(2), np.array([10, 30]), params)
    assert region[0] != region[1]


@pytest.mark.parametrize("kinds", [1, 2, 4, 1_000])
def test_ranks_are_places_in_the_order_of_all_channels(kinds: int) -> None:
    rng = np.random.default_rng(kinds)
    channels = rng.integers(0, kinds, (2_000, 9)) / kinds
    channels[:, 8] = rng.permutation(2_000)
    points = rng.permutation(2_000)[:700]
    order = np.lexsort(channels[points, ::-1].T)
    np.testing.assert_array_equal(ranks_of(channels, points)[order], np.arange(700))
