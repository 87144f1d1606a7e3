# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Objects of organized clouds: figure and ground, confidence, vessels, and the same objects from a cut."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from clouds import TYPES, message
from frames import GRAY, TOP, Frame, box, looking, on_table

from topo_region_seg.beyond.objects.figure import flanked_pixels, highest_counted
from topo_region_seg.beyond.objects.vessels import insides, openings
from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.tables import regions
from topo_region_seg.data import Cloud
from topo_region_seg.offline.simulation import Body, Box, Camera, Cup
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.segmentation import Segmentation
from topo_region_seg.steps.view.outlines import Relations

CAMERA = Camera.kinect(320, 240)
OBJECTS = Params(output="objects")
THING = 4  # the first body that is no background
UPPER, LEFT, RIGHT = range(3)


def run(frame: Frame, **changes: object) -> Segmentation:
    return Pipeline(OBJECTS.replace(**changes)).run(frame.cloud)


def object_of(seg: Segmentation, of: npt.NDArray[np.bool_], share: float = 0.8) -> int:
    """Return the row of the object that holds most of some pixels."""
    labels = seg.labels[of]
    label = int(np.bincount(labels).argmax())
    assert label > 0 and np.mean(labels == label) > share
    return label - 1


def test_boxes_on_a_table_are_objects_each_and_sure() -> None:
    frame = looking(CAMERA, on_table(box(0.0, 0.0), box(0.15, 0.25), box(-0.1, -0.25)))
    seg = run(frame)
    assert len(seg.regions) == 3
    for thing in range(3):
        assert seg.regions.confidence[object_of(seg, frame.body == THING + thing, 0.95)] > 0.95
    assert np.mean(seg.labels[frame.body < THING] > 0) < 1e-3
    assert seg.plane is not None


def test_a_box_that_the_side_of_the_image_cuts_is_kept() -> None:
    frame = looking(CAMERA, on_table(box(-0.1, 0.43), box(0.1, -0.1)))
    edge = (frame.body == THING).reshape(frame.height, frame.width)[:, 0]
    assert edge.any() and not edge[-20:].any()  # the table goes on below
    seg = run(frame)
    confidence = seg.regions.confidence
    cut, whole = object_of(seg, frame.body == THING), object_of(seg, frame.body == THING + 1)
    assert 0.5 <= confidence[cut] < confidence[whole]


ARM = Body(Box((0.6, 0.14, 0.08)), GRAY, (-0.5, 0.0, TOP + 0.14))


def test_what_hangs_in_from_the_lower_edge_is_no_object() -> None:
    frame = looking(CAMERA, on_table(box(0.15, 0.1), ARM))
    assert (frame.body == THING + 1).reshape(frame.height, frame.width)[-1].any()
    every, sure = run(frame, min_confidence=0.0), run(frame)
    assert every.regions.confidence[object_of(every, frame.body == THING + 1)] < 0.5
    assert len(sure.regions) == 1 and object_of(sure, frame.body == THING) == 0


def test_a_wall_and_a_table_are_no_objects() -> None:
    frame = looking(CAMERA.look((-0.9, 0.0, 1.1), (0.1, 0.0, 0.95)), on_table(box(0.0, 0.0)))
    seg = run(frame, remove_floor=False, min_confidence=0.0)
    table, _, wall = (object_of(seg, frame.body == body, 0.5) for body in range(3))
    assert len({table, wall, object_of(seg, frame.body == THING)}) == 3
    assert (seg.regions.confidence[[table, wall]] < 0.5).all()
    assert seg.regions.confidence[object_of(seg, frame.body == THING)] > 0.95


@pytest.mark.parametrize("radius", [0.04, 0.06])
def test_a_cup_is_one_object_with_its_inside_and_two_without_vessels(radius) -> None:
    cup = Body(Cup(radius, 2 * radius, 0.004), GRAY, (0.0, 0.0, TOP + radius))
    frame = looking(CAMERA, on_table(cup))
    one, two = run(frame), run(frame, object_vessels=False)
    assert (len(one.regions), len(two.regions)) == (1, 2)
    np.testing.assert_array_equal(one.labels > 0, two.labels > 0)


