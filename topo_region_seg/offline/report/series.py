# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The series of the charts: one value per frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from topo_region_seg.offline.report.content import FrameContent, stages

QUALITY = {"wov": "WOv", "fos": "Fos", "fus": "Fus"}
"""The measures in the chart, with their names."""


def charts(frames: Sequence[FrameContent]) -> dict[str, dict[str, Any]]:
    """Return the charts by name: `kind`, and `series` of a name and a value (or None) for each frame."""
    if not frames:
        return {}
    regions = [frame.record.regions for frame in frames]
    drawn: dict[str, dict[str, Any]] = {"regions": {"kind": "bars", "series": [_series("regions", regions)]}}
    names = stages(frames)
    if names:
        times = [_series(name, [_rounded(frame.record.ms.get(name), 1) for frame in frames]) for name in names]
        drawn["time"] = {"kind": "stack", "series": times}
    measured = {
        name: [_rounded((frame.quality or {}).get(key), 3) for frame in frames] for key, name in QUALITY.items()
    }
    if any(value is not None for values in measured.values() for value in values):
        lines = [_series(name, values) for name, values in measured.items()]
        drawn["quality"] = {"kind": "lines", "least": 1, "series": lines}
    return drawn


def _series(name: str, values: Sequence[float | None]) -> dict[str, Any]:
    return {"name": name, "values": list(values)}


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)
