# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The cloud before and after segmentation, like the paper's Fig. 4."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from topo_region_seg.data import Cloud, Segmentation
from topo_region_seg.figures.projection import picture_of, valid_points
from topo_region_seg.palette import colors

_PANEL = (6.4, 6.4)  # largest width and height of each of the two, inches
_HEAD = 0.38  # inches for the titles
_BACKDROP = 22  # gray level where there is no point


def plot_before_after(cloud: Cloud, seg: Segmentation, path: str | Path) -> None:
    """Write a picture of the cloud in its own colors beside its regions in random ones.

    Points without a region are shown as a dim gray image, pixels without a point nearly black.

    Parameters
    ----------
    cloud : Cloud
        What was segmented.
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
    before = cloud.rgb if cloud.rgb is not None else _shade_of_depth(cloud)
    dim = (before.astype(np.float32) @ np.array([0.3, 0.59, 0.11], dtype=np.float32)) * 0.35 + 30.0
    after = np.where(seg.labels[:, None] > 0, colors(seg.labels), dim[:, None].astype(np.uint8))
    return before, after


def _shade_of_depth(cloud: Cloud) -> npt.NDArray[np.uint8]:
    """Return gray levels for a cloud without color, nearer points brighter."""
    distance = np.linalg.norm(np.where(valid_points(cloud)[:, None], cloud.xyz, np.nan), axis=1)
    known = distance[np.isfinite(distance)]
    near, far = np.percentile(known, (1, 99)) if len(known) else (0.0, 1.0)
    level = 230.0 - 170.0 * np.clip((distance - near) / max(far - near, 1e-9), 0.0, 1.0)
    gray = np.nan_to_num(level).astype(np.uint8)
    return np.repeat(gray[:, None], 3, axis=1)
