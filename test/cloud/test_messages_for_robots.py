# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Detections, surfaces, label image and foreground points, each field against the segmentation that they come from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from clouds import DRIVERS, TYPES, Driver, message, scene
from scipy.spatial.transform import Rotation

from topo_region_seg.beyond.boxes.oriented import oriented_boxes
from topo_region_seg.beyond.boxes.surfaces import corners_of, surface_boxes
from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.detections import CLASSES, UNJUDGED, detections, surfaces
from topo_region_seg.cloud.messages.label_image import label_image
from topo_region_seg.cloud.messages.labeled import foreground_points, labeled_points
from topo_region_seg.cloud.pointcloud2 import CloudFormatError, decode, field_of
from topo_region_seg.data import Cloud
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

MM, DEGREES = 0.001, np.pi / 180


@pytest.fixture(scope="module", params=["regions", "objects", "supervoxels"])
def answer(request):
    frame = simulate(tabletop(seed=1), Camera.kinect(320, 240), seed=1)
    cloud = frame.cloud
    msg = message(cloud.xyz, cloud.rgb, height=cloud.height)
    seg = Pipeline(Params(output=request.param)).run(cloud)
    assert len(seg.regions) >= 2 and seg.plane is not None
    return Answer(msg, cloud, seg)


def columns(msg):
    kinds = {1: "i1", 2: "u1", 3: "<i2", 4: "<u2", 5: "<i4", 6: "<u4", 7: "<f4", 8: "<f8"}
    names, offsets = [f.name for f in msg.fields], [f.offset for f in msg.fields]
    formats = [(kinds[f.datatype], (f.count,) if f.count > 1 else ()) for f in msg.fields]
    layout = {"names": names, "formats": formats, "offsets": offsets, "itemsize": msg.point_step}
    return np.asarray(msg.data).view(np.dtype(layout))


def vector(value):
    return np.array([value.x, value.y, value.z])


def rotation(value):
    return Rotation.from_quat([value.x, value.y, value.z, value.w]).as_matrix()


def test_a_detection_for_each_region(answer):
    seg, boxes = answer.seg, oriented_boxes(answer.seg)
    out = detections(TYPES, answer)
    assert out.header == answer.msg.header
    assert [d.id for d in out.detections] == [str(label) for label in seg.regions.label]
    assert CLASSES == {"regions": "region", "objects": "object", "supervoxels": "supervoxel"}
    for row, found in enumerate(out.detections):
        assert found.header == answer.msg.header
        (result,) = found.results
        assert result.hypothesis.class_id == CLASSES[seg.params.output]
        confidence = seg.regions.confidence[row]
        assert result.hypothesis.score == (UNJUDGED if np.isnan(confidence) else confidence)
        assert result.hypothesis.score == pytest.approx(1.0) or seg.params.output == "objects"
        assert result.pose.pose == found.bbox.center
        assert result.pose.covariance.tolist() == [0.0] * 36
        np.testing.assert_array_equal(vector(found.bbox.center.position), boxes.center[row])
        np.testing.assert_allclose(rotation(found.bbox.center.orientation), boxes.axes[row], atol=1e-9)
        np.testing.assert_array_equal(vector(found.bbox.size), boxes.size[row])
        np.testing.assert_allclose(boxes.axes[row, :, 2], seg.plane.normal, atol=1e-9)
        # The box holds the points with the label, but for strays and what thinning took from its rim.
        points = answer.cloud.xyz[seg.labels == int(found.id)]
        local = np.abs((points - vector(found.bbox.center.position)) @ rotation(found.bbox.center.orientation))
        assert (local <= vector(found.bbox.size) / 2 + 3 * MM).all(axis=1).mean() > 0.97


