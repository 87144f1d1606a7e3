# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Lists of points that a camera saw: their pixels are found again, and nothing else is taken for an image."""

from __future__ import annotations

import tracemalloc

import numpy as np
import numpy.typing as npt
import pytest
from frames import box, looking, on_table
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from topo_region_seg.beyond.objects.image import sensor_model_of
from topo_region_seg.data import Cloud
from topo_region_seg.offline.simulation import Camera
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.segmentation import Segmentation
from topo_region_seg.steps.sensor import known_sensor, possible_axes
from topo_region_seg.steps.view.listed import ListedImage, listed_image

HEIGHT, WIDTH = 60, 80
Points = npt.NDArray[np.float64]


def image(seed: int, focal: float = 70.0, middle: tuple[float, float] = (40.3, 29.2), valid: float = 0.8) -> Points:
    """Return positions (HEIGHT, WIDTH, 3), metres, of which a share is NaN."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    depth = rng.uniform(0.4, 4.0, x.shape)
    depth[rng.uniform(size=depth.shape) > valid] = np.nan
    return np.stack([(x - middle[0]) / focal * depth, (y - middle[1]) / focal * depth, depth], axis=-1)


def listed(xyz: Points, seed: int = 0) -> tuple[Points, npt.NDArray[np.int64]]:
    """Return the valid points (N, 3) of an image in any order, as float32 holds them, and their pixels (N,)."""
    flat = xyz.reshape(-1, 3)
    pixel = np.random.default_rng(seed).permutation(np.flatnonzero(np.isfinite(flat).all(axis=1)))
    return flat[pixel].astype(np.float32).astype(np.float64), pixel


def steps_between(found: ListedImage, pixel: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], ...]:
    """Return how far the rows and columns that were found are from the true ones, (N,) each."""
    true = pixel[found.point]
    return found.pixel // found.width - true // WIDTH, found.pixel % found.width - true % WIDTH


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 1000),
    st.floats(30.0, 2000.0),
    st.tuples(st.floats(37.0, 43.0), st.floats(27.0, 33.0)),
    st.floats(0.3, 1.0),
)
def test_pixels_are_found_again(seed: int, focal: float, middle: tuple[float, float], valid: float) -> None:
    """Whatever the order, the camera and the pixels that are missing: all are where they were to one another."""
    xyz, pixel = listed(image(seed, focal, middle, valid), seed)
    found = listed_image(xyz, np.eye(3))
    assert found is not None and sorted(found.point) == list(range(len(xyz)))
    assert np.array_equal(found.pixel, np.unique(found.pixel))
    for apart in steps_between(found, pixel):
        assert len(np.unique(apart)) == 1
    assert HEIGHT - 3 <= found.height <= HEIGHT + 8 and WIDTH - 3 <= found.width <= WIDTH + 8


def test_rounded_positions_are_found_too() -> None:
    xyz, pixel = listed(image(1, 525.0))
    found = listed_image(np.round(xyz, 4), np.eye(3))
    assert found is not None and all(len(np.unique(apart)) == 1 for apart in steps_between(found, pixel))


@pytest.mark.parametrize(("rows", "columns"), [(slice(None), slice(40, None)), (slice(0, 25), slice(None))])
def test_where_one_side_is_missing_the_image_is_as_large(rows: slice, columns: slice) -> None:
    """What is left does not end at the image's edge where the image went on."""
    part = np.full((HEIGHT, WIDTH, 3), np.nan)
    part[rows, columns] = image(2)[rows, columns]
    xyz, _ = listed(part)
    found = listed_image(xyz, np.eye(3))
    assert found is not None
    assert abs(found.height - HEIGHT) <= 4 and abs(found.width - WIDTH) <= 4
    taken_rows, taken = found.pixel // found.width, found.pixel % found.width
    if columns.start:
        assert np.min(taken) > 0.4 * WIDTH and np.max(taken) == found.width - 1
    else:
        assert np.max(taken_rows) < 0.6 * HEIGHT and np.min(taken_rows) == 0


