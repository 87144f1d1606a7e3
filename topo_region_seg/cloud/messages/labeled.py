# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Clouds of points with their labels: all of them, or those of regions alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.label_colors import colors
from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.types import MessageTypes
from topo_region_seg.cloud.pointcloud2 import CloudFormatError, byte_buffer, cloud_message, field_of
from topo_region_seg.cloud.records import write_labeled_records
from topo_region_seg.data import LabelArray

LABELED = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<f4"), ("label", "<u4")])
"""A record of `labeled_points`."""


def labeled_points(types: MessageTypes, answer: Answer) -> Any:
    """Return the cloud with x, y, z, rgb and `label`; header, height, width and order are those of the input."""
    return _whole(types, answer, answer.cloud.rgb, _passed(answer))


def region_colors(types: MessageTypes, answer: Answer) -> Any:
    """Return :func:`labeled_points` with the color of each label for rgb: that of the region's box, dark gray for 0.

    RViz has no palette for labels: its rainbow gives 0 the bright color of a region, and neighbors nearly the same.
    """
    return _whole(types, answer, colors(answer.seg.labels), {})


def foreground_points(types: MessageTypes, answer: Answer) -> Any:
    """Return :func:`labeled_points` of the points with a label alone: a list without an image grid, all of it valid."""
    cloud, rows = answer.cloud, np.flatnonzero(answer.seg.labels)
    rgb = None if cloud.rgb is None else cloud.rgb[rows]
    more = {name: column[rows] for name, column in _passed(answer).items()}
    buffer, record, _ = _records(types, cloud.xyz[rows], rgb, answer.seg.labels[rows], more)
    return cloud_message(types, answer.header, record, buffer, 1, len(rows), True)


def _whole(
    types: MessageTypes, answer: Answer, rgb: npt.NDArray[np.uint8] | None, more: Mapping[str, npt.NDArray[Any]]
) -> Any:
    cloud = answer.cloud
    buffer, record, finite = _records(types, cloud.xyz, rgb, answer.seg.labels, more)
    return cloud_message(types, answer.header, record, buffer, cloud.height, cloud.width, finite)


def _records(
    types: MessageTypes,
    xyz: npt.NDArray[np.floating],
    rgb: npt.NDArray[np.uint8] | None,
    labels: LabelArray,
    more: Mapping[str, npt.NDArray[Any]],
) -> tuple[Any, np.dtype[Any], bool]:
    """Return records in a buffer, their layout, and whether all coordinates are finite; `more` fields come last."""
    buffer = byte_buffer(types.PointCloud2, len(xyz) * LABELED.itemsize)
    words = np.frombuffer(buffer, np.float32).reshape(len(xyz), LABELED.itemsize // 4)
    finite = write_labeled_records(
        np.ascontiguousarray(xyz, np.float32),
        np.empty((0, 3), np.uint8) if rgb is None else np.ascontiguousarray(rgb),
        np.ascontiguousarray(labels, np.uint32),
        words,
        words.view(np.uint32),
    )
    if not more:
        return buffer, LABELED, finite
    columns = {name: words.view(LABELED)[name][:, 0] for name in LABELED.names or ()} | dict(more)
    record = np.dtype([(name, column.dtype, column.shape[1:]) for name, column in columns.items()])
    buffer = byte_buffer(types.PointCloud2, len(xyz) * record.itemsize)
    table = np.frombuffer(buffer, record)
    for name, column in columns.items():
        table[name] = column
    return buffer, record, finite


def _passed(answer: Answer) -> dict[str, npt.NDArray[Any]]:
    """Return the fields of the input that are to be carried on, (N,) or (N, count); what is missing is said."""
    columns = {}
    for name in answer.pass_fields:
        if name in (LABELED.names or ()):
            continue
        try:
            columns[name] = field_of(answer.msg, name)
        except CloudFormatError as error:
            have = ", ".join(str(field.name) for field in getattr(answer.msg, "fields", ())[:16]) or "none"
            text = f"pass_fields: '{name}' cannot be passed on: {error.detail}; the clouds have the fields {have}"
            answer.warn(f"pass_fields_{name}", text)
    return columns