def test_a_box_behind_a_box_is_not_its_inside() -> None:
    frame = looking(CAMERA, on_table(box(-0.05, 0.0, (0.06, 0.14, 0.08)), box(0.1, 0.0, (0.06, 0.14, 0.16))))
    assert len(run(frame).regions) == len(run(frame, object_vessels=False).regions) == 2


def test_less_confidence_asked_for_keeps_the_same_objects_and_perhaps_more() -> None:
    frame = looking(CAMERA, on_table(box(-0.1, 0.45), box(0.1, -0.1), ARM))
    found = [run(frame, min_confidence=least) for least in (0.0, 0.5, 0.9, 1.0)]
    assert len(found[0].regions) > len(found[2].regions) >= 1
    for least, fewer, more in zip((0.5, 0.9, 1.0), found[1:], found, strict=False):
        assert (fewer.regions.confidence >= least).all()
        assert len(fewer.regions) == np.count_nonzero(more.regions.confidence >= least)
        for label in fewer.regions.label:
            other = np.unique(more.labels[fewer.labels == label])
            assert len(other) == 1 and (more.labels == other[0]).sum() == (fewer.labels == label).sum()


def test_an_object_has_at_least_the_area_that_is_asked_for() -> None:
    frame = looking(CAMERA, on_table(box(0.0, 0.2, (0.05, 0.05, 0.05)), box(0.0, -0.2, (0.12, 0.12, 0.12))))
    assert len(run(frame).regions) == 2
    large = run(frame, object_min_area=0.006)
    assert len(large.regions) == 1 and object_of(large, frame.body == THING + 1) == 0
    assert len(run(frame, object_min_area=0.05).regions) == 0


@pytest.mark.parametrize("radius", [0.004, 0.007])
def test_objects_of_a_cut_are_those_of_a_new_run(radius) -> None:
    frame = looking(CAMERA, on_table(box(0.0, 0.0), box(0.15, 0.25), box(-0.1, 0.43)))
    cut, new = run(frame).cut(radius), run(frame, object_radius=radius)
    np.testing.assert_array_equal(cut.labels, new.labels)
    np.testing.assert_array_equal(cut.regions.confidence, new.regions.confidence)
    assert cut.params == new.params


def test_confidence_is_in_the_order_of_the_labels_in_table_and_message() -> None:
    # The surest object is the smaller one.
    frame = looking(CAMERA, on_table(box(-0.1, 0.43, (0.16, 0.16, 0.16)), box(0.1, -0.1, (0.06, 0.06, 0.06))))
    seg = run(frame)
    cut, whole = object_of(seg, frame.body == THING), object_of(seg, frame.body == THING + 1)
    assert (cut, whole) == (0, 1) and seg.regions.confidence[0] < seg.regions.confidence[1]
    assert [row.confidence for row in seg.regions] == seg.regions.confidence.tolist()
    msg = regions(TYPES, Answer(message(frame.cloud.xyz), frame.cloud, seg))
    offset = next(field.offset for field in msg.fields if field.name == "confidence")
    kind = np.dtype({"names": ["confidence"], "formats": ["<f4"], "offsets": [offset], "itemsize": msg.point_step})
    np.testing.assert_array_equal(
        np.frombuffer(bytes(msg.data), kind)["confidence"], seg.regions.confidence.astype("f4")
    )


def test_other_outputs_and_clouds_without_an_image_have_no_confidence() -> None:
    frame = looking(CAMERA, on_table(box(0.0, 0.0)))
    for output in ("regions", "supervoxels"):
        seg = Pipeline(Params(output=output, features="normals")).run(frame.cloud)
        assert len(seg.regions) and np.isnan(seg.regions.confidence).all()
    xyz = frame.cloud.xyz[np.isfinite(frame.cloud.xyz).all(axis=1)]
    xyz = xyz + np.random.default_rng(0).normal(scale=5e-4, size=xyz.shape)
    seg = Pipeline(OBJECTS).run(Cloud(xyz, None, 1, len(xyz)))
    assert len(seg.regions) and np.isnan(seg.regions.confidence).all()


