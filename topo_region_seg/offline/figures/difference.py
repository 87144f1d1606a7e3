# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Two segmentations of the same clouds side by side, and where they differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from topo_region_seg.data import BoolArray, Cloud, IntArray, LabelArray
from topo_region_seg.offline.figures.projection import picture_of
from topo_region_seg.offline.figures.shading import own_colors, region_colors

_PANEL = 4.6  # inches
_TITLE = 0.34
_BACKDROP = 22
_CHANGED = (255, 214, 0)  # so bright that it stands out from the dim gray without its hue
_SMALLEST = 0.002  # share of the picture below which a region gets no number


@dataclass(frozen=True)
class DifferenceRow:
    """One row of the picture: a cloud, its labels in both runs, the points that changed, and three titles."""

    cloud: Cloud
    a: LabelArray
    b: LabelArray
    changed: BoolArray
    titles: tuple[str, str, str]


def plot_differences(rows: Sequence[DifferenceRow], path: str | Path) -> None:
    """Draw one row per cloud: the regions of A, those of B, and the points that changed.

    Regions of B have the colors of their counterparts in A, if any.

    Parameters
    ----------
    rows : sequence of DifferenceRow
        At least one.
    path : str or Path
        The file to write; its ending gives the format (.png, .pdf, .svg).
    """
    views = [picture_of(row.cloud) for row in rows]
    heights = [_PANEL * view.shape[0] / view.shape[1] + _TITLE for view in views]
    figure = Figure(figsize=(3 * _PANEL, sum(heights)), dpi=100, facecolor="white")
    grid = figure.subplots(len(rows), 3, squeeze=False, gridspec_kw={"height_ratios": heights})
    figure.subplots_adjust(
        left=0.003, right=0.997, bottom=0.004, top=1 - _TITLE / sum(heights), wspace=0.01, hspace=0.09
    )
    for axes, row, view in zip(grid, rows, views, strict=True):
        own = own_colors(row.cloud)
        dim = region_colors(own, np.zeros(len(row.cloud), np.uint32))
        difference = np.where(row.changed[:, None], np.array(_CHANGED, np.uint8), dim)
        alike = _like(row.a, row.b, row.changed)
        panels = ((region_colors(own, row.a), row.a), (region_colors(own, alike), row.b), (difference, None))
        for ax, (colors, labels), title in zip(axes, panels, row.titles, strict=True):
            _panel(ax, colors, labels, view, title)
    figure.savefig(path)


def _like(a: LabelArray, b: LabelArray, changed: BoolArray) -> LabelArray:
    """Return the label that gives the color of every point: that of the counterpart in A, else one above those of A."""
    highest = np.uint32(np.max(a, initial=0))
    alike: LabelArray = np.where(b > 0, b + highest, np.uint32(0)).astype(np.uint32)
    kept = ~changed & (b > 0)
    label, first = np.unique(b[kept], return_index=True)
    for number, color in zip(label, a[kept][first], strict=True):
        alike[b == number] = color
    return alike


def _panel(ax: Axes, colors: npt.NDArray[np.uint8], labels: LabelArray | None, view: IntArray, title: str) -> None:
    shown = np.concatenate([colors, np.full((1, 3), _BACKDROP, np.uint8)])[view]
    if labels is not None:
        grid = np.append(labels, np.uint32(0))[view]
        shown[:, :-1][grid[:, :-1] != grid[:, 1:]] = 0
        shown[:-1][grid[:-1] != grid[1:]] = 0
        number, count = np.unique(grid[grid > 0], return_counts=True)
        for label in number[count > _SMALLEST * grid.size]:
            v, u = np.nonzero(grid == label)
            middle = np.argmin((u - u.mean()) ** 2 + (v - v.mean()) ** 2)
            ax.text(
                u[middle],
                v[middle],
                str(label),
                color="white",
                fontsize=9,
                ha="center",
                va="center",
                bbox={"boxstyle": "round,pad=0.1", "facecolor": "black", "alpha": 0.75, "linewidth": 0},
            )
    ax.imshow(shown, interpolation="nearest", aspect="equal")
    ax.set_title(title, fontsize=10, pad=4)
    ax.set_axis_off()