def test_nothing_else_is_an_image() -> None:
    rng = np.random.default_rng(3)
    xyz, _ = listed(image(3))
    for name, other in {
        "moved": xyz + [0.02, 0.0, 0.0],
        "turned": Rotation.from_euler("z", 1.0, degrees=True).apply(xyz),
        "shaken": xyz + rng.normal(scale=0.01, size=xyz.shape),
        "anywhere": rng.uniform([-1.0, -1.0, 0.5], [1.0, 1.0, 3.0], (4000, 3)),
        "map": np.stack([*np.meshgrid(np.arange(60) * 0.01, np.arange(60) * 0.01), np.ones((60, 60))], -1) @ np.eye(3)
        + rng.uniform(0.0, 0.5, (60, 60, 1)) * [0.0, 0.0, 1.0],
        "twice": np.concatenate([xyz, 1.1 * xyz]),
        "behind": -xyz,
        "at the sensor": np.concatenate([xyz, [[0.0, 0.0, 0.0]]]),
        "one row": xyz[np.abs(xyz[:, 1]) < 0.004 * xyz[:, 2]],
        "one place": np.ones((500, 3)),
        "a line": np.linspace(1.0, 2.0, 500)[:, None] * np.ones(3),
        "few": xyz[:60],
        "none": xyz[:0],
    }.items():
        assert listed_image(np.ascontiguousarray(other.reshape(-1, 3)), np.eye(3)) is None, name


def test_points_along_a_line_or_in_a_heap_ask_for_no_more_room_than_others() -> None:
    """They seem to have any number of columns: a few stray points beside a heap asked for gigabytes."""
    rng = np.random.default_rng(0)
    n = 50_000
    peaks = []
    for u_spread, v_spread in ((1.0, 1e-7), (1e-6, 1e-7), (1e-6, 1e-6), (0.5, 0.4)):
        view = rng.normal(0.0, [u_spread, v_spread], (n, 2))
        view[:2, 0] = -1.0, 1.0
        xyz = np.column_stack([view, np.ones(n)])
        tracemalloc.start()
        assert listed_image(xyz, np.eye(3)) is None
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert max(peaks) < 200 * n, peaks


def run(cloud: Cloud, **changes: object) -> Segmentation:
    return Pipeline(Params.from_mapping({"output": "objects", **changes})).run(cloud, lambda code, text: None)


def test_objects_of_a_list_are_those_of_the_image() -> None:
    """Without its grid and in another order, and seen in the frame of a robot, every point has the same label."""
    frame = looking(Camera.kinect(320, 240), on_table(box(0.0, 0.0), box(0.15, 0.25), box(-0.1, -0.25)))
    whole = run(frame.cloud)
    rows = np.random.default_rng(0).permutation(np.flatnonzero(np.isfinite(frame.cloud.xyz).all(axis=1)))
    cloud = Cloud(frame.cloud.xyz[rows], None, 1, len(rows))
    seg = run(cloud)
    assert len(whole.regions) == 3 and seg.notices == whole.notices == ()
    np.testing.assert_array_equal(seg.labels, whole.labels[rows])
    np.testing.assert_allclose(seg.regions.confidence, whole.regions.confidence)
    np.testing.assert_array_equal(cloud.xyz[seg.index], frame.cloud.xyz[whole.index])
    assert len(seg.surfaces) == len(whole.surfaces) and seg.sensor_model is not None
    for either in (cloud, frame.cloud):
        told = sensor_model_of(either)
        assert told is not None and told.pixel == seg.sensor_model.pixel
        np.testing.assert_array_equal(told.noise.value, seg.sensor_model.noise.value)
    assert sensor_model_of(Cloud(cloud.xyz + np.float32(0.1), None, 1, len(rows))) is None
    np.testing.assert_array_equal(seg.cut(0.005).labels, whole.cut(0.005).labels[rows])

    to_base = Rotation.from_euler("xyz", [-115.0, 3.0, 80.0], degrees=True)
    position = np.array([0.4, -0.2, 1.3])
    there = to_base.apply(cloud.xyz) + position
    x, y, z, w = to_base.as_quat()
    optical = Cloud(there, None, 1, len(rows), (*position, w, x, y, z))
    body = to_base * Rotation.from_matrix([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    given = {"sensor_pose": (*position, *body.as_euler("xyz"))}
    for placed, changes in ((optical, {}), (Cloud(there, None, 1, len(rows)), given)):
        assert known_sensor(placed, Params(**changes)) is not None  # type: ignore[arg-type]
        assert len(possible_axes(placed, Params(**changes))) == 3  # type: ignore[arg-type]
        found = run(placed, **changes)
        assert found.notices == () and (found.labels == whole.labels[rows]).mean() > 0.999
        np.testing.assert_allclose(found.regions.confidence, whole.regions.confidence, atol=0.01)