def test_the_sensor_and_the_surfaces_of_a_frame_are_told() -> None:
    frame = looking(CAMERA, on_table(box(0.0, 0.0)))
    seg = run(frame)
    assert seg.sensor_model is not None and 0.0 < seg.sensor_model.pixel < 0.01
    assert seg.plane is not None and seg.surfaces[0].offset == pytest.approx(seg.plane.offset)
    np.testing.assert_allclose(seg.surfaces[0].normal, seg.plane.normal)
    plain = Pipeline(Params(features="normals")).run(frame.cloud)
    assert plain.sensor_model is None and plain.surfaces == ()


def test_it_is_said_why_a_frame_has_no_objects() -> None:
    y, x = np.mgrid[-0.3:0.3:60j, -0.4:0.4:80j]
    wall = np.stack([x, y, np.ones_like(x)], axis=2).reshape(-1, 3)
    seg = Pipeline(OBJECTS.replace(remove_floor=False)).run(Cloud(wall, None, *x.shape), lambda code, text: None)
    assert len(seg.regions) == 0 and [notice.code for notice in seg.notices] == ["no_regions"]
    assert "min_confidence = 0.5" in seg.notices[0].text
    sure = Pipeline(OBJECTS.replace(remove_floor=False, min_confidence=0.0)).run(Cloud(wall, None, *x.shape))
    assert len(sure.regions) == 1 and sure.notices == ()


def test_pixels_lost_here_and_there_change_nothing() -> None:
    frame = looking(CAMERA, on_table(box(-0.15, 0.0), box(0.15, 0.05)))
    lost = np.random.default_rng(0).random(len(frame.cloud)) < 0.2
    cloud = Cloud(np.where(lost[:, None], np.nan, frame.cloud.xyz), None, frame.cloud.height, frame.cloud.width)
    whole, holed = run(frame), Pipeline(OBJECTS).run(cloud)
    assert len(holed.regions) == len(whole.regions) == 2
    assert (holed.labels == whole.labels)[~lost].mean() > 0.99


def test_a_frame_with_nothing_on_the_table_has_no_objects() -> None:
    frame = looking(CAMERA, on_table())
    assert len(run(frame).regions) == 0


@pytest.mark.parametrize("side", [UPPER, LEFT, RIGHT])
def test_pixels_at_an_edge_count_where_the_support_goes_on_beside_them(side) -> None:
    n, table, behind = 3, 3, 4

    def count(along: list[int], depth: int = 0) -> list[float]:
        """Return what is flanked where labels follow one another along an edge, from left to right or downwards."""
        image = np.zeros((len(along), 20), np.int32) if side != UPPER else np.zeros((20, len(along)), np.int32)
        if side == UPPER:
            image[depth] = along
        else:
            image[:, depth if side == LEFT else -1 - depth] = along
        found: list[float] = flanked_pixels(image.ravel(), *image.shape, n, np.ones(n, np.bool_)).tolist()
        return found

    both, below, above = [3, 3, 1, 1, 1, 3, 3], [4, 1, 1, 3, 3, 3, 3], [3, 3, 3, 3, 1, 1, 4]
    assert table == n and behind == n + 1
    assert count(both) == [0.0, 3.0, 0.0]
    assert count(below) == [0.0, 0.0 if side == UPPER else 2.0, 0.0]
    assert count(above) == [0.0, 0.0, 0.0]
    assert count([1, 1, 3, 3, 2, 2, 3]) == [0.0, 0.0 if side == UPPER else 2.0, 2.0]
    assert count([3, 1, 1, 2, 2, 3]) == [0.0, 2.0, 2.0]  # another thing, too, shows that the view goes on
    assert count([3, 1, 0, 1, 0, 3]) == [0.0, 2.0, 0.0]  # looked at across gaps
    assert count(both, depth=4) == [0.0, 3.0, 0.0] and count(both, depth=5) == [0.0, 0.0, 0.0]


