# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Quality against time of several sets of parameters."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

_BLUE = "#1f4fd8"
_PALE = "#8fa8ea"
_ORANGE = "#c2410c"
_LISTED = 16
"""Largest number of parameter sets that are named beside the plot."""
_NUMBERED = 60


def plot_sweep(times: Sequence[float], overlaps: Sequence[float], names: Sequence[str], path: str | Path) -> None:
    """Draw weighted overlap against milliseconds per frame, one point per set of parameters.

    The first set is the best and drawn as a star. A line joins the sets that no other one beats in both. Points have
    the numbers of the table, and the first few are named.

    Parameters
    ----------
    times, overlaps : sequence of float
        Median milliseconds per frame and mean weighted overlap, in the order of the table: the best first.
    names : sequence of str
        The parameters in words.
    path : str or Path
        The file to write; its ending gives the format (.png, .pdf, .svg).
    """
    figure = Figure(figsize=(10.0, 5.4), dpi=140, facecolor="white")
    ax = figure.subplots(gridspec_kw={"left": 0.08, "right": 0.6, "bottom": 0.12, "top": 0.92})
    front = _front(times, overlaps)
    if len(front) > 1:
        ax.plot(
            [times[i] for i in front], [overlaps[i] for i in front], color=_PALE, zorder=1, label="best for its time"
        )
    ax.scatter(times[1:], overlaps[1:], s=36, color=_BLUE, zorder=2)
    ax.scatter(times[:1], overlaps[:1], s=260, marker="*", color=_ORANGE, zorder=3, label="best: number 1")
    numbered = range(len(times)) if len(times) <= _NUMBERED else sorted({0, *front})
    for i in numbered:
        ax.annotate(str(i + 1), (times[i], overlaps[i]), (6, 5), textcoords="offset points", fontsize=9)
    ax.margins(0.12)
    ax.grid(alpha=0.25)
    ax.set_xlabel("median time per frame (ms)")
    ax.set_ylabel("mean weighted overlap (WOv)")
    ax.set_title(f"{len(times)} sets of parameters", fontsize=11)
    ax.legend(loc="best", fontsize=9)
    lines = [f"{i + 1:>3}  {name}" for i, name in enumerate(names[:_LISTED])]
    if len(names) > _LISTED:
        lines.append(f"     and {len(names) - _LISTED} more: see the table")
    figure.text(0.62, 0.9, "\n".join(lines), fontsize=8, va="top", linespacing=1.5)
    figure.savefig(path)


def _front(times: Sequence[float], overlaps: Sequence[float]) -> list[int]:
    """Return the sets that no other one beats in both time and overlap, fastest first."""
    found: list[int] = []
    for i in sorted(range(len(times)), key=lambda i: (times[i], -overlaps[i])):
        if not found or overlaps[i] > overlaps[found[-1]]:
            found.append(i)
    return found
