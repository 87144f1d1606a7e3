# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The page: template, styles, scripts and the content of a run in one text."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from string import Template

import topo_region_seg
from topo_region_seg.cloud.label_colors import palette
from topo_region_seg.offline.report.content import FrameContent
from topo_region_seg.offline.report.markup import data_block, policy, text
from topo_region_seg.offline.report.sections import (
    cards,
    chart_figures,
    closer,
    frame_section,
    lead,
    notices,
    numbers,
    setup,
)
from topo_region_seg.offline.report.series import charts
from topo_region_seg.offline.runs.run import Run

SCRIPTS = ("page.js", "charts.js", "barcode.js", "view3d.js", "closer.js")


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
    facts = {
        "frames": [{"regions": frame.record.regions} for frame in frames],
        "charts": drawn,
        "palette": palette().tolist(),
    }
    blocks = [data_block("run", facts)]
    for frame in frames:
        if frame.points is not None:
            blocks.append(data_block(f"points-{frame.index}", frame.points))
        if frame.bars is not None:
            blocks.append(data_block(f"bars-{frame.index}", frame.bars))
    return Template(_asset("page.html")).substitute(
        policy=policy(scripts, [style]),
        version=text(topo_region_seg.__version__),
        title=text(f"Run {run.path.name}"),
        style=style,
        lead=text(lead(run.record, run.params)),
        notices=notices(run, truth),
        cards=cards(run.record, frames, run.params),
        charts=chart_figures(drawn, run.params),
        last=max(0, len(frames) - 1),
        frames="\n".join(frame_section(frame, run.params) for frame in frames) or "<p>No cloud was segmented.</p>",
        closer=closer(frames, run.params),
        numbers=numbers(frames),
        setup=setup(run, truth),
        data="\n".join(blocks),
        scripts="\n".join(f"<script>{source}</script>" for source in scripts),
    )


def _asset(name: str) -> str:
    return (files("topo_region_seg.offline.report") / "assets" / name).read_text(encoding="utf-8")