def test_the_support_and_other_structure(answer):
    seg, boxes = answer.seg, surface_boxes(answer.cloud, answer.seg)
    out = surfaces(TYPES, answer)
    assert out.header == answer.msg.header
    kinds = [found.results[0].hypothesis.class_id for found in out.detections]
    assert kinds[:1] == ["support"] and set(kinds[1:]) <= {"structure"}
    assert len(kinds) == (len(seg.surfaces) if seg.params.output == "objects" else 1)
    for row, found in enumerate(out.detections):
        (result,) = found.results
        assert (found.header, found.id, result.hypothesis.score) == (answer.msg.header, "", 1.0)
        assert result.pose.pose == found.bbox.center
        np.testing.assert_array_equal(vector(found.bbox.center.position), boxes.center[row])
        np.testing.assert_allclose(rotation(found.bbox.center.orientation), boxes.axes[row], atol=1e-9)
        np.testing.assert_array_equal(vector(found.bbox.size), boxes.size[row])
    support = out.detections[0].bbox
    center, turn = vector(support.center.position), rotation(support.center.orientation)
    assert turn[:, 2] @ seg.plane.normal > np.cos(0.5 * DEGREES), "z is the normal"
    assert abs(center @ seg.plane.normal + seg.plane.offset) < 2 * MM
    assert center @ turn[:, 2] < 0.0, "which points to the sensor"
    assert support.size.x >= support.size.y > 0.3
    # Points on the plane without a label are in the box, but for the rim: the hull is that of a sample.
    height = answer.cloud.xyz @ np.array(seg.plane.normal) + seg.plane.offset
    on = (np.abs(height) < 2 * MM) & (seg.labels == 0)
    local = np.abs((answer.cloud.xyz[on] - center) @ turn)
    assert (local <= vector(support.size) / 2 + 2 * MM).all(axis=1).mean() > 0.95


def test_a_cloud_without_a_plane_has_no_surfaces():
    xyz, rgb = scene()
    cloud = Cloud(xyz, rgb, 48, 64)
    seg = Pipeline(Params(remove_floor=False)).run(cloud)
    assert surfaces(TYPES, Answer(message(xyz, rgb), cloud, seg)).detections == []


def test_a_support_of_known_size_and_pose():
    """A board of 0.8 by 0.5 m, turned, with a box on it, as a list of points."""
    turn = Rotation.from_euler("xyz", [2.2, 0.3, 0.4]).as_matrix()
    u, v = np.meshgrid(np.linspace(-0.4, 0.4, 161), np.linspace(-0.25, 0.25, 101))
    board = np.column_stack([u.ravel(), v.ravel(), np.zeros(u.size)])
    top = board[(np.abs(board[:, 0]) < 0.05) & (np.abs(board[:, 1]) < 0.05)] + [0, 0, 0.1]
    middle = np.array([0.1, 0.0, 1.1])
    xyz = (np.concatenate([board, top]) @ turn.T + middle).astype(np.float32)
    cloud = Cloud(xyz, np.full((len(xyz), 3), 120, np.uint8), 1, len(xyz))
    seg = Pipeline(Params()).run(cloud)
    boxes = surface_boxes(cloud, seg)
    assert boxes.support.tolist() == [True]
    np.testing.assert_allclose(boxes.center[0], middle, atol=3 * MM)
    np.testing.assert_allclose(boxes.size[0], [0.8, 0.5, 2 * seg.params.floor_distance], atol=5 * MM)
    normal = turn[:, 2] if turn[:, 2] @ middle < 0 else -turn[:, 2]
    assert boxes.axes[0, :, 2] @ normal > np.cos(DEGREES)
    assert abs(boxes.axes[0, :, 0] @ turn[:, 0]) > np.cos(DEGREES)
    assert np.linalg.det(boxes.axes[0]) == pytest.approx(1.0)


def test_corners_of_a_footprint_are_where_its_sides_meet():
    angles = np.array([0.3, 1.4, 2.9, 4.0, 5.5])
    sides = np.column_stack([np.cos(angles), np.sin(angles), -np.ones(5)])
    corners = corners_of(sides[[3, 0, 4, 1, 2, 0]])
    assert len(corners) == 5
    inside = corners @ sides[:, :2].T + sides[:, 2]
    assert (inside < 1e-9).all() and ((np.abs(inside) < 1e-9).sum(axis=1) == 2).all()


def test_label_image(answer):
    out = label_image(TYPES, answer)
    cloud = answer.cloud
    assert out.header == answer.msg.header
    assert (out.height, out.width, out.encoding, out.is_bigendian, out.step) == (240, 320, "mono16", 0, 640)
    pixels = np.asarray(out.data).view("<u2")
    np.testing.assert_array_equal(pixels, answer.seg.labels)
    assert len(pixels) == len(cloud)


