# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The regions of a cloud as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.label_colors import colors
from topo_region_seg.data import Cloud
from topo_region_seg.segmentation import Segmentation

HEADS = ("points", "center x, y, z (m)", "extents x, y, z (cm)", "persistence (mm)")


@dataclass(frozen=True)
class RegionRow:
    """What is shown of a region: its label and figures as text, and two colors (r, g, b).

    Parameters
    ----------
    label : str
        The label.
    cells : tuple of str
        One text for each of HEADS.
    color : tuple of int
        The color of its label.
    mean : tuple of int or None
        The mean color of its points, None for a cloud without color.
    """

    label: str
    cells: tuple[str, ...]
    color: tuple[int, int, int]
    mean: tuple[int, int, int] | None


def region_rows(cloud: Cloud, seg: Segmentation, most: int | None = None) -> list[RegionRow]:
    """Return a row for each of the `most` largest regions, or for all."""
    means = None if cloud.rgb is None else _mean_colors(cloud.rgb, seg)
    marks = colors(seg.regions.label)
    rows = []
    for row in range(len(seg.regions))[:most]:
        region = seg.regions[row]
        extents = (high - low for low, high in zip(region.minimum, region.maximum, strict=True))
        cells = (
            f"{region.size:,}",
            " ".join(f"{value:7.3f}" for value in region.centroid),
            " ".join(f"{100 * value:5.1f}" for value in extents),
            "-" if math.isnan(region.persistence) else f"{1000 * region.persistence:.1f}",
        )
        mean = None if means is None else _channels(means[region.label])
        rows.append(RegionRow(str(region.label), cells, _channels(marks[row]), mean))
    return rows


def plain_lines(rows: Sequence[RegionRow]) -> list[str]:
    """Return the rows as aligned lines, with a head."""
    table = [("label", *HEADS), *((row.label, *row.cells) for row in rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return ["  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)) for line in table]


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


def _mean_colors(rgb: npt.NDArray[np.uint8], seg: Segmentation) -> npt.NDArray[np.uint8]:
    """Return the mean color of the points of every label, row 0 included, shape (M + 1, 3)."""
    count = np.maximum(np.bincount(seg.labels, minlength=len(seg.regions) + 1), 1)
    sums = [np.bincount(seg.labels, weights=rgb[:, channel], minlength=len(count)) for channel in range(3)]
    return np.round(np.stack(sums, axis=1) / count[:, None]).astype(np.uint8)


def _channels(color: npt.NDArray[np.uint8]) -> tuple[int, int, int]:
    red, green, blue = color.tolist()
    return red, green, blue
