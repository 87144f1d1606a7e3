# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The findings of ``inspect`` as text, JSON and a parameter file."""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import yaml
from rich import box
from rich.table import Table

from topo_region_seg.offline.bags import BagReader
from topo_region_seg.offline.bags.clouds import why_no_clouds
from topo_region_seg.offline.bags.images import ImageTopic
from topo_region_seg.offline.inspection.suggest import Advice
from topo_region_seg.offline.inspection.summary import PointSummary, summarize
from topo_region_seg.offline.inspection.topic import NANOSECONDS, Layout, TopicReport
from topo_region_seg.offline.sensor_figures import SensorFigures

WIDTH = 100
SHOWN_LAYOUTS = 4


def whole(path: Path, reader: BagReader, reports: Sequence[TopicReport]) -> Iterator[str | Table]:
    """Yield the lines and tables for the terminal."""
    yield _storage_line(path, reader)
    yield _topic_table(reader)
    for report in reports:
        yield from _cloud_lines(report)
        summary = summarize(report.figures)
        if summary is None:
            if report.layouts and not report.unreadable:
                yield "  no x, y and z, or no valid point: not measured"
            continue
        yield _points_line(summary)
        yield _sensor_line(report.sensor)
        yield _band_table(summary)
        if report.advice is None:
            yield "too few points to suggest parameters"
            continue
        yield _spread_line(report.advice)
        yield _suggestion_table(report.advice)
    if not reports:
        yield f"no clouds: the recording {why_no_clouds(reader)}"


def json_text(path: Path, reader: BagReader, reports: Sequence[TopicReport], problems: Sequence[str]) -> str:
    """Return all findings as JSON; unknown values are null."""
    storage = reader.storage()
    found = {
        "bag": str(path),
        "storage": storage.kind,
        "files": storage.files,
        "compression": list(storage.compression),
        "start": None if storage.times is None else storage.times[0] / NANOSECONDS,
        "duration": None if storage.times is None else (storage.times[1] - storage.times[0]) / NANOSECONDS,
        "truncated": reader.truncated,
        "problems": list(problems),
        "topics": [{"name": t.name, "type": t.type, "count": t.count} for t in reader.topics],
        "clouds": {report.topic.name: _report(report) for report in reports},
    }
    return json.dumps(_plain(found), indent=1, allow_nan=False) + "\n"


def yaml_text(path: Path, report: TopicReport, advice: Advice) -> str:
    """Return a parameter file for the node, with the reason for each value."""
    clouds = f"{len(report.figures)} cloud{'' if len(report.figures) == 1 else 's'}"
    lines = [
        f"# Suggested by topo_region_seg inspect, from {clouds} of {report.topic.name} in {path.name}.",
        "# Parameters that are not named here keep their defaults.",
        "/**:",
        "  ros__parameters:",
    ]
    for suggestion in advice.suggestions:
        lines += textwrap.wrap(suggestion.reason, WIDTH - 6, initial_indent="    # ", subsequent_indent="    # ")
        lines.append("    " + yaml.safe_dump({suggestion.name: suggestion.value}).strip())
    return "\n".join(lines) + "\n"


def _storage_line(path: Path, reader: BagReader) -> str:
    storage = reader.storage()
    parts = [storage.kind if storage.files == 1 else f"{storage.kind}, {storage.files} files"]
    parts += storage.compression or ("not compressed",) if storage.kind != "ROS 1 bag" else ()
    if storage.times is not None:
        start = datetime.fromtimestamp(storage.times[0] / NANOSECONDS, timezone.utc)
        parts.append(f"{(storage.times[1] - storage.times[0]) / NANOSECONDS:.1f} s from {start:%Y-%m-%d %H:%M:%S} UTC")
    if reader.truncated:
        parts.append("cut short")
    return f"{path}: {', '.join(parts)}"


def _topic_table(reader: BagReader) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in ("topic", "type"):
        table.add_column(name, overflow="fold")
    table.add_column("messages", justify="right")
    for topic in reader.topics:
        table.add_row(topic.name, topic.type, f"{topic.count:,}")
    return table


