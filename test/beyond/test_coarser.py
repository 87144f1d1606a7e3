# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Fewer points where lengths follow the sensor: blocks of pixels, and voxels of lists."""

from __future__ import annotations

import math

import numpy as np
import pytest

import topo_region_seg as trs
from topo_region_seg import pipeline
from topo_region_seg.beyond.auto_scale import coarser
from topo_region_seg.beyond.auto_scale.coarser import CROWD, MOST, fewer_points, pixels_wide, wider_angles
from topo_region_seg.beyond.auto_scale.local_units import LocalUnits, local_units
from topo_region_seg.beyond.supervoxels.block_normals import block_normals
from topo_region_seg.data import Cloud
from topo_region_seg.growth import AUTO_REACH, REFERENCE_SPACING, growth_of_regions
from topo_region_seg.steps.thinning.pixel_blocks import pixel_blocks

HEIGHT, WIDTH = 120, 160
PARAMS = trs.Params(remove_floor=False)


def units(middle: float, noise: float = 0.0) -> LocalUnits:
    """Those of a camera whose points are the reference spacing apart at 1 m."""
    return LocalUnits(np.eye(3), 1.0, 1.0, noise, middle)


def image(depth: np.ndarray, noise: float = 0.0, focal: float = 525.0, seed: int = 0) -> Cloud:
    """Return what a camera sees that has these depths (H, W), metres, with noise of the inverse depth, 1/m."""
    height, width = depth.shape
    v, u = np.mgrid[0:height, 0:width]
    depth = 1.0 / (1.0 / depth + np.random.default_rng(seed).normal(scale=noise, size=depth.shape))
    xyz = np.stack([(u - width / 2) / focal * depth, (v - height / 2) / focal * depth, depth], axis=-1)
    return Cloud(xyz.reshape(-1, 3).astype(np.float32), np.full((depth.size, 3), 128, np.uint8), height, width)


def wall(depth: float, noise: float = 0.0, shape: tuple[int, int] = (HEIGHT, WIDTH)) -> Cloud:
    return image(np.full(shape, depth), noise)


@pytest.mark.parametrize(
    ("middle", "noise", "count", "apart"),
    [
        (0.8, 0.0, 20_000, 2),  # 1.5 voxels of 2 mm are two spacings of 1.52 mm
        (0.4, 0.0, 20_000, 4),  # and four of 0.76 mm
        (2.0, 0.0, 20_000, 1),  # spacings of 3.8 mm are wider
        (2.0, 0.002, 20_000, 2),  # noise of 8 mm is two of them
        (2.0, 0.020, 20_000, 2),  # more of it widens blocks no further
        (2.0, 0.0, 307_200, 3),  # 40,000 points may be left
        (2.0, 0.0, 160_000, 2),
    ],
)
def test_blocks_are_as_wide_as_voxels_or_noise_or_as_the_number_of_points_wants(
    middle: float, noise: float, count: int, apart: int
) -> None:
    assert pixels_wide(units(middle, noise), count, PARAMS) == apart


def test_all_points_stay_without_voxels() -> None:
    cloud = wall(1.0, 0.01)
    seg = trs.Pipeline(PARAMS.replace(voxel_size=0.0)).run(cloud)
    np.testing.assert_array_equal(seg.filtered.xyz, cloud.xyz.astype(np.float64))


def test_of_lists_only_crowds_are_thinned() -> None:
    xyz = np.random.default_rng(0).uniform(-1.0, 1.0, (CROWD + 1, 3)) + [0.0, 0.0, 2.0]
    for count in (CROWD, CROWD + 1):
        given = xyz[:count], None, np.arange(count), (1, count)
        few = fewer_points(*given, units(2.0), PARAMS)
        assert (few is None) == (count == CROWD)
        assert fewer_points(*given, units(0.5), PARAMS) is None, "voxels leave a quarter"
    assert few is not None and few.kept is None and len(few.points.xyz) <= MOST and few.apart > 1.0


@pytest.mark.parametrize("shape", [(480, 640), (720, 1280)])
def test_a_full_image_leaves_few_points_and_labels_all(shape: tuple[int, int]) -> None:
    seg = trs.Pipeline(PARAMS).run(wall(2.5, shape=shape))
    assert MOST / 4 < len(seg.filtered.xyz) <= MOST
    assert (seg.labels == 1).all()


