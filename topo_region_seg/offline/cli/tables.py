# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables for the terminal: regions of a cloud, times of a replay, changes between two runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text

from topo_region_seg.offline.cli.regions import HEADS, RegionRow

if TYPE_CHECKING:
    from topo_region_seg.offline.frames import FrameResult
    from topo_region_seg.offline.runs.comparison import FrameChange


def region_table(rows: Sequence[RegionRow]) -> Table:
    """Return the rows as a table: label, mean color, size, center, extents and persistence."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("label", justify="right")
    colored = any(row.mean is not None for row in rows)
    if colored:
        table.add_column("mean color")
    for name in HEADS:
        table.add_column(name, justify="right")
    for row in rows:
        cells: list[str | Text] = [Text.assemble(("■ ", f"rgb{_rgb(row.color)}"), row.label)]
        if row.mean is not None:
            cells.append(Text.assemble(("██ ", f"rgb{_rgb(row.mean)}"), "#{:02x}{:02x}{:02x}".format(*row.mean)))
        table.add_row(*cells, *row.cells)
    return table


def timing_table(frames: Sequence[FrameResult]) -> Table:
    """Return milliseconds per stage over all frames: mean, median, 95th percentile and the slowest, and CPU time."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("stage")
    for name in ("mean ms", "median", "95 %", "max", "median CPU ms"):
        table.add_column(name, justify="right")
    for stage in frames[0].ms:
        values = np.array([frame.ms.get(stage, 0.0) for frame in frames])
        cpu = np.median([frame.cpu_ms.get(stage, 0.0) for frame in frames])
        figures = (values.mean(), np.median(values), np.percentile(values, 95), values.max(), cpu)
        table.add_row(stage, *(f"{value:.1f}" for value in figures), style="bold" if stage == "total" else "")
    return table


def change_table(frames: Sequence[FrameChange]) -> Table:
    """Return a row per frame of what changed from run A to run B; CPU time is in milliseconds, as time is."""
    measured = any(a or b for a, b in (frame.quality for frame in frames))
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    known = any(frame.cpu_ms for frame in frames)
    for name in ("stamp (s)", "reg. A", "B", "changed", "WOv", "ARI", "CPU A" if known else "ms A", "B"):
        table.add_column(name, justify="right")
    for name in ("true WOv A", "B", "true overl. F A", "B") if measured else ():
        table.add_column(name, justify="right")
    for frame in frames:
        cells = [f"{frame.stamp:.3f}", *map(str, frame.regions)]
        cells.append("other points" if frame.changed is None else f"{100 * frame.changed:.1f} %")
        cells += [_or_dash(value, 3) for value in (frame.wov, frame.ari)]
        spent = frame.cpu_ms if known else frame.ms
        cells += [_or_dash(value, 1) for value in spent.get("total", (None, None))]
        if measured:
            cells += [_or_dash(q.get(name) if q else None, 3) for name in ("wov", "overlap_f") for q in frame.quality]
        table.add_row(*cells)
    return table


def _or_dash(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def _rgb(color: tuple[int, int, int]) -> str:
    red, green, blue = color
    return f"({red},{green},{blue})"
