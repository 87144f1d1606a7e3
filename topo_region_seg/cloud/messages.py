# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Segmentation -> messages: one code for what the node publishes and what a replay records."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.label_colors import colors
from topo_region_seg.cloud.pointcloud2 import byte_buffer, cloud_message, encode
from topo_region_seg.cloud.records import write_labeled_records
from topo_region_seg.data import Cloud, Region
from topo_region_seg.segmentation import Segmentation

LABELED = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<f4"), ("label", "<u4")])
"""A record of `labeled_points`."""
BOX_ALPHA = 0.35
TEXT_HEIGHT = 0.03
"""Height of the letters of a region marker, metres."""


@dataclass(frozen=True)
class MessageTypes:
    """The message classes of one ROS library; all of them take their fields as keyword arguments."""

    PointCloud2: Any
    PointField: Any
    UInt32: Any
    Header: Any
    Time: Any
    Duration: Any
    Marker: Any
    MarkerArray: Any
    Point: Any
    Vector3: Any
    Quaternion: Any
    Pose: Any
    ColorRGBA: Any
    CompressedImage: Any
    MeshFile: Any


def labeled_points(types: MessageTypes, msg: Any, cloud: Cloud, seg: Segmentation) -> Any:
    """Return the cloud of `msg` with x, y, z, rgb and `label`; header, height, width and order are those of `msg`."""
    return _labeled(types, msg, cloud, seg, cloud.rgb)


def region_colors(types: MessageTypes, msg: Any, cloud: Cloud, seg: Segmentation) -> Any:
    """Return :func:`labeled_points` with the color of each label for rgb: that of the region's box, dark gray for 0.

    RViz has no palette for labels: its rainbow gives 0 the bright color of a region, and neighbors nearly the same.
    """
    return _labeled(types, msg, cloud, seg, colors(seg.labels))


