# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The cloud before and after segmentation, like the paper's Fig. 4."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from topo_region_seg.data import Cloud
from topo_region_seg.offline.figures.projection import picture_of, valid_points
from topo_region_seg.offline.figures.shading import own_colors, region_colors
from topo_region_seg.segmentation import Segmentation

_PANEL = (6.4, 6.4)  # largest width and height of each panel, inches
_HEAD = 0.38  # inches for the titles
_BACKDROP = 22  # gray level of pixels without a point


def plot_before_after(cloud: Cloud, seg: Segmentation, path: str | Path) -> None:
    """Draw the cloud in its own colors beside its regions in random colors.

    Points without a region are dim gray, pixels without a point nearly black.

    Parameters
    ----------
    cloud : Cloud
        The segmented cloud.
    seg : Segmentation
        The result.
    path : str or Path
        The file to write; its ending gives the format (.png, .pdf, .svg).
    """
    picture = picture_of(cloud)
    before, after = before_and_after(cloud, seg)
    height, width = picture.shape
    scale = min(_PANEL[0] / width, _PANEL[1] / height)
    figure = Figure(figsize=(2 * scale * width, scale * height + _HEAD + 0.04), dpi=100, facecolor="white")
    axes = figure.subplots(1, 2)
    top = 1.0 - _HEAD / figure.get_figheight()
    figure.subplots_adjust(left=0.004, right=0.996, bottom=0.006, top=top, wspace=0.008)
    removed = "floor removed" if seg.plane is not None else "no floor found"
    if not seg.params.remove_floor:
        removed = "floor kept"
    total = sum(seg.ms.values())
    titles = (
        f"the cloud: {valid_points(cloud).sum():,} points",
        f"{len(seg.regions):,} regions  ({removed}, {total:,.0f} ms)" if seg.ms else f"{len(seg.regions):,} regions",
    )
    for ax, color, title in zip(axes, (before, after), titles, strict=True):
        shown = np.concatenate([color, np.full((1, 3), _BACKDROP, dtype=np.uint8)])[picture]
        ax.imshow(shown, interpolation="nearest", aspect="equal")
        ax.set_title(title, fontsize=11 if scale * width > 4 else 9, pad=5)
        ax.set_axis_off()
    figure.savefig(path)


def before_and_after(cloud: Cloud, seg: Segmentation) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8]]:
    """Return the two colors of every point, each (N, 3) uint8."""
    before = own_colors(cloud)
    return before, region_colors(before, seg.labels)
