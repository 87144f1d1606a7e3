# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Supervoxels: connected, homogeneous, of bounded extent, and parts of regions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from oracles import Points, homogeneous_edges
from places import SIMULATED
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

import topo_region_seg as trs
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message

RECORDED = SIMULATED
SPACING = 0.02
PATCHES = trs.Params(
    output="supervoxels", seed_spacing=SPACING, remove_floor=False, voxel_size=0.0, max_radius=0.008, min_region_size=5
)


def sheet(seed: int = 0) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint8]]:
    """Return a bent sheet of two colors, about 4 mm between points, with noise, at 0.8 m."""
    rng = np.random.default_rng(seed)
    x, y = (0.004 * grid.ravel() for grid in np.meshgrid(np.arange(40), np.arange(25)))
    z = 0.8 + np.where(x < 0.08, 0.0, 0.7 * (x - 0.08))
    xyz = np.column_stack([x, y, z]) + rng.normal(scale=0.0002, size=(1000, 3))
    rgb = np.where((y < 0.05)[:, None], [180, 60, 60], [60, 60, 180]) + rng.integers(-4, 5, (1000, 3))
    return xyz, rgb.astype(np.uint8)


def patches_of(seg: trs.Segmentation) -> list[npt.NDArray[np.int64]]:
    return [np.flatnonzero(seg.labels == label) for label in range(1, len(seg.regions) + 1)]


def connected(n: int, edges: npt.NDArray[np.int64], rows: npt.NDArray[np.int64]) -> bool:
    inside = np.isin(edges, rows).all(axis=1)
    graph = coo_array((np.ones(inside.sum()), tuple(edges[inside].T)), (n, n))
    return len(np.unique(connected_components(graph, directed=False)[1][rows])) == 1


@pytest.mark.parametrize("small", ["remove", "merge"])
@pytest.mark.parametrize("seed", range(3))
def test_patches_are_connected_and_bounded(seed: int, small: str) -> None:
    xyz, rgb = sheet(seed)
    seg = trs.segment(xyz, rgb, PATCHES.replace(small_regions=small))
    # Left-overs may join a patch across a difference, but not across a gap.
    if small == "remove":
        edges = homogeneous_edges(Points(xyz, seg.features.lab, seg.features.normals), seg.params)[0]
    else:
        edges = cKDTree(xyz).query_pairs(PATCHES.max_radius, output_type="ndarray")
    found = patches_of(seg)
    assert len(found) > 15
    for rows in found:
        assert connected(len(xyz), edges, rows)
        reach = np.linalg.norm(xyz[rows][:, None] - xyz[rows][None], axis=2).max(axis=1)
        assert reach.min() <= SPACING, "one of the points is the seed, near to all others"


def test_patches_are_parts_of_regions() -> None:
    xyz, rgb = sheet()
    seg = trs.segment(xyz, rgb, PATCHES.replace(small_regions="remove"))
    for rows in patches_of(seg):
        assert len(np.unique(seg.components.root[rows])) == 1
    labels = np.unique(seg.labels[seg.labels > 0])
    np.testing.assert_array_equal(labels, np.arange(1, len(seg.regions) + 1))


@pytest.mark.parametrize("small", ["remove", "merge"])
def test_the_order_of_the_points_does_not_matter(small: str) -> None:
    xyz, rgb = sheet()
    order = np.random.default_rng(5).permutation(len(xyz))
    params = PATCHES.replace(small_regions=small)
    np.testing.assert_array_equal(
        trs.segment(xyz[order], rgb[order], params).labels, trs.segment(xyz, rgb, params).labels[order]
    )


def test_the_order_of_points_that_are_equally_far_does_not_matter() -> None:
    # On a grid of exact numbers, of one color, two of four equally far points are among the nearest.
    x, y = (grid.ravel() / 256.0 for grid in np.meshgrid(np.arange(30), 1.5 * np.arange(30)))
    xyz, rgb = np.column_stack([x, y, np.full(900, 0.75)]), np.full((900, 3), 90, np.uint8)
    params = PATCHES.replace(max_radius=0.012)
    labels = trs.segment(xyz, rgb, params).labels
    assert len(np.unique(labels)) > 15
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(900)
        np.testing.assert_array_equal(trs.segment(xyz[order], rgb[order], params).labels, labels[order])


@pytest.mark.parametrize(("side", "stays"), [(0.016, True), (0.006, False)])
def test_a_patch_is_small_beside_what_its_cell_holds(side: float, stays: bool) -> None:
    # A mark of 64 or 9 points on a sheet whose cells hold about 400.
    x, y = (0.002 * grid.ravel() for grid in np.meshgrid(np.arange(60), np.arange(60)))
    mark = (x >= 0.05) & (x < 0.05 + side - 1e-9) & (y >= 0.05) & (y < 0.05 + side - 1e-9)
    rgb = np.where(mark[:, None], [200, 40, 40], [40, 40, 200]).astype(np.uint8)
    params = PATCHES.replace(seed_spacing=0.04, min_region_size=1000)
    seg = trs.segment(np.column_stack([x, y, np.full(3600, 0.8)]), rgb, params)
    assert mark.sum() < params.min_region_size
    assert (not np.isin(seg.labels[~mark], seg.labels[mark]).any()) is stays


def test_more_patches_where_seeds_are_nearer() -> None:
    xyz, rgb = sheet()
    counts = [len(trs.segment(xyz, rgb, PATCHES.replace(seed_spacing=s)).regions) for s in (0.015, 0.03, 0.06, 0.5)]
    assert counts == sorted(counts, reverse=True) and counts[0] > 3 * counts[2] and counts[2] > 2 * counts[3]


def test_adjacent_patches_form_one_graph() -> None:
    xyz, rgb = sheet()
    seg = trs.segment(xyz, rgb, PATCHES)
    pairs = seg.adjacency(PATCHES.max_radius).pairs.astype(np.int64) - 1
    n = len(seg.regions)
    graph = coo_array((np.ones(len(pairs)), tuple(pairs.T)), (n, n))
    assert connected_components(graph, directed=False)[0] == 1


def test_a_recorded_frame() -> None:
    with open_bag(RECORDED) as reader:
        topic = cloud_topic(reader)
        cloud = decode(decode_message(next(iter(reader.messages([topic.name]))), topic), max_points=10**6)
    regions, patches = (trs.Pipeline(trs.Params(output=output)).run(cloud) for output in ("regions", "supervoxels"))
    assert len(patches.regions) > len(regions.regions)
    extent = (patches.regions.maximum - patches.regions.minimum).max(axis=1)
    assert extent.max() <= 2 * trs.Params().seed_spacing


def test_supervoxels_are_not_counted_in_a_cut() -> None:
    with pytest.raises(ValueError, match="seed_spacing"):
        trs.segment(*sheet(), PATCHES).cut(regions=3)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_few_points(n: int) -> None:
    xyz = np.arange(3.0 * n).reshape(n, 3) + 0.5
    assert trs.segment(xyz, np.zeros((n, 3), np.uint8), PATCHES).labels.shape == (n,)
