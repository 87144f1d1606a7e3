# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``compare``: two runs of the same recording, for people and for continuous integration."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

from topo_region_seg.offline.cli import status
from topo_region_seg.offline.cli.evaluation_options import add_reading_arguments, reading_from

if TYPE_CHECKING:
    from topo_region_seg.offline.runs.comparison import Comparison, FrameChange
    from topo_region_seg.offline.runs.run import Run

PICTURED = 4
"""Frames in the picture: those that changed most."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("run_a", metavar="RUN_A", type=Path, help="the run to compare with, written by replay -o")
    parser.add_argument("run_b", metavar="RUN_B", type=Path, help="the run that may have changed")
    parser.add_argument(
        "--most", metavar="N", type=_count, default=10, help="frames in the table (default: %(default)s)"
    )
    parser.add_argument(
        "--picture", metavar="FILE", type=Path, help="draw the frames that changed most: A, B and the difference"
    )
    parser.add_argument("--json", metavar="FILE", type=Path, help="write all frames and the summary as JSON")
    parser.add_argument("--source", metavar="BAG", type=Path, help="the recording that was replayed, if it was moved")
    parser.add_argument("--truth-topic", metavar="TOPIC", help="topic of true labels (default: /ground_truth/labels)")
    add_reading_arguments(parser)
    limits = parser.add_argument_group("limits (the exit status is 1 if any is exceeded)")
    limits.add_argument(
        "--max-region-change", metavar="N", type=_count, help="change in the number of regions of any frame"
    )
    limits.add_argument("--min-wov", metavar="X", type=_share, help="overlap of A's regions with B's in any frame")
    limits.add_argument(
        "--min-ari", metavar="X", type=_number, help="adjusted Rand index of the partitions in any frame"
    )
    limits.add_argument("--max-changed", metavar="X", type=_share, help="share of changed points in any frame")
    limits.add_argument(
        "--max-ms-ratio", metavar="R", type=_positive, help="median CPU time per frame of B divided by that of A"
    )
    limits.add_argument(
        "--max-quality-loss", metavar="X", type=_number, help="mean WOv of A against the truth minus that of B"
    )
    limits.add_argument("--max-unmatched", metavar="N", type=_count, help="frames that only one of the runs has")


def run(args: argparse.Namespace) -> int:
    """Compare, print what changed and which limits are exceeded."""
    from topo_region_seg.offline.cli.console import check_picture, check_writable, note, output, progress, write_whole
    from topo_region_seg.offline.cli.tables import change_table
    from topo_region_seg.offline.runs.comparison import compare
    from topo_region_seg.offline.runs.limits import Limits, broken, summary
    from topo_region_seg.offline.runs.run import open_run
    from topo_region_seg.offline.runs.truth import truth_of_run

    if args.json:
        check_writable(args.json)
    check_picture(args.picture)
    a, b = open_run(args.run_a), open_run(args.run_b)
    truth = truth_of_run(a, args.source, args.truth_topic, reading_from(args))
    with progress("comparing", min(len(a.record.frames), len(b.record.frames))) as step:
        found = compare(a, b, truth, step)
    sums = summary(found)
    limits = Limits(**{name: getattr(args, name) for name in Limits.__dataclass_fields__})
    wrong = broken(found, sums, limits)
    changed = found.most_changed(args.most)
    if changed:
        output().print(change_table(changed))
    print(_first_line(args, found))
    for difference in _differences(a, b):
        print(difference)
    for name, stamps in (("RUN_A", found.only_a), ("RUN_B", found.only_b)):
        if stamps:
            shown = ", ".join(f"{stamp:.3f}" for stamp in stamps[:5]) + (" ..." if len(stamps) > 5 else "")
            print(f"only in {name}: {len(stamps)} frame{'' if len(stamps) == 1 else 's'}, at {shown} s")
    if found.unpaired:
        count = len(found.unpaired)
        print(
            f"not compared: {count} stamp{'' if count == 1 else 's'} that several clouds have, the first "
            f"{found.unpaired[0]:.3f} s: the runs have different clouds of it, so which belong together is not known"
        )
    print(_last_line(sums))
    if truth and (unknown := truth.note()):
        note(unknown)
    if args.json:
        write_whole(args.json, json.dumps(_machine(found, sums, wrong), indent=1, allow_nan=False) + "\n")
        print(f"wrote {args.json}")
    if args.picture:
        drawn = found.most_changed(PICTURED) or found.frames[:1]
        if drawn:
            _draw(a, b, drawn, args.picture)
            print(f"wrote {args.picture}")
        else:
            note("no picture: the runs have no frames in common")
    for problem in [*a.problems, *b.problems]:
        note(f"damaged: {problem}")
    for line in wrong:
        note(f"limit exceeded: {line}")
    return status.FAILED if wrong or a.problems or b.problems else status.DONE


def _first_line(args: argparse.Namespace, found: Comparison) -> str:
    count, same = len(found.frames), sum(frame.changed == 0.0 for frame in found.frames)
    return f"{args.run_a} and {args.run_b}: {count} frames in both, {same} with the same regions"


def _last_line(sums: dict[str, float | None]) -> str:
    """Return the figures that have limits in one line."""
    in_a_frame = {
        "region_change": "{:g} regions more or fewer",
        "changed": "{:.1%} of the points changed",
        "wov": "WOv {:.3f}",
        "ari": "ARI {:.3f}",
    }
    overall = {
        "cpu_ms_ratio": "{:.2f} times the CPU time",
        "wall_ms_ratio": "{:.2f} times the time",
        "quality_loss": "WOv against the truth lower by {:.3f}",
    }
    parts = []
    for what, shown in (("worst of any frame", in_a_frame), ("overall", overall)):
        known = [text.format(value) for name, text in shown.items() if (value := sums[name]) is not None]
        parts += [f"{what}: {', '.join(known)}"] if known else []
    return "; ".join(parts) or "nothing to compare"


def _differences(a: Run, b: Run) -> list[str]:
    """Return a line for each parameter and version that differs."""
    lines = []
    for what, of_a, of_b in (
        ("parameter", a.params.as_dict(), b.params.as_dict()),
        ("version", a.record.versions, b.record.versions),
    ):
        for name in dict.fromkeys([*of_a, *of_b]):
            if of_a.get(name) != of_b.get(name):
                lines.append(f"{what} {name}: {of_a.get(name, 'none')} -> {of_b.get(name, 'none')}")
    return lines


def _machine(found: Comparison, sums: dict[str, float | None], wrong: list[str]) -> dict[str, object]:
    return {
        "summary": sums,
        "beyond_limits": wrong,
        "only_a": found.only_a,
        "only_b": found.only_b,
        "frames": [
            {
                "stamp": frame.stamp,
                "index": list(frame.index),
                "regions": list(frame.regions),
                "wov": frame.wov,
                "ari": frame.ari,
                "changed": frame.changed,
                "ms": {stage: list(pair) for stage, pair in frame.ms.items()},
                "cpu_ms": {stage: list(pair) for stage, pair in frame.cpu_ms.items()},
                "quality": list(frame.quality),
            }
            for frame in found.frames
        ],
    }


def _draw(a: Run, b: Run, frames: list[FrameChange], path: Path) -> None:
    from topo_region_seg.offline.figures.difference import DifferenceRow, plot_differences
    from topo_region_seg.offline.runs.comparison import changed_points

    of_b = {frame.index: frame for frame in b.frames({frame.index[1] for frame in frames})}
    of_a = {frame.index: frame for frame in a.frames({frame.index[0] for frame in frames})}
    rows = []
    for change in frames:
        left, right = of_a[change.index[0]], of_b[change.index[1]]
        if len(left.labels) != len(right.labels):
            continue  # not the same points, so there is no difference to draw
        titles = (
            f"A, {change.stamp:.3f} s: {change.regions[0]} regions",
            f"B: {change.regions[1]} regions",
            f"changed: {100 * (change.changed or 0.0):.1f} % of the points",
        )
        rows.append(
            DifferenceRow(left.cloud, left.labels, right.labels, changed_points(left.labels, right.labels), titles)
        )
    if rows:
        plot_differences(rows, path)


def _count(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number of at least 0")
    return int(text)


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"'{text}' is not a number")
    return value


def _share(text: str) -> float:
    value = _number(text)
    if not 0.0 <= value <= 1.0:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and 1")
    return value


def _positive(text: str) -> float:
    value = _number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not greater than 0")
    return value