def test_labels_beyond_16_bits_are_0_and_a_list_of_points_has_no_image(answer):
    said = []
    labels = answer.seg.labels.copy()
    labels[7], labels[8] = 65_535, 65_536
    many = replace(answer, seg=replace(answer.seg, labels=labels), warn=lambda code, text: said.append(code))
    pixels = np.asarray(label_image(TYPES, many).data).view("<u2")
    assert (pixels[7], pixels[8]) == (65_535, 0)
    assert said == ["label_image_full"]
    loose = replace(answer.cloud, height=1, width=len(answer.cloud))
    assert label_image(TYPES, replace(many, cloud=loose)) is None
    assert said[1:] == ["label_image_unorganized"]


def test_foreground_is_the_points_with_a_label(answer):
    out, whole = foreground_points(TYPES, answer), labeled_points(TYPES, answer)
    assert out.header == answer.msg.header
    assert [(f.name, f.offset, f.datatype, f.count) for f in out.fields] == [
        ("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("rgb", 12, 7, 1), ("label", 16, 6, 1),
    ]  # fmt: skip
    kept = answer.seg.labels > 0
    assert (out.height, out.width, out.point_step) == (1, kept.sum(), 20)
    assert out.row_step == 20 * out.width == len(out.data)
    assert out.is_dense and np.isfinite(columns(out)["z"]).all()
    assert columns(out).tobytes() == columns(whole)[kept].tobytes()
    assert set(np.unique(columns(out)["label"])) == set(answer.seg.regions.label)


LIDAR = Driver([*DRIVERS["velodyne"].fields[:3], ("intensity", 12, 7), ("ring", 16, 4), ("time", 18, 8)], 26, False)


@pytest.mark.parametrize("big_endian", [False, True])
def test_fields_that_are_asked_for_are_passed_on(big_endian):
    xyz, _ = scene()
    msg = message(xyz, driver=LIDAR, height=48, row_padding=6, big_endian=big_endian)
    order = ">" if big_endian else "<"
    raw = np.lib.stride_tricks.as_strided(msg.data, (48, 64, 26), (msg.row_step, 26, 1))
    wanted = {
        name: raw[..., offset : offset + size].copy().view(order + kind)[..., 0].ravel()
        for name, offset, size, kind in (("intensity", 12, 4, "f4"), ("ring", 16, 2, "u2"), ("time", 18, 8, "f8"))
    }
    cloud = decode(msg, max_points=10**5, needs_color=False)
    seg = Pipeline(Params(features="normals")).run(cloud)
    said = []
    names = ("ring", "time", "x", "missing", "intensity")
    answer = Answer(msg, cloud, seg, names, lambda code, text: said.append((code, text)))
    whole, front = labeled_points(TYPES, answer), foreground_points(TYPES, answer)
    assert [f.name for f in whole.fields] == ["x", "y", "z", "rgb", "label", "ring", "time", "intensity"]
    assert [f.datatype for f in whole.fields[5:]] == [4, 8, 7]
    assert (whole.height, whole.width, whole.point_step, whole.is_bigendian) == (48, 64, 34, False)
    kept = seg.labels > 0
    for name, values in wanted.items():
        np.testing.assert_array_equal(columns(whole)[name], values)
        np.testing.assert_array_equal(columns(front)[name], values[kept])
    np.testing.assert_array_equal(columns(whole)["label"], seg.labels)
    np.testing.assert_array_equal(columns(whole)["x"], cloud.xyz[:, 0])
    assert {code for code, _ in said} == {"pass_fields_missing"}
    assert "the clouds have the fields x, y, z, intensity, ring, time" in said[0][1]


def test_a_field_with_several_numbers_stays_whole():
    xyz, _ = scene()
    msg = message(xyz, driver=Driver(DRIVERS["realsense without texture"].fields, 28, False), height=48)
    msg.fields = [*msg.fields, TYPES.PointField(name="three", offset=15, datatype=5, count=3)]
    values = field_of(msg, "three")
    raw = np.asarray(msg.data).reshape(-1, 28)[:, 15:27].copy().view("<i4")
    np.testing.assert_array_equal(values, raw)
    cloud = decode(msg, max_points=10**5, needs_color=False)
    seg = Pipeline(Params(features="normals")).run(cloud)
    out = labeled_points(TYPES, Answer(msg, cloud, seg, ("three",)))
    assert [(f.name, f.offset, f.datatype, f.count) for f in out.fields[-1:]] == [("three", 20, 5, 3)]
    np.testing.assert_array_equal(columns(out)["three"], raw)
    with pytest.raises(CloudFormatError, match="images have none"):
        field_of(TYPES.Time(sec=1, nanosec=0), "three")
