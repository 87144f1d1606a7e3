# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables as clouds, a row per region or bar, and the number of regions."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.types import MessageTypes
from topo_region_seg.cloud.pointcloud2 import encode


def region_count(types: MessageTypes, answer: Answer) -> Any:
    """Return the number of regions."""
    return types.UInt32(data=len(answer.seg.regions))


def regions(types: MessageTypes, answer: Answer) -> Any:
    """Return one row per region: place, label, size, box, mean CIELAB color, mean normal, persistence, confidence."""
    table = answer.seg.regions
    columns: dict[str, npt.NDArray[Any]] = _named(("x", "y", "z"), table.centroid)
    columns["label"] = table.label
    columns["size"] = table.size.astype(np.uint32)
    columns |= _named(("min_x", "min_y", "min_z"), table.minimum)
    columns |= _named(("extent_x", "extent_y", "extent_z"), table.maximum - table.minimum)
    columns |= _named(("L", "a", "b"), table.mean_lab)
    columns |= _named(("normal_x", "normal_y", "normal_z"), table.mean_normal)
    columns["persistence"] = table.persistence.astype(np.float32)
    columns["confidence"] = table.confidence.astype(np.float32)
    return encode(types, answer.header, columns, is_dense=_all_finite(columns))


def barcode(types: MessageTypes, answer: Answer) -> Any:
    """Return one row per H0 bar: position of its representative, birth, death (inf for regions), label."""
    bars = answer.seg.barcode
    columns: dict[str, npt.NDArray[Any]] = _named(("x", "y", "z"), bars.xyz)
    columns["birth"] = bars.birth.astype(np.float32)
    columns["death"] = bars.death.astype(np.float32)
    columns["label"] = bars.label.astype(np.uint32)
    return encode(types, answer.header, columns, is_dense=_all_finite(columns))


def _named(names: tuple[str, ...], rows: npt.NDArray[Any]) -> dict[str, npt.NDArray[Any]]:
    """Split (M, 3) values into float32 columns."""
    return {name: rows[:, axis].astype(np.float32) for axis, name in enumerate(names)}


def _all_finite(columns: dict[str, npt.NDArray[Any]]) -> bool:
    return all(bool(np.isfinite(column).all()) for column in columns.values())
