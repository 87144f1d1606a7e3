# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Boxes and texts for RViz."""

from __future__ import annotations

from typing import Any

import numpy as np

from topo_region_seg.cloud.label_colors import colors
from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.poses import pose, vector
from topo_region_seg.cloud.messages.types import MessageTypes
from topo_region_seg.cloud.pointcloud2 import byte_buffer
from topo_region_seg.data import FloatArray

BOX_ALPHA = 0.35
TEXT_HEIGHT = 0.03
"""Height of the letters of a region marker, metres."""
THINNEST = 0.001
"""Least size of a box, metres: RViz refuses one without volume, which a plane has that faces the sensor squarely."""
UNTURNED = np.array([0.0, 0.0, 0.0, 1.0])


def region_markers(types: MessageTypes, answer: Answer) -> Any:
    """Return a translucent oriented box and a text (label and points) per region, and a text with their number.

    The first marker deletes those of the frame before.
    """
    header, table, boxes = answer.header, answer.seg.regions, answer.boxes
    markers = [_marker(types, header, "", 0, types.Marker.ARROW, types.Marker.DELETEALL)]
    hues = colors(table.label) / 255.0
    given = zip(boxes.label.tolist(), boxes.center, boxes.quaternion, boxes.size, hues, strict=True)
    for row, (label, center, turn, size, hue) in enumerate(given):
        red, green, blue = hue.tolist()
        color = types.ColorRGBA(r=red, g=green, b=blue, a=BOX_ALPHA)
        size = np.maximum(size, THINNEST)
        box = {"center": center, "turn": turn, "size": size, "color": color}
        markers.append(_marker(types, header, "boxes", label, types.Marker.CUBE, **box))
        text = f"{label} ({table.size[row]})"
        markers.append(_text(types, header, "labels", label, table.centroid[row], text))
    if len(table):
        # At the upper edge of all of them, where up is -y as in an optical frame.
        low, high = table.minimum.min(axis=0), table.maximum.max(axis=0)
        center = np.array([(low[0] + high[0]) / 2, low[1] - 2 * TEXT_HEIGHT, (low[2] + high[2]) / 2])
        markers.append(_text(types, header, "count", 0, center, f"{len(table)} regions"))
    return types.MarkerArray(markers=markers)


def _text(types: MessageTypes, header: Any, namespace: str, number: int, center: FloatArray, text: str) -> Any:
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
    center: FloatArray | None = None,
    turn: FloatArray = UNTURNED,
    size: FloatArray | None = None,
    color: Any = None,
    text: str = "",
) -> Any:
    """Make a marker with every field given, as rosbags' classes have no defaults."""
    return types.Marker(
        header=header,
        ns=namespace,
        id=number,
        type=kind,
        action=action,
        pose=pose(types, np.zeros(3) if center is None else center, turn),
        scale=vector(types, np.ones(3) if size is None else size),
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
