# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The labels of a recorded cloud: true ones, or those of an earlier segmentation."""

from __future__ import annotations

from typing import Any

import numpy as np

from topo_region_seg.cloud.layout import CloudFormatError, check_field
from topo_region_seg.data import LabelArray

LABEL = "label"
_INTEGERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4"}
"""NumPy type of each PointField datatype that holds integers."""


def has_labels(msg: Any) -> bool:
    """Whether a sensor_msgs/PointCloud2 has a field `label`."""
    return any(f.name == LABEL for f in msg.fields)


def labels_of(msg: Any, *, max_points: int) -> LabelArray:
    """Return the field `label` of every point, (N,) uint32; negative labels become 0, which is "none".

    Parameters
    ----------
    msg : sensor_msgs/PointCloud2
        A message of rosbags; it needs no other field, not even coordinates.
    max_points : int
        Clouds with more points are refused.

    Raises
    ------
    CloudFormatError
        There is no such field, it holds no integers, or the message contradicts itself.
    """
    data = np.ascontiguousarray(msg.data).reshape(-1).view(np.uint8)
    field, row_step = check_field(msg, data.nbytes, LABEL, max_points=max_points, warn=_ignore)
    if int(field.datatype) not in _INTEGERS:
        raise CloudFormatError("label_type", f"field 'label' has datatype {field.datatype}; labels are integers")
    kind = np.dtype(_INTEGERS[int(field.datatype)]).newbyteorder(">" if msg.is_bigendian else "<")
    height, width = int(msg.height), int(msg.width)
    if not height * width:
        return np.zeros(0, np.uint32)
    column = np.ndarray((height, width), kind, data, int(field.offset), (row_step, int(msg.point_step)))
    labels: LabelArray = np.maximum(column, 0).astype(np.uint32).reshape(-1)
    return labels


def _ignore(code: str, text: str) -> None:
    """Ignore warnings: reading the coordinates gives the same ones."""
