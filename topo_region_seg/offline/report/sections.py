# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What the parts of the page say; how it looks stands in the templates."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import PurePath

import numpy as np

from topo_region_seg.data import PointClass
from topo_region_seg.offline.evaluation.measures import MEASURES
from topo_region_seg.offline.report.content import FrameContent, stages
from topo_region_seg.offline.report.markup import Table
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
    "overlap_precision": "share of the regions' points that are right, of regions assigned one to one to objects",
    "overlap_recall": "share of the objects' points that are right, of regions assigned one to one to objects",
    "overlap_f": "harmonic mean of overlap precision and recall; 1 is best",
    "f75": "share of the objects whose region has F above 0.75; 1 is best",
    "precision_50": "share of the regions with intersection over union above 0.5 with an object; 1 is best",
    "recall_50": "share of the objects with intersection over union above 0.5 with a region; 1 is best",
    "precision_75": "the same share of the regions, above 0.75",
    "recall_75": "the same share of the objects, above 0.75",
    "false_objects": "regions without such an object, above 0.5",
    "boundary_f": "F of the boundaries of objects and their regions; 1 is best",
    "achievable": "share of the objects' points that are right if each region is what it mostly is; 1 is best",
    "spill": "points of regions outside of the object that they mostly are, of all objects' points; 0 is best",
    "pieces": "regions that hold a tenth of an object or more, mean over the objects",
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
SET_ASIDE = {
    PointClass.SUPPORT: "support",
    PointClass.BEHIND: "behind it",
    PointClass.STRUCTURE: "other structure",
    PointClass.UNSURE: "below min_confidence",
    PointClass.LOOSE: "in nothing large enough",
}
"""What is said of the classes of points without a label."""
MODES = {"label": "Regions", "rgb": "Colors", "truth": "Truth"}


@dataclass(frozen=True)
class ChartTitle:
    """The heading of a chart that the scripts draw."""

    name: str
    title: str
    what: str


@dataclass(frozen=True)
class Picture:
    """A picture of a frame as a data URI."""

    uri: str
    caption: str
    note: str


@dataclass(frozen=True)
class FrameView:
    """One frame as the page shows it; `stamp` in seconds."""

    index: int
    stamp: float
    facts: Sequence[str]
    pictures: Sequence[Picture]


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


def notices(run: Run, truth: str | None) -> list[str]:
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
    return lines


def cards(record: RunRecord, frames: Sequence[FrameContent], params: Params) -> list[tuple[str, str, str]]:
    """Return the figures at the top: name, value and note."""
    shown = [("Frames", f"{len(frames)}", f"{len(record.rejected)} rejected")]
    if frames:
        counts = sorted(frame.record.regions for frame in frames)
        total = [frame.record.ms.get("total", 0.0) for frame in frames]
        points = int(np.median([frame.record.points for frame in frames]))
        spread = f"{counts[0]} to {counts[-1]}" if counts[0] != counts[-1] else f"{counts[0]}"
        shown.append((f"{params.output.capitalize()} a frame", spread, f"median {np.median(counts):g}"))
        shown.append(("Points a frame", f"{points:,}", "median, invalid ones included"))
        note = f"median; p95 {np.percentile(total, 95):.0f} ms"
        cpu = [frame.record.cpu_ms["total"] for frame in frames if "total" in frame.record.cpu_ms]
        note += f"; CPU time {np.median(cpu):.0f} ms" if cpu else ""
        shown.append(("Time a frame", f"{np.median(total):.0f} ms", note))
    notes = {"wov": "1 is best", "fos": "0 is best", "fus": "0 is best"}
    names = {"wov": "Weighted overlap", "fos": "Over-segmentation", "fus": "Under-segmentation"}
    for key, note in notes.items():
        known = _known(frames, key)
        if known:
            shown.append((names[key], f"{np.mean(known):.3f}", f"mean of {len(known)} frames; {note}"))
    return shown


def chart_titles(names: Collection[str], params: Params) -> list[ChartTitle]:
    """Return the headings of the charts."""
    titles = {name: CHARTS[name] for name in names}
    return [
        ChartTitle(name, params.output.capitalize() if name == "regions" else title, what)
        for name, (title, what) in titles.items()
    ]


