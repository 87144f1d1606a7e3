# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Clouds in another frame than the sensor's, and results that say why they are empty or doubtful."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import topo_region_seg as trs
from topo_region_seg.data import Cloud
from topo_region_seg.offline.simulation import Camera, simulate, tabletop

EULER = (0.4, -2.1, 0.7)
POSITION = np.array([0.3, -1.2, 0.8])


@pytest.fixture(scope="module")
def cloud() -> Cloud:
    return simulate(tabletop(1), Camera.kinect(160, 120), 1).cloud


def moved(cloud: Cloud, position: np.ndarray = POSITION) -> Cloud:
    """The cloud in the frame of a robot: `position` is where the sensor is in it."""
    zero = (cloud.xyz == 0.0).all(axis=1)
    xyz = Rotation.from_euler("xyz", EULER).apply(cloud.xyz.astype(np.float64)) + position
    xyz[zero] = 0.0
    return replace(cloud, xyz=xyz)


def listed(cloud: Cloud) -> Cloud:
    """The same points without an image grid, which would tell where the camera is."""
    return replace(cloud, height=1, width=len(cloud))


def codes(seg: trs.Segmentation) -> list[str]:
    return [notice.code for notice in seg.notices]


def quiet(cloud: Cloud, **params: object) -> trs.Segmentation:
    return trs.Pipeline(trs.Params.from_mapping(params)).run(cloud, lambda code, text: None)


@pytest.mark.parametrize("output", ["regions", "objects"])
@pytest.mark.parametrize("by", ["parameter", "file"])
def test_a_cloud_in_another_frame_has_the_regions_that_it_has_in_the_sensors(
    cloud: Cloud, output: str, by: str
) -> None:
    """Without thinning, whose grid is aligned with the frame, and without merging, whose ties go by coordinates."""
    settings = {"output": output, "voxel_size": 0.0, "small_regions": "remove"}
    here, there = quiet(replace(cloud, xyz=cloud.xyz.astype(np.float64)), **settings), moved(cloud)
    if by == "parameter":
        seg = quiet(there, sensor_pose=(*POSITION, *EULER), **settings)
    else:
        quaternion = Rotation.from_euler("xyz", EULER).as_quat()
        seg = quiet(replace(there, sensor_pose=(*POSITION, *np.roll(quaternion, 1))), **settings)
    agree = (seg.labels > 0) == (here.labels > 0)
    assert agree.mean() > 0.999
    assert abs(len(seg.regions) - len(here.regions)) <= 1
    assert [code for code in codes(seg) if code != "no_effect"] == []
    back = Rotation.from_euler("xyz", EULER).inv().apply(seg.regions.centroid - POSITION)
    for size, centroid in zip(here.regions.size[:3], here.regions.centroid[:3], strict=True):
        nearest = np.argmin(np.linalg.norm(back - centroid, axis=1))
        assert np.allclose(back[nearest], centroid, atol=0.01)
        assert abs(seg.regions.size[nearest] - size) <= 0.05 * size


def test_positions_of_the_result_are_in_the_frame_of_the_cloud(cloud: Cloud) -> None:
    there = moved(cloud)
    seg = quiet(there, sensor_pose=(*POSITION, *EULER), voxel_size=0.0)
    assert np.allclose(seg.barcode.xyz, there.xyz[seg.index], atol=1e-12)
    members = there.xyz[seg.labels == 1]
    assert np.allclose(seg.regions[0].minimum, members.min(axis=0), atol=1e-12)
    assert np.allclose(seg.regions[0].centroid, members.mean(axis=0), atol=1e-9)
    assert seg.plane is not None
    valid = np.isfinite(there.xyz).all(axis=1)
    height = there.xyz[valid] @ seg.plane.normal + seg.plane.offset
    assert np.count_nonzero(np.abs(height) < 0.01) > 0.2 * len(height)
    assert np.dot(seg.plane.normal, POSITION) + seg.plane.offset > 0.3, "the sensor is in front of the plane"


