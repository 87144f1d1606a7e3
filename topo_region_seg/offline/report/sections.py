# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The parts of the page."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from decimal import Decimal
from pathlib import PurePath

import numpy as np

from topo_region_seg.offline.evaluation.measures import MEASURES
from topo_region_seg.offline.report.content import FrameContent, stages
from topo_region_seg.offline.report.markup import table, text
from topo_region_seg.offline.runs.record import RunRecord
from topo_region_seg.offline.runs.run import Run
from topo_region_seg.params import Params

CAPTIONS = {"input": "The cloud", "regions": "Regions", "truth": "Truth"}
CHARTS = {
    "regions": ("Regions", "in each frame"),
    "time": ("Milliseconds", "of each stage, stacked from the bottom in the order of the list (with their means)"),
    "quality": (
        "Quality",
        "against the truth: weighted overlap WOv (solid, circles; 1 is best), over-segmentation Fos (dashed, squares; "
        "0 is best), under-segmentation Fus (dotted, triangles; 0 is best)",
    ),
}
MEANING = {
    "wov": "weighted overlap of each object segment and the region that covers most of it; 1 is best",
    "fos": "over-segmentation: share of the objects outside of that region; 0 is best",
    "fus": "under-segmentation: points of that region outside of the segment; 0 is best, can exceed 1",
    "ari": "adjusted Rand index on the points of objects; 1 is best",
    "boundary_recall": "share of the true boundary within 2 pixels of the regions' one; 1 is best",
    "boundary_precision": "share of the regions' boundary within 2 pixels of the true one; 1 is best",
    "asa": "achievable segmentation accuracy: each region given its most frequent segment; 1 is best",
    "labelled": "share of the valid points that have a region",
}
VIEW_BUTTONS = {
    "left": ("◀", "Turn left"),
    "right": ("▶", "Turn right"),
    "up": ("▲", "Turn up"),
    "down": ("▼", "Turn down"),
    "nearer": ("+", "Nearer"),
    "farther": ("−", "Farther"),
    "reset": ("⟲", "As the sensor saw it"),
}
MODES = {"label": "Regions", "rgb": "Colors", "truth": "Truth"}


def lead(record: RunRecord, params: Params) -> str:
    """Return the first sentences."""
    count, failed = len(record.frames), len(record.rejected)
    rejected = f"{failed} rejected" if failed else "none rejected"
    of = f"of {PurePath(record.source).name}, topic {record.topic}"
    own = params.as_dict()
    changed = [f"{name} = {_plain(own[name])}" for name, value in Params().as_dict().items() if own[name] != value]
    made = f"Parameters other than the defaults: {', '.join(changed)}" if changed else "All parameters are the defaults"
    return (
        f"{count} cloud{'' if count == 1 else 's'} segmented {of}; {rejected}. Labels are of {params.output}. {made}."
    )


def notices(run: Run, truth: str | None) -> str:
    """Return what a reader has to know before believing the rest."""
    record, lines = run.record, []
    if record.truncated:
        lines.append("The source is cut short; what was whole was segmented.")
    if record.interrupted:
        lines.append("The run was interrupted; the frames until then are here.")
    lines += [f"Damaged: {problem}" for problem in [*record.problems, *run.problems]]
    if truth is None:
        lines.append(
            "No true labels are known, so there is no quality; --source and --truth-topic tell where they are."
        )
    return "\n".join(f'<p class="notice">{text(line)}</p>' for line in lines)


