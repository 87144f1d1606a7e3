# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One scene as each camera and lidar driver would publish it: fields, steps, organization and invalid points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from clouds import FLOAT32, FLOAT64, UINT8, UINT16, UINT32, XYZ, Driver, message

from topo_region_seg.data import Cloud

Floats = npt.NDArray[np.float32]
Fill = Callable[[Floats], None]
"""Writes a driver's invalid points into the rows that have no depth."""


def nan(rows: Floats) -> None:
    rows[:] = np.nan


def zero(rows: Floats) -> None:
    rows[:] = 0.0


def infinite(rows: Floats) -> None:
    rows[:] = np.inf
    rows[::2] = -np.inf


def nan_or_infinite(rows: Floats) -> None:
    rows[:] = np.nan
    rows[::3] = np.inf
    rows[1::3, 2] = -np.inf


@dataclass(frozen=True)
class Row:
    """A driver: layout of a point, and what it does with pixels that have no depth (`fill` None: left out)."""

    name: str
    layout: Driver
    fill: Fill | None
    is_dense: bool = False
    alpha: int = 0
    forward: bool = False
    """Whether x points forward (not an optical frame)."""


RGB16 = [*XYZ, ("rgb", 16, FLOAT32)]
ROWS = [
    Row("realsense-ros, default", Driver(RGB16, 20), None, is_dense=True),
    Row("realsense-ros, ordered_pc", Driver(RGB16, 20), zero),
    Row("realsense-ros, no texture", Driver(XYZ, 16, color=False), None, is_dense=True),
    Row("OrbbecSDK_ROS2, default", Driver(RGB16, 20), None, is_dense=True),
    Row("OrbbecSDK_ROS2, ordered", Driver(RGB16, 20), zero),
    Row("Azure Kinect", Driver(RGB16, 32), nan),
    Row("depth_image_proc", Driver(RGB16, 32), nan, alpha=255),
    Row("ZED", Driver([*XYZ, ("rgb", 12, FLOAT32)], 16), nan_or_infinite, alpha=255, forward=True),
    Row("Zivid", Driver([*XYZ, ("rgba", 12, UINT32)], 16), nan, alpha=255),
    Row("Gazebo Classic", Driver(RGB16, 32), infinite),
    Row("gz-sim Harmonic, infinite", Driver(RGB16, 24), infinite),
    Row("gz-sim Harmonic, dense by mistake", Driver(RGB16, 24), nan_or_infinite, is_dense=True),
    Row(
        "Velodyne",
        Driver([*XYZ, ("intensity", 12, FLOAT32), ("ring", 16, UINT16), ("time", 18, FLOAT32)], 22, color=False),
        zero,
        is_dense=True,
        forward=True,
    ),
    Row(
        "Livox",
        Driver(
            [
                *XYZ,
                ("intensity", 12, FLOAT32),
                ("tag", 16, UINT8),
                ("line", 17, UINT8),
                ("timestamp", 18, FLOAT64),
            ],
            26,
            color=False,
        ),
        None,
        is_dense=True,
        forward=True,
    ),
]


def valid(cloud: Cloud) -> npt.NDArray[np.bool_]:
    """Return which points of a simulated cloud have depth."""
    found: npt.NDArray[np.bool_] = np.isfinite(cloud.xyz).all(axis=1)
    return found


def published(row: Row, cloud: Cloud) -> Any:
    """Return what the driver `row` makes of an organized cloud whose points without depth are NaN."""
    seen = valid(cloud)
    xyz = cloud.xyz.copy()
    if row.forward:
        xyz = np.column_stack([xyz[:, 2], -xyz[:, 0], -xyz[:, 1]])
    rgb, height = cloud.rgb, cloud.height
    if row.fill is None:
        xyz, rgb, height = xyz[seen], None if rgb is None else rgb[seen], 1
    else:
        lost = xyz[~seen]
        row.fill(lost)
        xyz[~seen] = lost
    msg = message(xyz, rgb if row.layout.color else None, driver=row.layout, height=height, alpha=row.alpha)
    msg.is_dense = row.is_dense
    return msg


def back(row: Row, cloud: Cloud, labels: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the labels at the points with depth, in the order of the organized cloud."""
    return labels if row.fill is None else labels[valid(cloud)]