def frame_view(frame: FrameContent, params: Params) -> FrameView:
    """Return what is said of one frame, with its pictures."""
    captions = {**CAPTIONS, "regions": params.output.capitalize()}
    record = frame.record
    facts = [f"{record.points:,} points", f"{record.regions} {params.output}", f"{record.ms.get('total', 0.0):.0f} ms"]
    aside = {text: record.classes.get(of.name.lower(), 0) for of, text in SET_ASIDE.items()}
    if any(aside.values()):
        shares = [f"{100 * count / record.points:.1f} % {text}" for text, count in aside.items() if count]
        facts.append(f"without a label: {', '.join(shares)}")
    if frame.quality and frame.quality["wov"] is not None:
        facts.append(f"WOv {frame.quality['wov']:.3f}, Fos {frame.quality['fos']:.3f}, Fus {frame.quality['fus']:.3f}")
    if frame.quality and frame.quality["false_objects"] is not None:
        facts.append(f"{frame.quality['false_objects']:.0f} of the {params.output} on no object")
    facts.append(f"frame id {frame.frame_id!r}")
    notes = {
        "input": "as recorded",
        "regions": f"{record.regions}, each with an outline and a color, and with a number where there is room; "
        f"gray = none{'; labels are kept from frame to frame' if params.track_regions else ''}",
        "truth": "each segment in the color of the region that covers most of it; numbers are true labels",
    }
    pictures = [Picture(uri, captions[name], notes[name]) for name, uri in frame.pictures]
    return FrameView(frame.index, record.stamp, facts, pictures)


def colorings(chosen: Sequence[FrameContent], params: Params) -> dict[str, str]:
    """Return the ways to color the points in 3D, by the name that the scripts know."""
    known = {"label", "rgb", *(["truth"] if any("truth" in (frame.points or {}) for frame in chosen) else [])}
    return {mode: name for mode, name in {**MODES, "label": params.output.capitalize()}.items() if mode in known}


def numbers(frames: Sequence[FrameContent]) -> list[Table]:
    """Return the tables of frames, stages and quality."""
    if not frames:
        return []
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
    parts = [Table("Frames", head, rows)]
    timed = []
    for name in [*stages(frames), "total"]:
        values = np.array([frame.record.ms.get(name, 0.0) for frame in frames])
        figures = (values.mean(), np.median(values), np.percentile(values, 95), values.max())
        cpu = [frame.record.cpu_ms[name] for frame in frames if name in frame.record.cpu_ms]
        timed.append([name, *(_ms(value) for value in figures), _ms(float(np.median(cpu))) if cpu else None])
    parts.append(Table("Milliseconds", ["stage", "mean", "median", "95 %", "largest", "median CPU time"], timed))
    if measured:
        spread = [(name, np.array(_known(frames, name))) for name in measured]
        parts.append(
            Table(
                "Quality over the frames with a truth",
                ["measure", "mean", "smallest", "largest", "frames", "meaning"],
                [[name, *map(float, (v.mean(), v.min(), v.max())), len(v), MEANING[name]] for name, v in spread],
            )
        )
    return parts


def setup(run: Run, truth: str | None) -> list[Table]:
    """Return rejected clouds, parameters, versions and the source."""
    record = run.record
    parts: list[Table] = []
    if record.rejected:
        rows = [[f"{entry.stamp:.9f}", entry.reason, entry.detail] for entry in record.rejected]
        parts.append(Table("Rejected clouds", ["stamp (s)", "reason", "what was wrong"], rows))
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
    if record.sensor is not None:
        sensor = record.sensor
        told = {"pixels": sensor.pixels_text, "noise": sensor.noise_text, "steps of depth": sensor.steps_text}
        parts.append(Table("The camera, as the first cloud shows it", ["what", "value"], list(told.items())))
    parts.append(Table("Source and versions", ["what", "value"], list(facts.items())))
    parts.append(Table("Parameters", ["name", "value", "unit", "meaning"], params))
    return parts


def _known(frames: Sequence[FrameContent], name: str) -> list[float]:
    values = ((frame.quality or {}).get(name) for frame in frames)
    return [value for value in values if value is not None]


def _ms(value: float) -> Decimal:
    return Decimal(f"{value:.1f}")


def _plain(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