def cards(record: RunRecord, frames: Sequence[FrameContent], params: Params) -> str:
    """Return the figures at the top."""
    shown = [("Frames", f"{len(frames)}", f"{len(record.rejected)} rejected")]
    if frames:
        counts = sorted(frame.record.regions for frame in frames)
        total = [frame.record.ms.get("total", 0.0) for frame in frames]
        points = int(np.median([frame.record.points for frame in frames]))
        spread = f"{counts[0]} to {counts[-1]}" if counts[0] != counts[-1] else f"{counts[0]}"
        shown.append((f"{params.output.capitalize()} a frame", spread, f"median {np.median(counts):g}"))
        shown.append(("Points a frame", f"{points:,}", "median, invalid ones included"))
        shown.append(("Time a frame", f"{np.median(total):.0f} ms", f"median; p95 {np.percentile(total, 95):.0f} ms"))
    notes = {"wov": "1 is best", "fos": "0 is best", "fus": "0 is best"}
    names = {"wov": "Weighted overlap", "fos": "Over-segmentation", "fus": "Under-segmentation"}
    for key, note in notes.items():
        known = _known(frames, key)
        if known:
            shown.append((names[key], f"{np.mean(known):.3f}", f"mean of {len(known)} frames; {note}"))
    return "".join(
        f"<div><dt>{text(name)}</dt><dd>{text(value)}<small>{text(note)}</small></dd></div>"
        for name, value, note in shown
    )


def chart_figures(names: Collection[str], params: Params) -> str:
    """Return the places where the scripts draw the charts."""
    parts = []
    for name in names:
        title, what = CHARTS[name]
        title = params.output.capitalize() if name == "regions" else title
        legend = '<ul class="legend"></ul>' if name == "time" else ""
        parts.append(
            f'<figure class="chart" data-chart="{name}">'
            f"<figcaption><strong>{text(title)}</strong> {text(what)}</figcaption>"
            f'<svg role="img" aria-label="{text(title)} {text(what)}. The table under Numbers has the values."></svg>'
            f"{legend}</figure>"
        )
    return "\n".join(parts)


def frame_section(frame: FrameContent, params: Params) -> str:
    """Return one frame with its pictures."""
    captions = {**CAPTIONS, "regions": params.output.capitalize()}
    record, index = frame.record, frame.index
    facts = [f"{record.points:,} points", f"{record.regions} {params.output}", f"{record.ms.get('total', 0.0):.0f} ms"]
    if frame.quality and frame.quality["wov"] is not None:
        facts.append(f"WOv {frame.quality['wov']:.3f}, Fos {frame.quality['fos']:.3f}, Fus {frame.quality['fus']:.3f}")
    facts.append(f"frame id {frame.frame_id!r}")
    notes = {
        "input": "as recorded",
        "regions": f"{record.regions}, each with an outline and a color, and with a number where there is room; "
        f"gray = none{'; labels are kept from frame to frame' if params.track_regions else ''}",
        "truth": "each segment in the color of the region that covers most of it; numbers are true labels",
    }
    pictures = "".join(
        f'<figure><img src="{uri}" alt="{text(captions[name])} of frame {index}" decoding="async">'
        f"<figcaption><strong>{text(captions[name])}</strong>: {text(notes[name])}</figcaption></figure>"
        for name, uri in frame.pictures
    )
    shown = f'<div class="pictures">{pictures}</div>' if pictures else '<p class="hint">No pictures of this frame.</p>'
    return (
        f'<article class="frame" aria-label="Frame {index}"><h3>Frame {index}, {record.stamp:.3f} s</h3>'
        f'<p class="facts">{text("; ".join(facts))}</p>{shown}</article>'
    )


