# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables for the terminal: regions of a cloud, summary of a replay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from rich import box
from rich.table import Table
from rich.text import Text

from topo_region_seg.cloud.label_colors import colors
from topo_region_seg.data import Cloud
from topo_region_seg.offline.runs.comparison import FrameChange
from topo_region_seg.segmentation import Segmentation


def stage_line(points: int, seg: Segmentation) -> str:
    """Say in one line what a segmentation did."""
    count = len(seg.regions)
    taken = len(seg.index)
    total = sum(seg.ms.values())
    floor = ", support plane removed" if seg.plane is not None else ""
    return (
        f"{points:,} points, {taken:,} after preprocessing{floor}; "
        f"{count} region{'' if count == 1 else 's'} in {total:.0f} ms"
    )


def region_table(cloud: Cloud, seg: Segmentation) -> Table:
    """Return one row per region: label, mean color, size, center, extents and persistence."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("label", justify="right")
    if cloud.rgb is not None:
        table.add_column("mean color")
    for name in ("points", "center x, y, z (m)", "extents x, y, z (cm)", "persistence (mm)"):
        table.add_column(name, justify="right")
    means = None if cloud.rgb is None else _mean_colors(cloud.rgb, seg)
    marks = colors(seg.regions.label)
    for row in range(len(seg.regions)):
        region = seg.regions[row]
        cells: list[str | Text] = [Text.assemble(("■ ", f"rgb{_rgb(marks[row])}"), str(region.label))]
        if means is not None:
            mean = means[region.label]
            cells.append(Text.assemble(("██ ", f"rgb{_rgb(mean)}"), "#{:02x}{:02x}{:02x}".format(*mean.tolist())))
        size = (high - low for low, high in zip(region.minimum, region.maximum, strict=True))
        cells += [
            f"{region.size:,}",
            " ".join(f"{value:7.3f}" for value in region.centroid),
            " ".join(f"{100 * value:5.1f}" for value in size),
            f"{1000 * region.persistence:.1f}",
        ]
        table.add_row(*cells)
    return table


def timing_table(frames: Sequence[Mapping[str, float]]) -> Table:
    """Return milliseconds per stage over all frames: mean, median, 95th percentile and the slowest."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("stage")
    for name in ("mean ms", "median", "95 %", "max"):
        table.add_column(name, justify="right")
    for stage in frames[0]:
        values = np.array([frame.get(stage, 0.0) for frame in frames])
        figures = (values.mean(), np.median(values), np.percentile(values, 95), values.max())
        table.add_row(stage, *(f"{value:.1f}" for value in figures), style="bold" if stage == "total" else "")
    return table


def change_table(frames: Sequence[FrameChange]) -> Table:
    """Return a row per frame of what changed from run A to run B."""
    measured = any(a or b for a, b in (frame.quality for frame in frames))
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in ("stamp (s)", "regions A", "B", "changed", "WOv", "ARI", "ms A", "B"):
        table.add_column(name, justify="right")
    for name in ("true WOv A", "B") if measured else ():
        table.add_column(name, justify="right")
    for frame in frames:
        cells = [f"{frame.stamp:.3f}", *map(str, frame.regions)]
        cells.append("other points" if frame.changed is None else f"{100 * frame.changed:.1f} %")
        cells += [_or_dash(value, 3) for value in (frame.wov, frame.ari)]
        cells += [_or_dash(value, 1) for value in frame.ms.get("total", (None, None))]
        if measured:
            cells += [_or_dash(quality["wov"] if quality else None, 3) for quality in frame.quality]
        table.add_row(*cells)
    return table


def _or_dash(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def _mean_colors(rgb: npt.NDArray[np.uint8], seg: Segmentation) -> npt.NDArray[np.uint8]:
    """Return the mean color of the points of every label, row 0 included, shape (M + 1, 3)."""
    count = np.maximum(np.bincount(seg.labels, minlength=len(seg.regions) + 1), 1)
    sums = [np.bincount(seg.labels, weights=rgb[:, channel], minlength=len(count)) for channel in range(3)]
    return np.round(np.stack(sums, axis=1) / count[:, None]).astype(np.uint8)


def _rgb(color: npt.NDArray[np.uint8]) -> str:
    red, green, blue = color.tolist()
    return f"({red},{green},{blue})"
