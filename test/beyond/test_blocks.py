# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Supervoxels on the image grid: blocks of pixels, their normals and edges, and the patches that grow there."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from oracles import Points, homogeneous_edges
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import topo_region_seg as trs
from topo_region_seg.beyond.supervoxels.block_edges import AROUND, block_edges, joined_along
from topo_region_seg.beyond.supervoxels.block_normals import block_normals
from topo_region_seg.beyond.supervoxels.blocks import block_width, image_blocks
from topo_region_seg.compiled.predicate import edge_length
from topo_region_seg.data import Cloud
from topo_region_seg.growth import growth_of_regions
from topo_region_seg.steps.homogeneity import criterion, homogeneity_channels
from topo_region_seg.steps.thinning.pixel_blocks import SHADE, STEP, STRAY, pixel_angle

PARAMS = trs.Params(output="supervoxels", remove_floor=False, min_region_size=20)
HEIGHT, WIDTH, ANGLE = 60, 81, 0.002


def image(seed: int = 0, noise: float = 0.0003) -> Cloud:
    """A wall at 0.8 m, its right half turned away, a box before it, two colors, and pixels without depth."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    depth = 0.8 + np.where(u > 40, 0.0012 * (u - 40), 0.0)
    depth[15:40, 10:30] = 0.7
    depth = depth + rng.normal(scale=noise, size=depth.shape)
    depth[rng.random(depth.shape) < 0.03] = np.nan
    xyz = np.stack([(u - WIDTH / 2) * ANGLE * depth, (v - HEIGHT / 2) * ANGLE * depth, depth], axis=-1)
    rgb = np.where((v < 30)[..., None], [200, 40, 40], [40, 40, 200]) + rng.integers(-3, 4, (*v.shape, 3))
    return Cloud(xyz.reshape(-1, 3).astype(np.float32), rgb.reshape(-1, 3).astype(np.uint8), HEIGHT, WIDTH)


def blocks_of(cloud: Cloud, side: float) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], object]:
    rows = np.flatnonzero(np.isfinite(cloud.xyz).all(axis=1))
    xyz = cloud.xyz[rows].astype(np.float64)
    params = PARAMS.replace(voxel_size=(side + 0.5) * ANGLE * 0.8 / 1.75)
    found = image_blocks(xyz, cloud.rgb[rows], rows, (HEIGHT, WIDTH), params)
    return xyz, rows, found


@pytest.mark.parametrize("side", [1, 2, 3])
def test_every_pixel_is_in_its_block_or_in_one_beside_it_that_is_near_and_alike(side: int) -> None:
    cloud = image()
    xyz, rows, (points, at, kept) = blocks_of(cloud, side)
    inside = np.ones(len(rows), np.bool_) if kept is None else kept
    rows, xyz = rows[inside], xyz[inside]
    assert inside.mean() > 0.99 and at.shape == (-(-HEIGHT // side), -(-WIDTH // side))
    v, u = np.nonzero(at >= 0)
    np.testing.assert_array_equal(at[v, u], np.arange(len(points.xyz)))
    off_rows, off_columns = rows // WIDTH // side - v[points.voxel], rows % WIDTH // side - u[points.voxel]
    assert max(np.abs(off_rows).max(), np.abs(off_columns).max()) <= 1
    assert np.mean((off_rows == 0) & (off_columns == 0)) > 0.9
    away = np.linalg.norm(xyz - points.xyz[points.voxel], axis=1)
    assert away.max() <= 1.05 * STRAY * side * ANGLE * 0.9
    np.testing.assert_array_equal(points.weight, np.bincount(points.voxel))
    red = cloud.rgb[rows][:, 0].astype(float)
    assert np.mean(np.abs(red - points.rgb[points.voxel][:, 0]) > 30) < 0.002, "blocks keep to borders of color"
    assert np.mean(np.abs(xyz[:, 2] - points.xyz[points.voxel][:, 2]) > 0.02) == 0.0, "and to those of depth"


@pytest.mark.parametrize("side", [2, 3])
def test_blocks_are_those_of_plain_python(side: int) -> None:
    """Borders in all directions, of color and depth, noise of both, and pixels far before or behind those around."""
    rng = np.random.default_rng(side)
    cloud = image(noise=0.0012)
    v, u = np.divmod(np.arange(HEIGHT * WIDTH), WIDTH)
    tones = np.array([[200, 40, 40], [60, 160, 40], [70, 90, 190], [90, 120, 180]])[(u + 2 * v) // 11 % 4]
    rgb = np.clip(tones + rng.normal(scale=9.0, size=tones.shape), 0, 255).astype(np.uint8)
    astray = np.where(rng.random(len(v)) < 0.06, rng.uniform(0.95, 1.05, len(v)), 1.0)[:, None].astype(np.float32)
    xyz, rows, (points, at, kept) = blocks_of(Cloud(cloud.xyz * astray, rgb, HEIGHT, WIDTH), side)
    wanted = plain_blocks(xyz, rgb[rows].astype(float), rows, side, pixel_angle(xyz, rows))
    found = np.full(len(rows), -1)
    numbers = np.flatnonzero(at.ravel() >= 0)
    found[np.ones(len(rows), np.bool_) if kept is None else kept] = numbers[points.voxel]
    own = rows // WIDTH // side * at.shape[1] + rows % WIDTH // side
    assert np.mean(wanted != own) > 0.1 and 0 < np.mean(wanted < 0) < 0.1, "the rule is put to the test"
    np.testing.assert_array_equal(found, wanted)


def plain_blocks(
    xyz: npt.NDArray[np.float64],
    rgb: npt.NDArray[np.float64],
    rows: npt.NDArray[np.int64],
    side: int,
    angle: float,
) -> npt.NDArray[np.int64]:
    """Return the block of each point, -1 for none, by the rule: first the largest group of each, then the others."""
    across = -(-WIDTH // side)
    place = np.stack([rows // WIDTH // side, rows % WIDTH // side], axis=1)
    step = STEP * side * angle * np.linalg.norm(xyz, axis=1)
    block = np.full(len(rows), -1)
    middle: dict[tuple[int, int], npt.NDArray[np.float64]] = {}
    for row, column in np.unique(place, axis=0).tolist():
        members = np.flatnonzero((place == (row, column)).all(axis=1))
        groups = []
        for one in members:
            near = np.linalg.norm(xyz[members] - xyz[one], axis=1) <= step[one]
            groups.append(members[near & (np.linalg.norm(rgb[members] - rgb[one], axis=1) <= SHADE)])
        largest = max(groups, key=len)  # the first of several
        block[largest] = row * across + column
        middle[row, column] = np.append(xyz[largest].mean(axis=0), rgb[largest].mean(axis=0))
    chosen = block.copy()
    for i in np.flatnonzero(block < 0):
        costs = {}
        for row in range(place[i, 0] - 1, place[i, 0] + 2):
            for column in range(place[i, 1] - 1, place[i, 1] + 2):
                if (row, column) in middle:
                    away = np.linalg.norm(xyz[i] - middle[row, column][:3]) / step[i]
                    shade = np.linalg.norm(rgb[i] - middle[row, column][3:]) / SHADE
                    if away <= STRAY / STEP:
                        costs[row * across + column] = away**2 + shade**2
        chosen[i] = min(costs, key=costs.__getitem__) if costs else -1
    return chosen


def test_normals_are_those_of_the_blocks_in_reach() -> None:
    _, _, (points, at, _) = blocks_of(image(), 2)
    found, spacing = block_normals(points.xyz, at, 0.012, 8), 2 * ANGLE
    for p in range(0, len(points.xyz), 37):
        x = points.xyz[p]
        near = points.xyz[np.linalg.norm(points.xyz - x, axis=1) <= 0.012 + spacing * np.linalg.norm(x)]
        if len(near) < 12:
            continue
        axis = np.linalg.svd(near - near.mean(axis=0))[2][2]
        axis *= -np.sign(axis @ x)
        assert found[p] @ axis > np.cos(np.radians(3.0))
        assert found[p] @ x < 0.0


def test_normals_of_sparse_points_come_from_the_blocks_that_touch() -> None:
    v, u = np.mgrid[0:6, 0:8]
    xyz = np.stack([0.05 * u, 0.05 * v, 1.0 + 0.0 * u], axis=-1).reshape(-1, 3)
    at = np.arange(48, dtype=np.int32).reshape(6, 8)
    np.testing.assert_allclose(block_normals(xyz, at, 0.03, 8)[9], [0.0, 0.0, -1.0], atol=1e-6)
    assert np.isnan(block_normals(xyz, at, 0.01, 8)).all(), "three radii do not reach the next block"
    assert block_normals(np.empty((0, 3)), np.full((2, 2), -1, np.int32), 0.01, 8).shape == (0, 3)


def test_edges_are_those_of_near_blocks_for_which_the_criterion_holds() -> None:
    _, _, (points, at, _) = blocks_of(image(1), 3)
    growth = growth_of_regions(PARAMS)
    lab = points.rgb.astype(float)
    channels = homogeneity_channels(points.xyz, lab, block_normals(points.xyz, at, 0.012, 8), growth)
    limits = criterion(growth, 0.012)
    near, alike = block_edges(channels, at, limits)
    n = len(points.xyz)
    where = {int(p): tuple(place) for place, p in np.ndenumerate(at) if p >= 0}
    joined = []
    for p in range(0, n):
        for k, (v, u) in enumerate(AROUND):
            r, c = where[p][0] + v, where[p][1] + u
            q = at[r, c] if 0 <= r < at.shape[0] and 0 <= c < at.shape[1] else -1
            reached = q >= 0 and ((points.xyz[p] - points.xyz[q]) ** 2).sum() <= limits.reach
            assert near[p, k] == (q if reached else n)
            assert alike[p, k] == (reached and edge_length.py_func(channels, limits, p, q) >= 0.0)
            joined += [(p, q)] if alike[p, k] else []
    graph = coo_array((np.ones(len(joined)), tuple(np.array(joined).T)), (n, n))
    expected = connected_components(graph, directed=False)[1]
    _, first = np.unique(expected, return_index=True)
    np.testing.assert_array_equal(joined_along(near, alike), first[expected])


@pytest.mark.parametrize("seed", range(2))
def test_patches_of_an_image_are_connected_bounded_and_parts_of_regions(seed: int) -> None:
    params = PARAMS.replace(small_regions="remove", seed_spacing=0.02, max_radius=0.012)
    seg = trs.Pipeline(params).run(image(seed))
    points = Points(seg.points, seg.features.lab, seg.features.normals)
    edges = homogeneous_edges(points, params)[0]
    assert len(seg.regions) > 30
    for label in seg.regions.label:
        rows = np.flatnonzero(seg.point_labels == label)
        inside = np.isin(edges, rows).all(axis=1)
        graph = coo_array((np.ones(inside.sum()), tuple(edges[inside].T)), (len(points.xyz),) * 2)
        assert len(np.unique(connected_components(graph, directed=False)[1][rows])) == 1
        reach = np.linalg.norm(points.xyz[rows][:, None] - points.xyz[rows][None], axis=2).max(axis=1)
        assert reach.min() <= params.seed_spacing
        assert len(np.unique(seg.components.root[rows])) == 1


def test_the_filtration_of_an_image_of_supervoxels_waits_until_it_is_asked_for() -> None:
    seg = trs.Pipeline(PARAMS).run(image())
    assert "components" not in vars(seg.filtered) and "filtration" not in seg.ms
    assert np.isnan(seg.regions.persistence).all()
    channels = seg.filtered.channels
    eager = trs.persistent_components(channels[:, :3], channels[:, 3:6], channels[:, 6:9], PARAMS)
    np.testing.assert_array_equal(seg.components.root, eager.root)
    np.testing.assert_array_equal(seg.barcode.death, eager.death)


def test_a_cut_is_a_new_run() -> None:
    cloud = image()
    cut = trs.Pipeline(PARAMS).run(cloud).cut(0.006)
    np.testing.assert_array_equal(cut.labels, trs.Pipeline(PARAMS.replace(max_radius=0.006)).run(cloud).labels)
    assert len(np.unique(cut.labels)) > 20


@pytest.mark.parametrize("left", [0, 1, 2, 3])
def test_images_of_few_points(left: int) -> None:
    cloud = image()
    xyz = np.full_like(cloud.xyz, np.nan)
    xyz[100 : 100 + left] = cloud.xyz[100 : 100 + left]
    labels = trs.Pipeline(PARAMS).run(Cloud(xyz, cloud.rgb, HEIGHT, WIDTH), lambda code, text: None).labels
    assert labels.shape == (HEIGHT * WIDTH,) and np.count_nonzero(labels) <= left


@pytest.mark.parametrize(
    ("count", "pixel", "pixels"), [(300_000, 0.0015, 3), (300_000, 0.003, 2), (300_000, 0.005, 1), (40_000, 0.003, 1)]
)
def test_blocks_are_wider_where_many_would_be_left_but_narrow_beside_patches(
    count: int, pixel: float, pixels: int
) -> None:
    assert int(block_width(PARAMS, count, pixel) / pixel + 1e-6) == pixels
    assert block_width(PARAMS.replace(voxel_size=0.0), count, pixel) == 0.0


def test_images_without_color_and_without_thinning() -> None:
    cloud = image()
    plain = Cloud(cloud.xyz, None, HEIGHT, WIDTH)
    for params in (PARAMS.replace(features="normals"), PARAMS.replace(features="normals", voxel_size=0.0)):
        seg = trs.Pipeline(params).run(plain)
        assert (seg.labels > 0).mean() > 0.9
    assert len(seg.points) == np.isfinite(cloud.xyz[:, 0]).sum(), "each point stays"
