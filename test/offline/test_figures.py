# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The pictures: they are made, show what they should, and stay quick with many bars."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.image import imread

from topo_region_seg.cloud.label_colors import colors
from topo_region_seg.data import Cloud, Components, Features, RegionTable
from topo_region_seg.offline.figures.barcode import plot_barcode
from topo_region_seg.offline.figures.before_after import before_and_after, plot_before_after
from topo_region_seg.offline.figures.projection import picture_of
from topo_region_seg.params import Params
from topo_region_seg.segmentation import Segmentation


def hand_made(n: int, regions: int, labels: np.ndarray | None = None) -> Segmentation:
    """`n` points in `regions` equal components; all other bars die at 2 to 20 mm."""
    if labels is None:
        labels = np.arange(n) * max(regions, 1) // max(n, 1) + 1
    labels = labels.astype(np.uint32)
    death = np.random.default_rng(0).uniform(1e-3, 0.02, n)
    _, first = np.unique(labels, return_index=True)
    death[first] = np.inf
    root = first[np.unique(labels, return_inverse=True)[1]].astype(np.int64)
    rows = np.zeros((regions, 3))
    label, size = np.arange(1, regions + 1, dtype=np.uint32), np.full(regions, n // max(regions, 1))
    table = RegionTable(label, size, rows, rows, rows, rows, rows, np.zeros(regions), np.full(regions, np.nan))
    return Segmentation(
        labels=labels,
        regions=table,
        point_labels=labels,
        index=np.arange(n),
        features=Features(None, None),
        plane=None,
        params=Params(),
        scale=0.02,
        filtered=SimpleNamespace(components=Components(root, root, death, 0.02), weight=np.ones(n, np.int64)),  # type: ignore[arg-type]
        ms={"filtration": 12.0},
    )


def square(side: int, height: int = 1) -> Cloud:
    """A square at 1 m, red left of the middle and green right of it."""
    x, y = np.meshgrid(np.linspace(-0.2, 0.2, side), np.linspace(-0.2, 0.2, side))
    xyz = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3).astype(np.float32)
    rgb = np.where(x.reshape(-1, 1) < 0, np.array([[250, 0, 0]]), np.array([[0, 250, 0]])).astype(np.uint8)
    return Cloud(xyz, rgb, height, side * side // height)


@pytest.mark.parametrize("n,regions", [(0, 0), (1, 1), (500, 4), (200_000, 300)])
def test_barcode_is_drawn_for_any_number_of_bars(tmp_path, n, regions) -> None:
    plot_barcode(hand_made(n, regions), tmp_path / "b.png")
    picture = imread(tmp_path / "b.png")
    assert picture.shape[0] > 300
    blue = (picture[..., 2] > picture[..., 0] + 0.3).mean()
    assert blue > 0.02 if n > 1 else blue >= 0.0005 * n


def test_barcode_says_how_much_of_it_is_drawn(tmp_path) -> None:
    plot_barcode(hand_made(200_000, 300), tmp_path / "b.svg")
    # Text is drawn as outlines; matplotlib leaves the string beside them as a comment.
    text = (tmp_path / "b.svg").read_text()
    assert "200,000 points, 300 bars of infinite persistence" in text
    assert "199,700 die" in text
    assert "(90 drawn)" in text


def test_barcode_ends_at_the_scale_of_the_regions(tmp_path) -> None:
    seg = replace(hand_made(1_000, 4), scale=0.011)
    alive = int((seg.components.death > seg.scale).sum())
    assert 4 < alive < 1_000
    plot_barcode(seg, tmp_path / "b.svg")
    assert f"1,000 points, {alive} bars of infinite persistence" in (tmp_path / "b.svg").read_text()


def test_before_and_after_shows_the_cloud_and_its_regions(tmp_path) -> None:
    cloud = square(64, height=64)
    labels = np.where(cloud.xyz[:, 0] < 0, 1, 2)
    plot_before_after(cloud, hand_made(64 * 64, 2, labels), tmp_path / "p.png")
    picture = (imread(tmp_path / "p.png")[..., :3] * 255).round().astype(int)
    middle = picture[picture.shape[0] * 2 // 3]
    width = len(middle)
    for at, color in ((0.12, [250, 0, 0]), (0.38, [0, 250, 0]), (0.62, colors([1])[0]), (0.88, colors([2])[0])):
        assert np.abs(middle[int(at * width)] - color).max() <= 2


def test_unlabeled_points_are_gray_and_labeled_ones_in_palette_colors() -> None:
    cloud = square(8)
    labels = np.arange(64, dtype=np.uint32) % 3
    before, after = before_and_after(cloud, hand_made(64, 2, labels))
    assert before is cloud.rgb
    np.testing.assert_array_equal(after[labels == 1], np.broadcast_to(colors([1]), (21, 3)))
    gray = after[labels == 0]
    assert (gray == gray[:, :1]).all()
    assert gray.max() < 130


def test_a_cloud_without_color_is_shaded_by_depth(tmp_path) -> None:
    cloud = replace(square(32), rgb=None)
    cloud.xyz[:10] = np.nan
    before, _ = before_and_after(cloud, hand_made(1024, 2))
    assert before.shape == (1024, 3)
    plot_before_after(cloud, hand_made(1024, 2), tmp_path / "p.png")


def test_an_organized_cloud_is_its_own_image() -> None:
    cloud = square(16, height=16)
    cloud.xyz[5] = np.nan
    cloud.xyz[6] = 0.0
    picture = picture_of(cloud)
    assert picture.shape == (16, 16)
    assert picture[0, 5] == picture[0, 6] == -1
    assert picture[3, 4] == 3 * 16 + 4


def test_an_unorganized_cloud_is_seen_from_the_sensor_without_holes_nearer_points_in_front() -> None:
    far = square(50)
    near = Cloud(far.xyz * np.float32(0.5), far.rgb, 1, len(far))
    near.xyz[:, 0] *= 0.4
    both = Cloud(np.concatenate([near.xyz, far.xyz]), np.concatenate([far.rgb, far.rgb]), 1, 2 * len(far))
    picture = picture_of(both)
    height, width = picture.shape
    inner = picture[height // 20 : -height // 20, width // 20 : -width // 20]
    assert (inner < 0).mean() < 0.01
    assert (picture[height // 2, width // 2 - 20 : width // 2 + 20] < len(far)).all()
    assert picture[height // 2, width // 8] >= len(far)
    rows = picture[picture[:, width // 8] >= 0, width // 8]
    assert both.xyz[rows[2], 1] < both.xyz[rows[-3], 1]  # y points down in the image too


def test_points_all_around_the_sensor_are_seen_from_outside() -> None:
    rng = np.random.default_rng(0)
    ring = rng.normal(size=(5000, 3)) * (5.0, 5.0, 0.3)
    picture = picture_of(Cloud(ring.astype(np.float32), None, 1, 5000))
    assert len(np.unique(picture)) > 3000


@pytest.mark.parametrize("n", [0, 1])
def test_clouds_of_hardly_any_points_are_drawn_too(tmp_path, n) -> None:
    cloud = Cloud(np.full((n, 3), 0.7, dtype=np.float32), np.full((n, 3), 99, dtype=np.uint8), 1, n)
    plot_before_after(cloud, hand_made(n, n), tmp_path / "p.png")
    assert (tmp_path / "p.png").stat().st_size > 1000


def test_drawing_leaves_pyplot_alone() -> None:
    code = (
        "import topo_region_seg.offline.figures.barcode, topo_region_seg.offline.figures.before_after, sys\n"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