def _cloud_lines(report: TopicReport) -> Iterator[str]:
    rate = report.rate()
    shown = report.layouts.most_common(SHOWN_LAYOUTS)
    count = len(report.log_times)
    text = f"{count} cloud{'' if count == 1 else 's'}" + (f" at {rate:.3g} Hz" if rate else "")
    if report.out_of_order:
        text += f", {report.out_of_order} out of order by their stamps"
    yield f"{report.topic.name}: {text}"
    if isinstance(report.topic, ImageTopic):
        yield f"  {report.topic}"
    for layout, count in shown:
        yield f"  {'' if len(report.layouts) == 1 else f'{count} times '}{_layout(layout)}"
    if len(report.layouts) > len(shown):
        yield f"  and {len(report.layouts) - len(shown)} other layouts"
    for reason, count in sorted(report.unreadable.items()):
        yield f"  {count} unusable: {reason}"
    for code, text in report.notices.items():
        yield f"  note: {text} ({code})"


def _layout(layout: Layout) -> str:
    order = ", big-endian" if layout.is_bigendian else ""
    dense = "" if layout.is_dense else "not "
    return (
        f"{layout.width} x {layout.height} points of {layout.point_step} bytes{order} "
        f"({', '.join(layout.fields)}), {dense}dense, frame '{layout.frame_id}'"
    )


def _points_line(summary: PointSummary) -> str:
    ranges = ", ".join(f"{percent} %: {value:.2f}" for percent, value in summary.range.items())
    zeros = f" ({100 * summary.zeros:.1f} % at 0, 0, 0)" if summary.zeros else ""
    clouds = f"{summary.clouds} cloud{'' if summary.clouds == 1 else 's'} measured"
    return f"{clouds}: {100 * summary.invalid:.1f} % invalid{zeros}; distance in m {ranges}"


def _sensor_line(sensor: SensorFigures | None) -> str:
    if sensor is None:
        return "no image of a camera: 'output: objects' knows no noise, surfaces and confidence of such clouds"
    return f"camera: {sensor.pixels_text}; noise {sensor.noise_text}\n  steps of depth {sensor.steps_text}"


def _band_table(summary: PointSummary) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in ("distance (m)", "spacing (mm)", "depth noise (mm)"):
        table.add_column(name, justify="right")
    for band in summary.bands:
        table.add_row(f"{band.near:.2f} to {band.far:.2f}", _millimetres(band.spacing), _millimetres(band.noise))
    return table


def _spread_line(advice: Advice) -> str:
    def shown(spread: tuple[float, float, float] | None, unit: str) -> str:
        return "unknown" if spread is None else f"{', '.join(f'{value:.1f}' for value in spread)} {unit}"

    return (
        "differences between neighbors after preprocessing (25, 50 and 90 % are below): "
        f"color {shown(advice.color_spread, 'dE')}; normals {shown(advice.angle_spread, 'deg')}"
    )


def _suggestion_table(advice: Advice) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("suggested")
    table.add_column("value", justify="right")
    table.add_column("reason", overflow="fold")
    for suggestion in advice.suggestions:
        value = suggestion.value
        shown = f"{value:g}" if type(value) in (int, float) else str(value).lower()
        table.add_row(suggestion.name, shown, suggestion.reason)
    return table


def _report(report: TopicReport) -> dict[str, Any]:
    advice, summary = report.advice, summarize(report.figures)
    return {
        "count": len(report.log_times),
        "rate": report.rate(),
        "stamps_out_of_order": report.out_of_order,
        "unreadable": dict(report.unreadable),
        "notices": report.notices,
        "layouts": [{**asdict(layout), "clouds": count} for layout, count in report.layouts.most_common()],
        "color": report.color,
        "sensor": None if report.sensor is None else asdict(report.sensor),
        "measured": None if summary is None else asdict(summary),
        "neighbors": None if advice is None else {"color": advice.color_spread, "angle": advice.angle_spread},
        "suggested": None
        if advice is None
        else {s.name: {"value": s.value, "reason": s.reason} for s in advice.suggestions},
    }


def _plain(value: Any) -> Any:
    """Replace numbers that JSON does not have by null."""
    if isinstance(value, dict):
        return {str(name): _plain(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _millimetres(value: float) -> str:
    return f"{1e3 * value:.2f}" if math.isfinite(value) else "-"
