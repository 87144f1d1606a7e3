# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The page: template, styles, scripts and the content of a run in one text."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from markupsafe import Markup

import topo_region_seg
from topo_region_seg.cloud.label_colors import palette
from topo_region_seg.offline.report.content import FrameContent
from topo_region_seg.offline.report.markup import environment, policy
from topo_region_seg.offline.report.sections import (
    VIEW_BUTTONS,
    cards,
    chart_titles,
    colorings,
    frame_view,
    lead,
    notices,
    numbers,
    setup,
)
from topo_region_seg.offline.report.series import charts
from topo_region_seg.offline.runs.run import Run

SCRIPTS = ("page.js", "charts.js", "barcode.js", "view3d.js", "detail.js")


def page(run: Run, frames: Sequence[FrameContent], truth: str | None) -> str:
    """Return the page as one HTML text that loads nothing.

    Parameters
    ----------
    run : Run
        The run.
    frames : sequence of FrameContent
        Its frames.
    truth : str or None
        The topic of the truth; None where none is known.
    """
    scripts, style = [_asset(name) for name in SCRIPTS], _asset("page.css")
    drawn = charts(frames)
    chosen = [frame for frame in frames if frame.points is not None]
    facts = {
        "frames": [{"regions": frame.record.regions} for frame in frames],
        "charts": drawn,
        "palette": palette().tolist(),
    }
    blocks: dict[str, Any] = {"run": facts}
    for frame in frames:
        named = {f"points-{frame.index}": frame.points, f"bars-{frame.index}": frame.bars}
        blocks |= {name: block for name, block in named.items() if block is not None}
    return (
        environment()
        .get_template("page.html")
        .render(
            policy=policy(scripts, [style]),
            version=topo_region_seg.__version__,
            title=f"Run {run.path.name}",
            lead=lead(run.record, run.params),
            notices=notices(run, truth),
            cards=cards(run.record, frames, run.params),
            charts=chart_titles(drawn, run.params),
            frames=[frame_view(frame, run.params) for frame in frames],
            chosen=[frame.index for frame in chosen],
            colorings=colorings(chosen, run.params),
            acts=VIEW_BUTTONS,
            numbers=numbers(frames),
            rejected=len(run.record.rejected),
            setup=setup(run, truth),
            blocks=blocks,
            # The project's own files, whose text the policy's hashes are of.
            style=Markup(style),
            scripts=[Markup(script) for script in scripts],
        )
    )


def _asset(name: str) -> str:
    return (files("topo_region_seg.offline.report") / "assets" / name).read_text(encoding="utf-8")
