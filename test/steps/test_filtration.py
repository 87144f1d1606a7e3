# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The filtration against independent oracles, and the properties that must always hold."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import (
    Points,
    check_against_oracles,
    elder_rule_deaths,
    homogeneous_edges,
    partition,
    random_points,
    same_partition,
    unit,
)
from scipy.spatial.transform import Rotation

from topo_region_seg.api import persistent_components
from topo_region_seg.data import Components
from topo_region_seg.params import Params
from topo_region_seg.steps.filtration import persistence as filtration

STEPS = 10
CASES = [(seed, n) for seed, n in zip(range(36), [3, 40, 150, 400, 900, 1500] * 6, strict=True)]


def components_of(points: Points, params: Params) -> Components:
    return persistent_components(points.xyz, points.lab, points.normals, params)


@pytest.mark.parametrize("features", ["color+normals", "color", "normals"])
@pytest.mark.parametrize(("seed", "n"), CASES)
def test_components_and_deaths_equal_the_oracles(seed: int, n: int, features: str) -> None:
    points, params = random_points(seed, n), Params(max_radius=0.012, features=features)
    check_against_oracles(points, params)


@pytest.mark.parametrize(("seed", "n"), CASES[:12])
def test_starting_again_changes_nothing(seed: int, n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(filtration, "WAITING_LIMIT", 0)
    check_against_oracles(random_points(seed, n), Params(max_radius=0.012))


@pytest.mark.parametrize(("seed", "n"), CASES)
def test_finite_deaths_and_regions_add_up(seed: int, n: int) -> None:
    result = components_of(random_points(seed, n), Params())
    survivors = np.flatnonzero(np.isinf(result.death))
    assert np.isfinite(result.death).sum() + len(np.unique(result.root)) == n
    np.testing.assert_array_equal(survivors, np.unique(result.root))


@pytest.mark.parametrize(("seed", "n"), CASES[:12])
def test_stepped_deaths_are_exact_deaths_rounded_up(seed: int, n: int) -> None:
    result = components_of(random_points(seed, n), Params())
    scales = result.scales(STEPS)
    for exact, stepped in zip(result.death, result.stepped(STEPS), strict=True):
        assert stepped == (scales[scales >= exact].min() if np.isfinite(exact) else np.inf)


@pytest.mark.parametrize(("seed", "n"), CASES[:12])
def test_shuffling_changes_nothing_but_the_ids(seed: int, n: int) -> None:
    points, order = random_points(seed, n), np.random.default_rng(seed).permutation(n)
    result, shuffled = components_of(points, Params()), components_of(points.take(order), Params())
    assert same_partition(result.root[order], shuffled.root)
    np.testing.assert_array_equal(np.sort(result.death), np.sort(shuffled.death))


@pytest.mark.parametrize(("seed", "n"), CASES[:12])
def test_the_conditions_of_the_paper_hold(seed: int, n: int) -> None:
    points, params = random_points(seed, n), Params(max_radius=0.012)
    result = components_of(points, params)
    pairs, _ = homogeneous_edges(points, params)
    inside = result.root[pairs[:, 0]] == result.root[pairs[:, 1]]
    assert inside.all()  # (4): no edge joins two regions
    for root in np.unique(result.root):  # (1) a partition, (2) connected, (3) along homogeneous edges
        members = np.flatnonzero(result.root == root)
        assert members.min() == root
        rename = np.full(n, -1)
        rename[members] = np.arange(len(members))
        edges = rename[pairs[np.isin(pairs[:, 0], members)]]
        assert (partition(len(members), edges) == 0).all()


@pytest.mark.parametrize(("seed", "n"), [(0, 400), (1, 900), (2, 900)])
def test_scaling_and_rigid_motion_leave_the_partition(seed: int, n: int) -> None:
    points, params = random_points(seed, n), Params(max_radius=0.012)
    result = components_of(points, params)
    scaled = components_of(Points(points.xyz * 3.7, points.lab, points.normals), params.replace(max_radius=0.012 * 3.7))
    turn = Rotation.from_euler("xyz", [0.3, -1.1, 2.0])
    moved = components_of(
        Points(turn.apply(points.xyz) + np.array([0.5, -2.0, 1.0]), points.lab, turn.apply(points.normals)), params
    )
    np.testing.assert_array_equal(result.root, scaled.root)
    np.testing.assert_array_equal(result.root, moved.root)
    np.testing.assert_allclose(scaled.death, result.death * 3.7)


def faces(kind: str, n: int, seed: int) -> np.ndarray:
    """Return n points in parts that face each other across gaps of many spacings."""
    rng = np.random.default_rng(seed)
    part = np.arange(n) % 3
    if kind == "shells":
        direction = rng.normal(size=(n, 3))
        return direction / np.linalg.norm(direction, axis=1, keepdims=True) * np.array([0.1, 0.2, 0.35])[part][:, None]
    sheet = np.column_stack([rng.uniform(0.0, 0.3, (n, 2)), np.zeros(n)])
    if kind.endswith("sheets"):
        height = np.array([0.0, 0.13, 0.5])[part] * (7.0 if kind == "far sheets" else 1.0)
        return sheet + height[:, None] * [0.0, 0.0, 1.0] + rng.normal(0.0, 1e-3, (n, 3))
    return rng.normal(0.0, 0.01, (n, 3)) + np.array([0.0, 0.6, 0.65])[part][:, None]


@pytest.mark.parametrize("colors", [1, 3])
@pytest.mark.parametrize("kind", ["shells", "sheets", "far sheets", "clusters"])
@pytest.mark.parametrize("seed", range(3))
def test_a_radius_of_many_spacings_equals_the_oracles(kind: str, colors: int, seed: int) -> None:
    """With three colors that are never joined, each part stays in three components, which face each other too."""
    xyz = faces(kind, 900, seed)
    lab = 50.0 * np.random.default_rng(seed).integers(0, colors, (len(xyz), 1)) * [1.0, 0.0, 0.0]
    points = Points(xyz, lab, np.tile([0.0, 0.0, 1.0], (len(xyz), 1)))
    check_against_oracles(points, Params(max_radius=5.0, features="color"))


@pytest.mark.parametrize("kind", ["shells", "sheets", "far sheets", "clusters"])
def test_a_large_radius_leaves_little_to_do(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Counted are edges and unions of each round: no round comes after the last union, and edges are in proportion."""
    rounds: list[tuple[int, int]] = []
    unite = filtration.unite_edges

    def counted(forest: object, edges: object, order: np.ndarray) -> int:
        rounds.append((len(order), unite(forest, edges, order)))
        return rounds[-1][1]

    dropped: list[int] = []
    span = filtration.spanning_edges

    def kept(forest: object, edges: object, order: np.ndarray) -> int:
        left = span(forest, edges, order)
        dropped.append(len(order) - left)
        return left

    monkeypatch.setattr(filtration, "unite_edges", counted)
    monkeypatch.setattr(filtration, "spanning_edges", kept)
    xyz = faces(kind, 20_000, 0)
    found = persistent_components(xyz, np.zeros_like(xyz), None, Params(max_radius=5.0, features="color"))
    assert np.isinf(found.death).sum() == 1 and rounds[-1][1] > 0
    assert sum(edges for edges, _ in rounds) + sum(dropped) < 25 * len(xyz)


@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 60),
    st.floats(0.0, 20.0),
    st.floats(0.0, 30.0),
    st.floats(0.0, 20.0),
    st.floats(0.0, 40.0),
)
@settings(max_examples=150, deadline=None)
def test_any_thresholds(seed: int, n: int, color_low: float, color_width: float, low: float, width: float) -> None:
    params = Params(
        max_radius=0.03,
        min_color_threshold=color_low,
        color_threshold=color_low + color_width,
        min_angle_threshold=low,
        angle_threshold=low + width,
    )
    points = random_points(seed, n)
    result = components_of(points, params)
    pairs, lengths = homogeneous_edges(points, params)
    np.testing.assert_array_equal(result.death, elder_rule_deaths(n, pairs, lengths))
    np.testing.assert_array_equal(result.root, partition(n, pairs))


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
@settings(max_examples=60, deadline=None)
def test_points_without_normals_take_part_by_color(seed: int, n: int) -> None:
    points = random_points(seed, n)
    missing = np.random.default_rng(seed).random(n) < 0.3
    normals = np.where(missing[:, None], np.nan, points.normals)
    by_both, by_color = Params(max_radius=0.03), Params(max_radius=0.03, features="color")
    edges = {tuple(pair) for pair in homogeneous_edges(points, by_both)[0] if not missing[pair].any()}
    edges |= {tuple(pair) for pair in homogeneous_edges(points, by_color)[0] if missing[pair].any()}
    pairs = np.array(sorted(edges), np.int64).reshape(-1, 2)
    result = persistent_components(points.xyz, points.lab, normals, by_both)
    np.testing.assert_array_equal(result.root, partition(n, pairs))
    alone = persistent_components(points.xyz, None, normals, Params(max_radius=0.03, features="normals"))
    assert np.isinf(alone.death[missing]).all()
    np.testing.assert_array_equal(alone.root[missing], np.flatnonzero(missing))


@pytest.mark.parametrize("n", [0, 1, 2, 8, 9, 17])
def test_few_points(n: int) -> None:
    xyz = np.column_stack([np.arange(n) * 0.01, np.zeros(n), np.ones(n)])
    result = persistent_components(xyz, np.zeros((n, 3)), None, Params(features="color", max_radius=0.011))
    assert (result.root == 0).all()
    assert np.isinf(result.death[:1]).all()
    np.testing.assert_allclose(result.death[1:], 0.01)


def test_coinciding_points_die_at_zero() -> None:
    n = 30_000
    same = np.ones((n, 3))
    result = persistent_components(same, same, same, Params())
    assert (result.root == 0).all()
    assert np.isinf(result.death[0])
    assert (result.death[1:] == 0.0).all()


def test_tiny_and_huge_coordinates() -> None:
    xyz = np.array([[0.0, 0.0, 1e-200], [0.0, 0.0, 3e-200], [1e30, 0.0, 0.0], [1e30, 1e-3, 0.0]])
    result = persistent_components(xyz, np.zeros((4, 3)), None, Params(features="color"))
    np.testing.assert_array_equal(result.root, [0, 0, 2, 2])
    np.testing.assert_allclose(result.death, [np.inf, 0.0, np.inf, 1e-3])


# The peak of the process itself: ru_maxrss would count what this one had when it forked.
DENSE_BALL = """
import re, numpy as np
from topo_region_seg import Params, persistent_components
rng = np.random.default_rng(0)
ball = rng.normal(size=(20_000, 3))
ball *= 0.01 * rng.random((20_000, 1)) ** (1 / 3) / np.linalg.norm(ball, axis=1, keepdims=True)
result = persistent_components(ball, rng.random((20_000, 3)) * 5.0, None, Params(max_radius=0.02, features="color"))
assert len(np.unique(result.root)) == 1
print(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1])
"""


def test_a_dense_ball_needs_little_memory(warm_kernels: None) -> None:
    """20,000 points within one radius of each other, 200 million pairs: the whole process under 500 MB."""
    run = subprocess.run([sys.executable, "-c", DENSE_BALL], capture_output=True, text=True, timeout=240, check=True)
    peak_mb = int(run.stdout) / 1024
    assert peak_mb < 500


def test_bad_arrays_are_refused() -> None:
    good = np.zeros((4, 3))
    with pytest.raises(ValueError, match="lab is missing"):
        persistent_components(good, None, good, Params())
    with pytest.raises(ValueError, match=r"normals has shape \(3, 3\), must be \(4, 3\)"):
        persistent_components(good, good, good[:3], Params())
    with pytest.raises(ValueError, match="xyz holds values that are not finite"):
        persistent_components(np.full((4, 3), np.nan), good, good, Params())


def test_normals_need_not_be_unit() -> None:
    points = random_points(1, 300)
    scaled = Points(points.xyz, points.lab, points.normals * np.linspace(0.1, 9.0, 300)[:, None])
    np.testing.assert_allclose(components_of(scaled, Params()).death, components_of(points, Params()).death)
    assert (np.linalg.norm(unit(scaled.normals), axis=1) > 0.99).all()


@pytest.mark.parametrize(
    ("features", "thresholds"),
    [("normals", {"min_color_threshold": 1.0}), ("color", {"min_angle_threshold": 1.0})],
)
def test_what_is_not_compared_has_no_threshold(features: str, thresholds: dict[str, float]) -> None:
    points, params = random_points(3, 200), Params(features=features)
    with_threshold, without = (components_of(points, p) for p in (params.replace(**thresholds), params))
    assert np.array_equal(with_threshold.root, without.root)
    assert np.array_equal(with_threshold.death, without.death)