def _labeled(types: MessageTypes, msg: Any, cloud: Cloud, seg: Segmentation, rgb: npt.NDArray[np.uint8] | None) -> Any:
    buffer = byte_buffer(types.PointCloud2, len(cloud) * LABELED.itemsize)
    records = np.frombuffer(buffer, np.float32).reshape(len(cloud), LABELED.itemsize // 4)
    finite = write_labeled_records(
        np.ascontiguousarray(cloud.xyz, np.float32),
        np.empty((0, 3), np.uint8) if rgb is None else np.ascontiguousarray(rgb),
        np.ascontiguousarray(seg.labels, np.uint32),
        records,
        records.view(np.uint32),
    )
    return cloud_message(types, msg.header, LABELED, buffer, cloud.height, cloud.width, finite)


def region_count(types: MessageTypes, seg: Segmentation) -> Any:
    """Return the number of regions."""
    return types.UInt32(data=len(seg.regions))


def regions(types: MessageTypes, header: Any, seg: Segmentation) -> Any:
    """Return one row per region: place, label, size, box, mean CIELAB color, mean normal, persistence, confidence."""
    table = seg.regions
    columns: dict[str, npt.NDArray[Any]] = _named(("x", "y", "z"), table.centroid)
    columns["label"] = table.label
    columns["size"] = table.size.astype(np.uint32)
    columns |= _named(("min_x", "min_y", "min_z"), table.minimum)
    columns |= _named(("extent_x", "extent_y", "extent_z"), table.maximum - table.minimum)
    columns |= _named(("L", "a", "b"), table.mean_lab)
    columns |= _named(("normal_x", "normal_y", "normal_z"), table.mean_normal)
    columns["persistence"] = table.persistence.astype(np.float32)
    columns["confidence"] = table.confidence.astype(np.float32)
    return encode(types, header, columns, is_dense=_all_finite(columns))


def barcode(types: MessageTypes, header: Any, seg: Segmentation) -> Any:
    """Return one row per H0 bar: position of its representative, birth, death (inf for regions), label."""
    bars = seg.barcode
    columns: dict[str, npt.NDArray[Any]] = _named(("x", "y", "z"), bars.xyz)
    columns["birth"] = bars.birth.astype(np.float32)
    columns["death"] = bars.death.astype(np.float32)
    columns["label"] = bars.label.astype(np.uint32)
    return encode(types, header, columns, is_dense=_all_finite(columns))


def region_markers(types: MessageTypes, header: Any, seg: Segmentation) -> Any:
    """Return a translucent box and a text (label and points) per region, and a text with their number.

    The first marker deletes those of the frame before.
    """
    markers = [_marker(types, header, "", 0, types.Marker.ARROW, types.Marker.DELETEALL)]
    hues = colors(seg.regions.label) / 255.0
    for region, hue in zip((seg.regions[i] for i in range(len(seg.regions))), hues, strict=True):
        markers.append(_box(types, header, region, hue))
        text = f"{region.label} ({region.size})"
        markers.append(_text(types, header, "labels", region.label, np.array(region.centroid), text))
    if len(seg.regions):
        markers.append(_count(types, header, seg))
    return types.MarkerArray(markers=markers)


def _named(names: tuple[str, ...], rows: npt.NDArray[Any]) -> dict[str, npt.NDArray[Any]]:
    """Split (M, 3) values into float32 columns."""
    return {name: rows[:, axis].astype(np.float32) for axis, name in enumerate(names)}


def _all_finite(columns: dict[str, npt.NDArray[Any]]) -> bool:
    return all(bool(np.isfinite(column).all()) for column in columns.values())


def _box(types: MessageTypes, header: Any, region: Region, hue: npt.NDArray[np.float64]) -> Any:
    low, high = np.array(region.minimum), np.array(region.maximum)
    color = types.ColorRGBA(r=float(hue[0]), g=float(hue[1]), b=float(hue[2]), a=BOX_ALPHA)
    # RViz refuses a box without volume; a plane facing the sensor squarely has none.
    size = np.maximum(high - low, 0.001)
    return _marker(
        types, header, "boxes", region.label, types.Marker.CUBE, center=(low + high) / 2, size=size, color=color
    )


def _count(types: MessageTypes, header: Any, seg: Segmentation) -> Any:
    """Place the number of regions at the upper edge of all of them, where up is -y as in an optical frame."""
    low, high = seg.regions.minimum.min(axis=0), seg.regions.maximum.max(axis=0)
    center = np.array([(low[0] + high[0]) / 2, low[1] - 2 * TEXT_HEIGHT, (low[2] + high[2]) / 2])
    return _text(types, header, "count", 0, center, f"{len(seg.regions)} regions")


def _text(
    types: MessageTypes, header: Any, namespace: str, number: int, center: npt.NDArray[np.float64], text: str
) -> Any:
    return _marker(
        types,
        header,
        namespace,
        number,
        types.Marker.TEXT_VIEW_FACING,
        center=center,
        size=np.array([0.0, 0.0, TEXT_HEIGHT]),
        color=types.ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0),
        text=text,
    )


def _marker(
    types: MessageTypes,
    header: Any,
    namespace: str,
    number: int,
    kind: int,
    action: int = 0,
    *,
    center: npt.NDArray[np.float64] | None = None,
    size: npt.NDArray[np.float64] | None = None,
    color: Any = None,
    text: str = "",
) -> Any:
    """Make a marker with every field given, as rosbags' classes have no defaults."""
    x, y, z = (0.0, 0.0, 0.0) if center is None else center.tolist()
    sx, sy, sz = (1.0, 1.0, 1.0) if size is None else size.tolist()
    return types.Marker(
        header=header,
        ns=namespace,
        id=number,
        type=kind,
        action=action,
        pose=types.Pose(position=types.Point(x=x, y=y, z=z), orientation=types.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)),
        scale=types.Vector3(x=sx, y=sy, z=sz),
        color=color or types.ColorRGBA(r=0.0, g=0.0, b=0.0, a=0.0),
        lifetime=types.Duration(sec=0, nanosec=0),
        frame_locked=False,
        points=[],
        colors=[],
        texture_resource="",
        texture=types.CompressedImage(header=header, format="", data=byte_buffer(types.CompressedImage, 0)),
        uv_coordinates=[],
        text=text,
        mesh_resource="",
        mesh_file=types.MeshFile(filename="", data=byte_buffer(types.MeshFile, 0)),
        mesh_use_embedded_materials=False,
    )