def test_at_the_lower_edge_what_is_small_counts_and_a_corner_counts_at_each_edge() -> None:
    image = np.zeros((12, 15), np.int32)
    image[-1] = [3, 3, 3, 3, 3, 1, 1, 1, 1, 3, 3, 3, 3, 3, 3]
    for small, wanted in ((True, 4.0), (False, 0.0)):
        assert flanked_pixels(image.ravel(), *image.shape, 3, np.full(3, small)).tolist() == [0.0, wanted, 0.0]
    image = np.full((12, 15), 3, np.int32)
    image[:4, :5] = 1
    # Along the left edge the support follows below; along the upper one it is on one side alone.
    assert flanked_pixels(image.ravel(), *image.shape, 3, np.ones(3, np.bool_)).tolist() == [0.0, 4.0, 0.0]


def sphere(sign: float, seed: int, count: int = 500) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    d = np.random.default_rng(seed).normal(size=(count, 3))
    d /= np.linalg.norm(d, axis=1)[:, None]
    return (0.05 * d).astype(np.float32), (sign * d).astype(np.float32)


def test_openings_are_above_zero_outside_below_inside_and_zero_on_a_plane() -> None:
    outside, inside = sphere(1.0, 0), sphere(-1.0, 1)
    flat = np.random.default_rng(2).random((500, 3)).astype(np.float32) * np.float32([1, 1, 0])
    xyz = np.concatenate([outside[0], inside[0], flat, flat[:19]])
    normals = np.concatenate([outside[1], inside[1], np.tile(np.float32([0, 0, 1]), (519, 1))])
    label = np.repeat([1, 2, 3, 4], [500, 500, 500, 19]).astype(np.int32)
    order = np.random.default_rng(3).permutation(len(label))
    found = openings(label[order], xyz[order], normals[order], 5)
    # On a sphere (n_i - n_j) . (x_i - x_j) / |x_i - x_j| is |n_i - n_j|, whose mean is 4/3.
    np.testing.assert_allclose(found, [0.0, 4 / 3, -4 / 3, 0.0, 0.0], atol=0.08)


def inside_of(own: float, before: float, standing: float, hiding: float, opening: list[float]) -> list[int]:
    """Return the groups of an outside 1 and what may be its inside 2, of whose outline these are the pixels."""
    n = 3
    first, second = np.array([1, 2, 2, 2]), np.array([2, 1, 3, 4])
    pixels = np.array([[0.0, 0.0, before], [before, 0.0, hiding], [0.0, standing, 0.0], [0.0, 0.0, own]])
    return insides(Relations(first, second, pixels, np.zeros(n + 3), np.zeros(n + 3)), np.array(opening)).tolist()


def test_an_inside_is_concave_has_a_rim_and_is_hidden_by_something_convex() -> None:
    cup = [0.0, 0.4, -0.4]
    assert inside_of(50.0, 50.0, 0.0, 0.0, cup) == [0, 1, 1]
    assert inside_of(10.0, 90.0, 0.0, 0.0, cup) == [0, 1, 2]  # hardly a rim
    assert inside_of(90.0, 10.0, 0.0, 0.0, cup) == [0, 1, 2]  # hardly hidden
    assert inside_of(50.0, 30.0, 20.0, 0.0, cup) == [0, 1, 2]  # stands on the ground
    assert inside_of(50.0, 30.0, 0.0, 20.0, cup) == [0, 1, 2]  # hides the other
    assert inside_of(50.0, 50.0, 0.0, 0.0, [0.0, 0.4, -0.1]) == [0, 1, 2]  # flat
    assert inside_of(50.0, 50.0, 0.0, 0.0, [0.0, 0.1, -0.4]) == [0, 1, 2]  # behind something flat


def test_a_few_of_the_highest_pixels_of_a_label_do_not_count() -> None:
    rng = np.random.default_rng(0)
    label, height = rng.integers(1, 5, 800).astype(np.int32), rng.normal(size=800)
    label[:3] = 6
    found = highest_counted(label, height, 7)
    for k in range(7):
        own = np.sort(height[label == k])
        assert found[k] == (own[int(0.97 * len(own))] if len(own) else 0.0)