def test_pixels_of_a_noisy_wall_are_in_their_own_block() -> None:
    cloud, sigma = wall(3.0, 0.003), 0.003 * 3.0**2
    xyz, rows = cloud.xyz.astype(np.float64), np.arange(len(cloud))
    seen = local_units(xyz, rows, WIDTH, HEIGHT)
    assert sigma > 4.0 * seen.spacing

    def share_in_own(units: LocalUnits) -> float:
        points, at, kept = pixel_blocks(xyz, cloud.rgb, rows, (HEIGHT, WIDTH), 2, 1.0 / 525.0, units.clear)
        own = at[rows // WIDTH // 2, rows % WIDTH // 2]
        return float(np.mean(points.voxel == (own if kept is None else own[kept])))

    assert share_in_own(seen) > 0.98
    assert share_in_own(LocalUnits(seen.axes, seen.depth, 1.0, 0.0, seen.middle)) < 0.9


def test_a_crowd_of_no_camera_is_thinned_by_voxels_of_its_spacing() -> None:
    rng = np.random.default_rng(3)
    direction = rng.normal(size=(150_000, 3))
    xyz = 3.0 * direction / np.linalg.norm(direction, axis=1)[:, None]
    seg = trs.Pipeline(PARAMS).run(Cloud(xyz, np.full(xyz.shape, 128, np.uint8), 1, len(xyz)))
    found = local_units(xyz, np.arange(len(xyz)), len(xyz), 1)
    assert math.isinf(found.depth) and found.everywhere > 1.5
    left = len(seg.filtered.xyz)
    assert MOST / 4 < left <= MOST
    away = np.linalg.norm(xyz[seg.filtered.rows] - seg.filtered.xyz[seg.filtered.stand_in], axis=1)
    assert float(np.max(away)) <= math.sqrt(3.0) * 8.0 * REFERENCE_SPACING * found.everywhere


@pytest.mark.parametrize("output", ["regions", "supervoxels"])
@pytest.mark.parametrize("depth", [0.8, 2.5])
def test_a_list_of_the_points_of_an_image_has_its_labels(output: str, depth: float) -> None:
    there = np.full((HEIGHT, WIDTH), depth)
    there[20:70, 30:80] *= 0.9
    there[80:, 100:] *= 1.1
    cloud = image(there, 0.001)
    rng = np.random.default_rng(1)
    seen = rng.permutation(np.flatnonzero(rng.random(len(cloud)) < 0.95))
    hidden = np.setdiff1d(np.arange(len(cloud)), seen)
    cloud.xyz[hidden] = np.nan
    assert cloud.rgb is not None
    shuffled = Cloud(cloud.xyz[seen], cloud.rgb[seen], 1, len(seen))
    whole, listed = map(trs.Pipeline(PARAMS.replace(output=output)).run, (cloud, shuffled))
    assert len(whole.regions) > 2
    np.testing.assert_array_equal(listed.labels, whole.labels[seen])


def test_a_round_thing_stays_whole_with_fewer_points(monkeypatch: pytest.MonkeyPatch) -> None:
    u = (np.arange(WIDTH) - WIDTH / 2) / 525.0
    # What rays at 2 m meet of a standing cylinder with a radius of 0.12 m.
    root = np.maximum(4.0 - (1.0 + u**2) * (4.0 - 0.12**2), 0.0)
    hit = root > 0.1 * 0.12**2
    depth = np.where(hit, (2.0 - np.sqrt(root)) / (1.0 + u**2), np.nan)
    cloud = image(np.tile(depth, (HEIGHT, 1)), 0.0)
    params = PARAMS.replace(features="normals", angle_threshold=3.0, radius=5.0 * REFERENCE_SPACING)
    fine = trs.Pipeline(params.replace(voxel_size=0.0)).run(cloud)
    monkeypatch.setattr(coarser, "MOST", 2_000)
    blocks = trs.Pipeline(params).run(cloud)
    monkeypatch.setattr(pipeline, "wider_angles", lambda growth, *_: growth)
    strips = trs.Pipeline(params).run(cloud)
    assert len(blocks.filtered.xyz) < 0.3 * len(fine.filtered.xyz)
    largest = [seg.regions.size[0] / np.isfinite(depth).sum() / HEIGHT for seg in (fine, blocks, strips)]
    assert min(largest[:2]) > 0.8 and largest[2] < 0.5


def test_angles_widen_as_points_are_farther_apart_than_voxels() -> None:
    growth = growth_of_regions(PARAMS.replace(min_angle_threshold=1.0, angle_threshold=5.0))
    assert wider_angles(growth, units(2.0), 2, PARAMS).angle[1] == pytest.approx(10.0 / 1.05)
    assert wider_angles(growth, units(2.0), 2, PARAMS.replace(voxel_size=0.001)).angle == (1.0, 10.0)
    assert wider_angles(growth, units(0.5), 2, PARAMS).angle == (1.0, 5.0)
    assert wider_angles(growth, units(2.0), 100, PARAMS).angle[1] == 180.0


def test_one_radius_for_all_blocks_is_that_of_each() -> None:
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    cloud = image(2.0 + 0.006 * np.sin(u / 4.0) * np.cos(v / 5.0))
    xyz, rows = cloud.xyz.astype(np.float64), np.arange(len(cloud))
    points, at, _ = pixel_blocks(xyz, None, rows, (HEIGHT, WIDTH), 2, 1.0 / 525.0)
    narrow, wide = (block_normals(points.xyz, at, radius, 5) for radius in (0.015, 0.04))
    each = np.where(np.arange(len(points.xyz)) % 3 == 0, 0.04, 0.015)
    found = block_normals(points.xyz, at, each, 5)
    expected = np.where((each == 0.04)[:, None], wide, narrow)
    # The window of blocks that are looked at is that of the widest radius around.
    assert np.mean(np.abs(found - expected).max(axis=1) < 1e-6) > 0.999
    assert np.abs(wide - narrow).max() > 0.05


def test_a_radius_given_beside_auto_is_the_scale() -> None:
    cloud = wall(2.0)
    seg = trs.Pipeline(PARAMS.replace(radius=0.01)).run(cloud)
    assert seg.scale == 0.01 and seg.components.max_radius == AUTO_REACH and "stable_scale" not in seg.ms
    wide = trs.Pipeline(PARAMS.replace(radius=0.03)).run(cloud)
    assert wide.scale == wide.components.max_radius == 0.03
