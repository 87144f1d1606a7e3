# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Positions, rotations and sizes as geometry_msgs."""

from __future__ import annotations

from typing import Any

from topo_region_seg.cloud.messages.types import MessageTypes
from topo_region_seg.data import FloatArray


def pose(types: MessageTypes, center: FloatArray, turn: FloatArray) -> Any:
    """Return a pose from a position (3,), metres, and a unit quaternion x, y, z, w (4,)."""
    x, y, z = center.tolist()
    a, b, c, w = turn.tolist()
    return types.Pose(position=types.Point(x=x, y=y, z=z), orientation=types.Quaternion(x=a, y=b, z=c, w=w))


def vector(types: MessageTypes, values: FloatArray) -> Any:
    """Return three numbers as a vector."""
    x, y, z = values.tolist()
    return types.Vector3(x=x, y=y, z=z)
