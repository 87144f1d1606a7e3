# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What became of each point: it is told of every one, against the bodies of made scenes."""

from __future__ import annotations

import numpy as np
import pytest
from frames import GRAY, TOP, Frame, box, looking, on_table

from topo_region_seg.data import Cloud, PointClass
from topo_region_seg.offline.simulation import Body, Box, Camera
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.segmentation import Segmentation

CAMERA = Camera.kinect(320, 240)
LEVEL = CAMERA.look((-0.9, 0.0, 1.1), (0.1, 0.0, 0.95))
TABLE, FLOOR, WALL, THING = 0, 1, 2, 4
ARM = Body(Box((0.6, 0.14, 0.08)), GRAY, (-0.5, 0.0, TOP + 0.14))
OBJECTS = Params(output="objects")


def run(frame: Frame, **changes: object) -> Segmentation:
    return Pipeline(OBJECTS.replace(**changes)).run(frame.cloud)


def share(seg: Segmentation, frame: Frame, body: int, of: PointClass) -> float:
    """Return the share of a body's points that are of a class."""
    return float(np.mean(seg.point_classes[frame.body == body] == of))


def test_table_wall_and_box_are_told_apart() -> None:
    frame = looking(LEVEL, on_table(box(0.0, 0.0)))
    seg = run(frame)
    assert seg.point_classes.dtype == np.uint8 and seg.point_classes.shape == seg.labels.shape
    assert share(seg, frame, TABLE, PointClass.SUPPORT) > 0.98
    assert share(seg, frame, WALL, PointClass.STRUCTURE) + share(seg, frame, WALL, PointClass.BEHIND) > 0.9  # noise
    assert np.count_nonzero(seg.point_classes == PointClass.STRUCTURE) > 1000
    assert share(seg, frame, THING, PointClass.LABELED) > 0.95
    np.testing.assert_array_equal(seg.point_classes == PointClass.LABELED, seg.labels > 0)
    invalid = ~np.isfinite(frame.cloud.xyz).all(axis=1)
    np.testing.assert_array_equal(seg.point_classes == PointClass.NOTHING, invalid)


def test_what_lies_lower_than_the_table_is_behind_it() -> None:
    frame = looking(CAMERA.look((-1.2, 0.0, 1.5), (0.3, 0.0, 0.7)), on_table(box(0.0, 0.0)))
    seg, floor = run(frame), frame.body == FLOOR
    assert np.count_nonzero(floor) > 1000 and share(seg, frame, FLOOR, PointClass.BEHIND) > 0.98


def test_what_is_not_sure_enough_is_told_and_gets_a_label_where_less_is_asked_for() -> None:
    frame = looking(CAMERA, on_table(box(0.15, 0.1), ARM))
    seg, every = run(frame), run(frame, min_confidence=0.0)
    assert share(seg, frame, THING + 1, PointClass.UNSURE) > 0.9
    unsure = seg.point_classes == PointClass.UNSURE
    np.testing.assert_array_equal(unsure, (every.labels > 0) & (seg.labels == 0))
    assert (every.point_classes != PointClass.UNSURE).all()
    np.testing.assert_array_equal(every.point_classes[~unsure], seg.point_classes[~unsure])


def test_what_is_too_small_for_an_object_is_loose() -> None:
    frame = looking(CAMERA, on_table(box(0.0, 0.2, (0.05, 0.05, 0.05)), box(0.0, -0.2, (0.12, 0.12, 0.12))))
    seg = run(frame, object_min_area=0.006)
    assert share(seg, frame, THING, PointClass.LOOSE) > 0.7  # its foot goes with the table
    assert share(seg, frame, THING + 1, PointClass.LABELED) > 0.9


def test_cropped_points_are_nothing() -> None:
    frame = looking(LEVEL, on_table(box(0.0, 0.0)))
    seg = run(frame, max_range=1.2)
    distance = np.linalg.norm(frame.cloud.xyz, axis=1)
    np.testing.assert_array_equal(seg.point_classes == PointClass.NOTHING, ~(distance <= 1.2))


def test_the_points_alone_in_any_order_have_the_classes_of_the_image() -> None:
    frame = looking(CAMERA, on_table(box(0.15, 0.1), ARM))
    order = np.random.default_rng(0).permutation(np.flatnonzero(np.isfinite(frame.cloud.xyz).all(axis=1)))
    seg = Pipeline(OBJECTS).run(Cloud(frame.cloud.xyz[order], None, 1, len(order)))
    assert seg.sensor_model is not None  # found to be an image
    np.testing.assert_array_equal(seg.point_classes, run(frame).point_classes[order])


def test_a_cut_tells_its_own_classes() -> None:
    frame = looking(CAMERA, on_table(box(0.0, 0.0), ARM))
    cut, new = run(frame).cut(0.004), run(frame, object_radius=0.004)
    np.testing.assert_array_equal(cut.point_classes, new.point_classes)


@pytest.mark.parametrize("output", ["regions", "objects", "supervoxels"])
def test_clouds_without_an_image_tell_the_support_from_what_has_no_label(output: str) -> None:
    frame = looking(CAMERA, on_table(box(0.0, 0.0)))
    valid = np.flatnonzero(np.isfinite(frame.cloud.xyz).all(axis=1))
    xyz = frame.cloud.xyz[valid] + np.random.default_rng(0).normal(scale=5e-4, size=(len(valid), 3)).astype(np.float32)
    seg = Pipeline(Params(output=output, features="normals")).run(Cloud(xyz, None, 1, len(xyz)), lambda *_: None)
    assert seg.plane is not None and seg.surfaces == ()
    height = xyz @ np.array(seg.plane.normal) + seg.plane.offset
    least = seg.params.object_floor_distance if output == "objects" else seg.params.floor_distance
    sure = np.abs(height - least) > 1e-5
    classes = seg.point_classes
    np.testing.assert_array_equal(classes[sure] == PointClass.SUPPORT, height[sure] < least)
    assert set(np.unique(classes)) <= {PointClass.SUPPORT, PointClass.LABELED, PointClass.LOOSE}
    np.testing.assert_array_equal(classes == PointClass.LABELED, seg.labels > 0)
