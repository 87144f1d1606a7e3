# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest
from clouds import DRIVERS, TYPES, message, random_points, scene

from topo_region_seg.beyond.boxes.oriented import oriented_boxes
from topo_region_seg.cloud.messages import detections, label_image, labeled, markers, tables
from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.topics import OUTPUTS
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags.types import typestore
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

CLOUD = "sensor_msgs/msg/PointCloud2"


@pytest.fixture(scope="module")
def segmented():
    xyz, rgb = scene()
    xyz[5] = np.nan
    xyz[6] = 0.0
    msg = message(xyz, rgb, driver=DRIVERS["zivid"], height=48, alpha=255)
    cloud = decode(msg, max_points=10**6)
    seg = Pipeline(Params(normal_radius=0.015)).run(cloud)
    assert len(seg.regions) >= 2
    return Answer(msg, cloud, seg)


def columns(msg):
    record = np.dtype([(field.name, {7: "<f4", 6: "<u4"}[field.datatype]) for field in msg.fields])
    assert record.itemsize == msg.point_step
    return np.asarray(msg.data).view(record)


def vector(value):
    return [value.x, value.y, value.z]


def quaternion(value):
    return [value.x, value.y, value.z, value.w]


def test_labeled_points_keep_header_order_and_color(segmented):
    msg, cloud, seg = segmented.msg, segmented.cloud, segmented.seg
    out = labeled.labeled_points(TYPES, segmented)
    assert out.header == msg.header
    assert (out.height, out.width, out.point_step, out.is_dense) == (48, 64, 20, False)
    assert [(f.name, f.offset, f.datatype, f.count) for f in out.fields] == [
        ("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("rgb", 12, 7, 1), ("label", 16, 6, 1),
    ]  # fmt: skip
    table = columns(out)
    np.testing.assert_array_equal(np.stack([table[axis] for axis in "xyz"], axis=1), cloud.xyz)
    bits = np.ascontiguousarray(table["rgb"]).view("<u4")
    assert (bits >> 24 == 0).all()
    np.testing.assert_array_equal(bits >> 16, cloud.rgb[:, 0])
    np.testing.assert_array_equal(bits & 255, cloud.rgb[:, 2])
    np.testing.assert_array_equal(table["label"], seg.labels)
    assert table["label"][5] == table["label"][6] == 0


def test_region_colors_are_those_of_the_boxes_and_dark_without_a_region(segmented):
    seg = segmented.seg
    out = labeled.region_colors(TYPES, segmented)
    usual = labeled.labeled_points(TYPES, segmented)
    assert (out.header, out.height, out.width, out.fields) == (usual.header, usual.height, usual.width, usual.fields)
    for name in ("x", "y", "z", "label"):
        np.testing.assert_array_equal(columns(out)[name], columns(usual)[name])
    bits = np.ascontiguousarray(columns(out)["rgb"]).view("<u4")
    rgb = np.column_stack([bits >> 16, bits >> 8 & 255, bits & 255])
    assert (rgb[seg.labels == 0] == 48).all()
    boxes = [m for m in markers.region_markers(TYPES, segmented).markers if m.ns == "boxes"]
    assert len(boxes) == len(seg.regions) > 1
    for box in boxes:
        color = 255 * np.array([box.color.r, box.color.g, box.color.b])
        np.testing.assert_allclose(rgb[seg.labels == box.id] - color, 0.0, atol=1e-3)


def test_region_rows(segmented):
    """Every column of every region, computed from the labeled points."""
    cloud, seg = segmented.cloud, segmented.seg
    out = tables.regions(TYPES, segmented)
    table = columns(out)
    assert table.dtype.names == (
        "x", "y", "z", "label", "size", "min_x", "min_y", "min_z", "extent_x", "extent_y", "extent_z",
        "L", "a", "b", "normal_x", "normal_y", "normal_z", "persistence", "confidence",
    )  # fmt: skip
    assert len(table) == len(seg.regions) == len(set(table["label"]))
    for row, region in zip(table, seg.regions, strict=True):
        points = cloud.xyz[seg.labels == row["label"]]
        assert row["size"] == len(points)
        low, high = points.min(axis=0), points.max(axis=0)
        given = {
            "x y z": region.centroid,
            "min_x min_y min_z": region.minimum,
            "extent_x extent_y extent_z": np.subtract(region.maximum, region.minimum),
            "L a b": region.mean_lab,
            "normal_x normal_y normal_z": region.mean_normal,
        }
        for names, values in given.items():
            np.testing.assert_allclose([row[name] for name in names.split()], values, rtol=1e-5, atol=1e-6)
        # Averages over voxels lie within the points; the box of what was averaged is no larger than theirs.
        assert all(low[i] <= row[name] <= high[i] for i, name in enumerate("xyz"))
        assert all(low[i] - 1e-6 <= row[f"min_{name}"] for i, name in enumerate("xyz"))
        assert all(row[f"min_{n}"] + row[f"extent_{n}"] <= high[i] + 1e-6 for i, n in enumerate("xyz"))
        np.testing.assert_allclose(np.linalg.norm([row[f"normal_{name}"] for name in "xyz"]), 1.0, rtol=1e-5)
        np.testing.assert_allclose(row["persistence"], region.persistence, rtol=1e-6)
    # Regions are no objects, so that nothing is known of their confidence; what has unknown values is not dense.
    assert np.isnan(table["confidence"]).all() and not out.is_dense
    known = [name for name in table.dtype.names if name != "confidence"]
    assert all(np.isfinite(table[name]).all() for name in known)
    grey = Pipeline(Params(normal_radius=0.015, features="normals")).run(Cloud(cloud.xyz, None, 48, 64))
    plain = tables.regions(TYPES, Answer(segmented.msg, cloud, grey))
    assert np.isnan(columns(plain)["L"]).all() and not plain.is_dense
    red, blue = table[np.argsort(table["x"])][[0, -1]]
    assert red["a"] > 40.0 and blue["b"] < -40.0
    assert red["normal_x"] * blue["normal_x"] < 0.0 and max(red["normal_z"], blue["normal_z"]) < 0.0


def test_barcode_rows(segmented):
    seg = segmented.seg
    out = tables.barcode(TYPES, segmented)
    table = columns(out)
    assert len(table) == len(seg.barcode) and not out.is_dense, "regions live on: their bars have no end"
    xyz = np.column_stack([table[name] for name in "xyz"])
    np.testing.assert_array_equal(xyz, seg.barcode.xyz.astype(np.float32))
    np.testing.assert_array_equal(table["death"], seg.barcode.death.astype(np.float32))
    np.testing.assert_array_equal(table["label"], seg.barcode.label)
    assert (table["birth"] == 0).all()


def test_markers_delete_those_before_and_label_each_region(segmented):
    seg, boxes = segmented.seg, oriented_boxes(segmented.seg)
    made = markers.region_markers(TYPES, segmented).markers
    assert made[0].action == TYPES.Marker.DELETEALL
    assert made[0].color == TYPES.ColorRGBA(r=0.0, g=0.0, b=0.0, a=0.0), "what is not meant is as in a new message"
    assert (made[0].ns, made[0].id, made[0].text, made[0].lifetime.sec) == ("", 0, "", 0)
    assert len(made) == 2 + 2 * len(seg.regions)
    assert (made[-1].ns, made[-1].text) == ("count", f"{len(seg.regions)} regions")
    assert len({(marker.ns, marker.id) for marker in made}) == len(made)
    assert {marker.header.frame_id for marker in made} == {"camera"}
    assert not any(marker.frame_locked or marker.lifetime.sec or marker.lifetime.nanosec for marker in made)
    assert all(marker.action == TYPES.Marker.ADD for marker in made[1:])
    of = {(marker.ns, marker.id): marker for marker in made}
    for row, region in enumerate(seg.regions):
        box, text = of["boxes", region.label], of["labels", region.label]
        assert (box.type, text.type) == (TYPES.Marker.CUBE, TYPES.Marker.TEXT_VIEW_FACING)
        np.testing.assert_array_equal(vector(box.pose.position), boxes.center[row])
        np.testing.assert_array_equal(quaternion(box.pose.orientation), boxes.quaternion[row])
        np.testing.assert_array_equal(vector(box.scale), np.maximum(boxes.size[row], 0.001))
        np.testing.assert_allclose(vector(text.pose.position), region.centroid)
        assert quaternion(text.pose.orientation) == [0.0, 0.0, 0.0, 1.0]
        assert vector(text.scale) == [0.0, 0.0, 0.03]
        assert text.text == f"{region.label} ({region.size})"
        assert (text.color.r, text.color.g, text.color.b, text.color.a) == (1.0, 1.0, 1.0, 1.0)
        assert box.color.a == markers.BOX_ALPHA
        assert 0.0 < box.color.a < 1.0
    low, high = seg.regions.minimum.min(axis=0), seg.regions.maximum.max(axis=0)
    middle = (low + high) / 2
    np.testing.assert_allclose(vector(made[-1].pose.position), [middle[0], low[1] - 0.06, middle[2]])


def test_a_region_without_volume_has_a_box_that_rviz_draws():
    xyz, rgb = scene()
    xyz[:, 2] = 0.6
    cloud = Cloud(xyz, rgb, 48, 64)
    seg = Pipeline(Params(features="color", remove_floor=False, voxel_size=0.0)).run(cloud)
    made = markers.region_markers(TYPES, Answer(message(xyz, rgb), cloud, seg)).markers
    assert [marker.scale.z for marker in made if marker.ns == "boxes"] == [0.001, 0.001]


def test_everything_serializes(segmented):
    for output in OUTPUTS:
        made = output.make(TYPES, segmented)
        typestore().deserialize_cdr(typestore().serialize_cdr(made, output.kind), output.kind)
    assert tables.region_count(TYPES, segmented).data == len(segmented.seg.regions)


def test_empty_cloud():
    xyz, rgb = random_points(0)
    cloud = Cloud(xyz, rgb, 0, 7)
    msg = message(xyz, rgb)
    answer = Answer(msg, cloud, Pipeline(Params()).run(cloud))
    out = labeled.labeled_points(TYPES, answer)
    assert (out.height, out.width, len(out.data)) == (0, 7, 0)
    assert labeled.foreground_points(TYPES, answer).width == 0
    assert tables.regions(TYPES, answer).width == 0
    assert tables.barcode(TYPES, answer).width == 0
    assert len(markers.region_markers(TYPES, answer).markers) == 1
    assert detections.detections(TYPES, answer).detections == []
    assert detections.surfaces(TYPES, answer).detections == []


def test_rclpy_types_pass_their_field_checks(segmented, ros_domain):
    pytest.importorskip("rclpy", reason="rclpy cannot be imported")
    from topo_region_seg.ros.types import ros_types

    types = ros_types()
    seg = segmented.seg
    answer = Answer(types.PointCloud2(), segmented.cloud, seg)
    assert len(labeled.labeled_points(types, answer).data) == 20 * len(segmented.cloud)
    assert labeled.foreground_points(types, answer).width == np.count_nonzero(seg.labels)
    assert tables.regions(types, answer).width == len(seg.regions)
    assert tables.barcode(types, answer).width == len(seg.barcode)
    assert tables.region_count(types, answer).data == len(seg.regions)
    assert len(markers.region_markers(types, answer).markers) == 2 + 2 * len(seg.regions)
    assert len(label_image.label_image(types, answer).data) == 2 * len(segmented.cloud)
