# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames that leave much to do: the work that they make, counted; and the benchmark that times them, its page."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from places import ROOT

sys.path.append(str(ROOT))  # last, so that an installed copy of the package is the one that is tested

from benchmarks import hard_frames, recordings, worst_frames
from benchmarks.worst_frames import OUTPUTS, Figures, page, usual
from topo_region_seg.compiled.kd_tree import LEAF, position_tree
from topo_region_seg.data import FloatArray
from topo_region_seg.growth import growth_of_regions
from topo_region_seg.params import Params
from topo_region_seg.steps.color import srgb_to_lab
from topo_region_seg.steps.homogeneity import criterion, homogeneity_channels
from topo_region_seg.steps.normals import estimate
from topo_region_seg.steps.normals.neighborhoods import fill_normals
from topo_region_seg.steps.small_regions import settle
from topo_region_seg.steps.small_regions.candidates import fill_near_lists
from topo_region_seg.steps.small_regions.merging import merge_small_regions

SIZES = ((80, 60), (160, 120))


def points(name: str, size: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
    cloud = hard_frames.MADE[name](*size)
    assert cloud.rgb is not None
    return cloud.xyz.astype(np.float64), srgb_to_lab(cloud.rgb)


@pytest.mark.parametrize("name", hard_frames.MADE)
def test_normals_of_sparse_points_visit_few_leaves_each(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The smaller clouds are the sparser ones: in the smallest hardly a point has neighbors within the radius."""
    for size in SIZES:
        xyz, _ = points(name, size)
        visited: list[int] = []
        monkeypatch.setattr(estimate, "fill_normals", lambda *given, into=visited: into.append(fill_normals(*given)))
        for radius in (0.01, 0.1):
            estimate.estimate_normals(xyz, position_tree(xyz), radius, 8)
        assert sum(visited) <= 2 * 60 * (len(xyz) / LEAF + 1)


@pytest.mark.parametrize("name", hard_frames.MADE)
def test_merging_visits_few_leaves_each(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of regions that are single points or, along the rows of the image, ten of them."""
    for size in SIZES:
        xyz, lab = points(name, size)
        visited: list[int] = []

        def merging(*given, into=visited):  # type: ignore[no-untyped-def]
            target, leaves = merge_small_regions(*given)
            into.append(leaves)
            return target, leaves

        def filling(*given, into=visited):  # type: ignore[no-untyped-def]
            into.append(fill_near_lists(*given))

        monkeypatch.setattr(settle, "merge_small_regions", merging)
        monkeypatch.setattr(
            settle, "fill_near_lists", lambda *given, into=visited: into.append(fill_near_lists(*given))
        )
        growth = growth_of_regions(Params(features="color"))
        channels = homogeneity_channels(xyz, lab, None, growth)
        given = channels, position_tree(xyz)
        for root in (np.arange(len(xyz)), np.arange(len(xyz)) // 10 * 10):
            for radius in (0.005, 0.05):
                params = Params(min_region_size=64)
                settle.settle_small_regions(
                    *given, root, np.ones(len(xyz), np.int64), criterion(growth, radius), params
                )
        assert sum(visited) <= 4 * 20 * len(xyz)


def test_hard_frames_have_the_size_that_is_asked_for() -> None:
    for make in hard_frames.MADE.values():
        cloud = make(40, 30)
        assert len(cloud) == cloud.width * cloud.height == 1_200
        assert np.isfinite(cloud.xyz).all() and cloud.rgb is not None


def test_frames_of_a_folder_are_read_and_none_without_it(tmp_path: Path) -> None:
    depth = np.array([[0, 10_000], [20_000, 5_000]], np.uint16)
    matrix = np.array([[2.0, 0.0, 0.5], [0.0, 4.0, 0.5], [0.0, 0.0, 1.0]])
    np.savez(tmp_path / "one.npz", depth=depth, depth_scale=10_000.0, K=matrix, rgb=np.zeros((2, 2, 3), np.uint8))
    ((name, cloud),) = hard_frames.scenes(tmp_path)
    assert (name, cloud.width, cloud.height) == ("one", 2, 2)
    assert np.isnan(cloud.xyz[0]).all()
    np.testing.assert_allclose(cloud.xyz[1:], [[0.25, -0.125, 1.0], [-0.5, 0.25, 2.0], [0.125, 0.0625, 0.5]])
    assert list(hard_frames.scenes(tmp_path / "nowhere")) == []


def figures(name: str, seconds: float) -> Figures:
    return Figures(name, 1_000, dict.fromkeys(OUTPUTS, seconds), dict.fromkeys(OUTPUTS, "normals"))


def test_the_page_says_what_misses_the_goal() -> None:
    ordinary = usual([figures("a", 0.01), figures("b", 0.02), figures("c", 0.5)])
    assert ordinary.seconds == dict.fromkeys(OUTPUTS, 0.02)
    text = page(ordinary, [figures("quick", 0.06), figures("slow", 0.07)], "Others were not there.")
    assert "| quick | 1,000 | 3.0 | 3.0 | 3.0 | 3.0 |" in text
    assert f"| slow | 1,000 |{' **3.5** (normals) |' * 4}" in text
    assert "4 of 8 figures reach it" in text
    assert "Others were not there." in text
    assert "more than\n3.5 times the tabletop's" in text


def test_the_benchmark_writes_its_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cloud = hard_frames.room(40, 30)
    monkeypatch.setattr(recordings, "frames", lambda: (SimpleNamespace(name="table", cloud=lambda: cloud),))
    monkeypatch.setattr(worst_frames, "WIDTH", 40)
    monkeypatch.setattr(worst_frames, "HEIGHT", 30)
    monkeypatch.setattr(hard_frames, "SCENES", tmp_path / "nowhere")
    assert worst_frames.main(["--repeats", "1", "--output", str(tmp_path / "page.md")]) == 0
    text = (tmp_path / "page.md").read_text()
    assert all(f"\n| {name} | " in text for name in hard_frames.MADE)
    assert "were not there" in text