def test_the_parameter_goes_before_the_file(cloud: Cloud) -> None:
    wrong = replace(moved(cloud), sensor_pose=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    right = quiet(wrong, sensor_pose=(*POSITION, *EULER))
    assert len(right.regions) > 2 and right.notices == ()


@pytest.mark.parametrize("output", ["regions", "objects", "supervoxels"])
def test_the_image_grid_tells_where_the_camera_is(cloud: Cloud, output: str) -> None:
    """Without any setting the same points are labelled, in as many regions, as with the pose as a parameter."""
    there = moved(cloud)
    told, found = quiet(there, output=output, sensor_pose=(*POSITION, *EULER)), quiet(there, output=output)
    assert len(found.regions) > 2 and found.notices == ()
    assert ((told.labels > 0) == (found.labels > 0)).mean() > 0.999
    assert abs(len(told.regions) - len(found.regions)) <= 0.02 * len(told.regions)


@pytest.mark.parametrize("output", ["regions", "objects"])
@pytest.mark.parametrize("seed", range(8))
def test_a_list_of_points_in_a_robots_frame_is_right_or_doubted(cloud: Cloud, output: str, seed: int) -> None:
    """Wherever the robot's base is: what lies in front of the table is as in the sensor's frame, or a notice is there.

    The base is up to two metres from the sensor, on either side of the table.
    """
    rng = np.random.default_rng(seed)
    here = quiet(listed(cloud), output=output)
    zero = (cloud.xyz == 0.0).all(axis=1)
    xyz = Rotation.random(random_state=seed).apply(cloud.xyz.astype(np.float64)) + rng.uniform(-1.0, 1.0, 3)
    xyz[zero] = 0.0
    seg = quiet(listed(replace(cloud, xyz=xyz)), output=output)
    agree = ((seg.labels > 0) == (here.labels > 0)).mean()
    assert agree > 0.98 or {"behind_plane", "sensor_in_plane"} & set(codes(seg))


def test_ranges_are_distances_from_the_sensor(cloud: Cloud) -> None:
    there = moved(cloud, np.array([100.0, 0.0, 0.0]))
    seg = quiet(there, sensor_pose=(100.0, 0.0, 0.0, *EULER), remove_floor=False)
    assert len(seg.regions) > 2


def test_a_sensor_in_the_support_plane_is_doubtful(cloud: Cloud) -> None:
    seg = quiet(cloud)
    assert seg.plane is not None
    foot = -seg.plane.offset * np.array(seg.plane.normal)
    on_table = listed(replace(cloud, xyz=cloud.xyz - foot))
    assert codes(quiet(on_table)) == ["sensor_in_plane"]
    assert "set sensor_pose" in quiet(on_table).notices[0].text


def test_everything_behind_the_plane_is_doubtful(cloud: Cloud) -> None:
    """A robot's base below the table: what stands on the table is behind it."""
    seg = quiet(cloud)
    assert seg.plane is not None
    below = listed(replace(cloud, xyz=cloud.xyz + (seg.plane.offset + 0.5) * np.array(seg.plane.normal)))
    assert codes(quiet(below))[0] == "behind_plane"
    assert len(quiet(below, sensor_pose=(*(seg.plane.offset + 0.5) * np.array(seg.plane.normal), 0, 0, 0)).regions) > 2


def test_a_map_is_seen_from_above() -> None:
    side = np.linspace(-0.5, 0.5, 120)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    ground = np.column_stack([x, y, np.zeros_like(x)])
    block = np.column_stack([0.1 * x, 0.1 * y, np.full_like(x, 0.1)])
    xyz = np.concatenate([ground, block]) + [452_133.25, 5_411_884.5, 312.0]
    seg = quiet(Cloud(xyz, np.full(xyz.shape, 90, np.uint8), 1, len(xyz)))
    assert codes(seg) == ["taken_for_map"]
    assert len(seg.regions) == 1 and seg.labels[len(ground) :].all() and not seg.labels[: len(ground)].any()
    assert np.allclose(seg.regions[0].centroid, xyz[len(ground) :].mean(axis=0), atol=1e-3)


def points(*rows: list[float], times: int = 100) -> Cloud:
    xyz = np.repeat(np.array(rows, np.float64).reshape(-1, 3), times, axis=0)
    return Cloud(xyz, np.full(xyz.shape, 90, np.uint8), 1, len(xyz))


@pytest.mark.parametrize(
    ("cloud", "params", "code", "words"),
    [
        (points(), {}, "empty_cloud", "no points"),
        (points([np.nan, 0, 1], [0, 0, 0]), {}, "all_invalid", "none of the 200 points is valid"),
        (points([10, 0, 800], [300, 5, 900]), {}, "out_of_range", "look like millimetres"),
        (points([0, 0, 30], [9, 0, 12]), {}, "out_of_range", "15 to 30 m from the sensor, 22.5 m in the middle"),
        (points([0, 0, 0.1], [0.3, 0, 0.2]), {"min_range": 0.5}, "out_of_range", "min_range 0.5"),
        (points([0, 0, 1]), {"crop_box": (2, 2, 2, 3, 3, 3)}, "outside_crop_box", "check its frame"),
        (points([0, 0, 1], times=9), {"small_regions": "remove"}, "no_regions", "fewer than min_region_size = 64"),
    ],
)
def test_an_empty_result_says_why(cloud: Cloud, params: dict[str, object], code: str, words: str) -> None:
    seg = quiet(cloud, **params)
    assert codes(seg) == [code]
    assert words in seg.notices[0].text and len(seg.notices[0].text.splitlines()) == 1
    assert len(seg.regions) == 0 and not seg.labels.any()


def test_only_a_table() -> None:
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.4, 0.4, 90), np.linspace(-0.4, 0.4, 90)))
    xyz = np.column_stack([x, y, np.ones_like(x)])
    assert codes(quiet(Cloud(xyz, np.full(xyz.shape, 90, np.uint8), 1, len(xyz)))) == ["only_plane"]


def test_a_good_result_has_nothing_to_say(cloud: Cloud) -> None:
    for output in ("regions", "objects", "supervoxels"):
        assert quiet(cloud, output=output).notices == ()