def closer(frames: Sequence[FrameContent], params: Params) -> str:
    """Return the controls and places of the 3D view and the barcode."""
    chosen = [frame for frame in frames if frame.points is not None]
    if not chosen:
        return "<p>No frame was chosen; --frames names some.</p>"
    known = {"label", "rgb", *(["truth"] if any("truth" in (frame.points or {}) for frame in chosen) else [])}
    which = "".join(
        f'<button type="button" data-closer="{frame.index}" aria-pressed="false" aria-label="Frame {frame.index}">'
        f"{frame.index}</button>"
        for frame in chosen
    )
    modes = "".join(
        f'<button type="button" data-mode="{mode}" aria-pressed="false">{text(name)}</button>'
        for mode, name in {**MODES, "label": params.output.capitalize()}.items()
        if mode in known
    )
    acts = "".join(
        f'<button type="button" data-act="{act}" aria-label="{text(name)}" title="{text(name)}">{sign}</button>'
        for act, (sign, name) in VIEW_BUTTONS.items()
    )
    return (
        '<noscript><p class="notice">The 3D view, the barcode and the charts need JavaScript.</p></noscript>'
        '<div id="closer-body" hidden>'
        f'<div class="controls" role="group" aria-label="Frame in 3D"><span>Frame</span>{which}</div>'
        '<div class="closer"><figure>'
        '<canvas id="view" tabindex="0" role="img" aria-label="Points in 3D; arrow keys turn them, plus and minus '
        'zoom, Home goes back to the view of the sensor"></canvas>'
        '<figcaption><span id="view-note"></span> Drag, or use the arrow keys, to turn; pinch, or + and −, to zoom; '
        "Home to go back.</figcaption>"
        f'<div class="controls" role="group" aria-label="Colors of the points">{modes}</div>'
        f'<div class="controls" role="group" aria-label="Turn and zoom">{acts}</div></figure>'
        '<div><figure id="bars"><svg role="img" aria-labelledby="bars-note"></svg></figure>'
        '<p class="hint"><strong>Barcode of H0.</strong> <span id="bars-note"></span> The upper bars are the longest '
        "of each region; those with an arrow never die. The lower part counts, on a log scale, how many bars die at "
        "which scale.</p></div>"
        "</div></div>"
    )


def numbers(frames: Sequence[FrameContent]) -> str:
    """Return the tables of frames, stages and quality."""
    if not frames:
        return "<p>There are none.</p>"
    measured = [name for name in MEASURES if _known(frames, name)]
    head = ["frame", "stamp (s)", "points", "regions", "ms", *(name.replace("_", " ") for name in measured)]
    rows = [
        [
            str(frame.index),
            f"{frame.record.stamp:.9f}",
            frame.record.points,
            frame.record.regions,
            _ms(frame.record.ms.get("total", 0.0)),
            *((frame.quality or {}).get(name) for name in measured),
        ]
        for frame in frames
    ]
    parts = [table("Frames", head, rows)]
    timed = []
    for name in [*stages(frames), "total"]:
        values = np.array([frame.record.ms.get(name, 0.0) for frame in frames])
        figures = (values.mean(), np.median(values), np.percentile(values, 95), values.max())
        timed.append([name, *(_ms(value) for value in figures)])
    parts.append(table("Milliseconds", ["stage", "mean", "median", "95 %", "largest"], timed))
    if measured:
        spread = [(name, np.array(_known(frames, name))) for name in measured]
        parts.append(
            table(
                "Quality over the frames with a truth",
                ["measure", "mean", "smallest", "largest", "frames", "meaning"],
                [[name, *map(float, (v.mean(), v.min(), v.max())), len(v), MEANING[name]] for name, v in spread],
            )
        )
    return "\n".join(parts)


def setup(run: Run, truth: str | None) -> str:
    """Return rejected clouds, parameters, versions and the source."""
    record = run.record
    parts = []
    if record.rejected:
        rows = [[f"{entry.stamp:.9f}", entry.reason, entry.detail] for entry in record.rejected]
        parts.append(table("Rejected clouds", ["stamp (s)", "reason", "what was wrong"], rows))
    else:
        parts.append("<p>No cloud was rejected.</p>")
    facts: Mapping[str, str] = {
        "source": PurePath(record.source).name,
        "topic": record.topic,
        "truth": truth or "none",
        "written": record.created,
        **record.versions,
    }
    table_of = {row.name: row for row in Params.table()}
    params = [
        [name, _plain(value), table_of[name].spec.unit or "", table_of[name].spec.doc]
        for name, value in run.params.as_dict().items()
    ]
    parts.append(table("Source and versions", ["what", "value"], facts.items()))
    parts.append(table("Parameters", ["name", "value", "unit", "meaning"], params))
    return "\n".join(parts)


def _known(frames: Sequence[FrameContent], name: str) -> list[float]:
    values = ((frame.quality or {}).get(name) for frame in frames)
    return [value for value in values if value is not None]


def _ms(value: float) -> Decimal:
    return Decimal(f"{value:.1f}")


def _plain(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
