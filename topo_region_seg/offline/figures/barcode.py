# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The H0 barcode, like the paper's Fig. 5."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from topo_region_seg.data import Components, FloatArray, IntArray
from topo_region_seg.params import Params
from topo_region_seg.segmentation import Segmentation
from topo_region_seg.steps.scales.classes import classes_of

_LINES = {"die": 90, "small": 24, "region": 100}  # bars drawn of each kind at most
_WIDTH, _HEIGHT = 8.0, 6.0  # inches
_BLUE = "#1f4fd8"
_PALE = "#8fa8ea"


@dataclass(frozen=True)
class _Group:
    """Bars of one kind: their number, and births and stepped deaths of those that are drawn, metres."""

    kind: str
    count: int
    begun: FloatArray
    drawn: FloatArray


def plot_barcode(seg: Segmentation, path: str | Path) -> None:
    """Write the barcode of a segmentation: one line per generator from its birth to its (stepped) death.

    Bars that never die end in a triangle, as in the paper. From the bottom: bars that die, shortest first; components
    that never die but are smaller than ``min_region_size``; components that are regions. These begin where they have so
    many points: then the region is born. If there are many bars, an even sample is drawn and its size stated.

    Parameters
    ----------
    seg : Segmentation
        The result; the filtration is drawn up to the scale of the regions.
    path : str or Path
        The file to write; its ending gives the format (.png, .pdf, .svg).
    """
    components = seg.components
    if seg.scale < components.max_radius:
        components = components.cut(seg.scale)
    groups = _groups(components, seg.filtered.weight, seg.params)
    unit, per_meter = ("mm", 1e3) if components.max_radius < 0.1 else ("m", 1.0)
    last = components.max_radius * per_meter
    beyond = 1.06 * last
    figure = Figure(figsize=(_WIDTH, _HEIGHT), dpi=140, facecolor="white")
    ax = figure.subplots(gridspec_kw={"left": 0.05, "right": 0.77, "bottom": 0.09, "top": 0.91})
    y = 0.0
    for group in groups:
        rows = y + np.arange(len(group.drawn))
        ends = np.where(np.isinf(group.drawn), beyond, group.drawn * per_meter)
        lines = np.stack([np.stack([group.begun * per_meter, rows], 1), np.stack([ends, rows], 1)], axis=1)
        pale = group.kind == "small"
        color = _PALE if pale else _BLUE
        bars = LineCollection(list(lines), colors=color, linewidths=_line_width(groups))
        bars.set_snap(False)  # rounding to pixels would bundle some bars and leave gaps between others
        ax.add_collection(bars)
        if group.kind != "die":
            size = float(np.clip(700 / max(_height(groups), 1), 3.5, 8.0))
            ax.plot(ends, rows, ">", color=color, markersize=size, clip_on=False)
        if len(rows):
            _note(ax, group, (rows[0] + rows[-1]) / 2)
            y = rows[-1] + 1 + 0.02 * _height(groups)
    ax.set_xlim(0.0, beyond)
    ax.set_ylim(-0.02 * max(y, 1.0), max(y, 1.0))
    ax.set_xlabel(f"filtration value ({unit})")
    ax.set_xticks(_ticks(components, seg.params.filtration_steps, per_meter))
    ax.set_yticks([])
    ax.set_ylabel("generators of H$_0$")
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_title(_title(seg, groups), fontsize=11, loc="left")
    figure.savefig(path)


def _groups(components: Components, weight: IntArray, params: Params) -> tuple[_Group, _Group, _Group]:
    """Sort the bars into those that die, small components and regions; sample each group evenly by rank."""
    death = components.stepped(params.filtration_steps)
    survivors = np.flatnonzero(np.isinf(death))
    classes = classes_of(components, weight, params.min_region_size)
    born = np.sort(classes.birth[np.isinf(classes.death)])[::-1]
    large = len(born)
    small, drawn = len(survivors) - large, born[_even_sample(large, _LINES["region"])]
    finite = np.sort(death[np.isfinite(death)])
    return (
        _from_zero("die", len(finite), finite[_even_sample(len(finite), _LINES["die"])]),
        _from_zero("small", small, np.full(min(small, _LINES["small"]), np.inf)),
        _Group("region", large, drawn, np.full(len(drawn), np.inf)),
    )


def _from_zero(kind: str, count: int, drawn: FloatArray) -> _Group:
    return _Group(kind, count, np.zeros(len(drawn)), drawn)


def _even_sample(count: int, most: int) -> IntArray:
    """Return up to `most` of the ranks 0..count - 1, evenly spread, including the first and the last."""
    return np.round(np.linspace(0, count - 1, min(count, most))).astype(np.int64)


def _height(groups: tuple[_Group, ...]) -> int:
    return sum(len(group.drawn) for group in groups)


def _line_width(groups: tuple[_Group, ...]) -> float:
    spacing = 0.8 * _HEIGHT * 72.0 / max(_height(groups), 1)  # points
    return float(np.clip(0.5 * spacing, 0.3, 3.0))


def _note(ax: Axes, group: _Group, y: float) -> None:
    """Label a group with its kind and how many of its bars are drawn."""
    what = {
        "die": "die: joined to\nan older component",
        "small": "never die, but\nhave few points",
        "region": "never die:\nregions, from birth",
    }[group.kind]
    part = "" if len(group.drawn) == group.count else f"\n({len(group.drawn)} drawn)"
    ax.annotate(
        f"{group.count:,} {what}{part}",
        (1.03, y),
        xycoords=("axes fraction", "data"),
        fontsize=9,
        va="center",
        color=_BLUE,
        annotation_clip=False,
    )


def _ticks(components: Components, steps: int, per_meter: float) -> FloatArray:
    """Return 0 and the steps of the filtration, or every k-th of many steps."""
    scales = np.append(0.0, components.scales(steps))
    every = -(-steps // 10)
    return scales[::every] * per_meter


def _title(seg: Segmentation, groups: tuple[_Group, ...]) -> str:
    never = groups[1].count + groups[2].count
    fate = "merged into neighbors" if seg.params.small_regions == "merge" else "removed"
    small = f"the {groups[1].count:,} small components {fate}: " if groups[1].count else ""
    regions = f"{len(seg.regions):,} region{'' if len(seg.regions) == 1 else 's'}"
    return f"{len(seg.point_labels):,} points, {never:,} bars of infinite persistence\n{small}{regions}"
