# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``report``: a run as one HTML page."""

from __future__ import annotations

import argparse
from pathlib import Path

from topo_region_seg.offline.cli import status
from topo_region_seg.offline.cli.evaluation_options import add_reading_arguments, reading_from
from topo_region_seg.offline.cli.status import ToolError

CHOSEN = 4
"""Frames shown in 3D unless others are asked for."""
MOST_CHOSEN = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("run", metavar="RUN", type=Path, help="the run, written by `replay BAG -o RUN`")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, help="the page (default: RUN.html beside RUN)")
    parser.add_argument(
        "--source", metavar="BAG", type=Path, help="the recording that was replayed, if it has been moved"
    )
    parser.add_argument(
        "--frames", metavar="N,N,...", help=f"frames to show in 3D and with a barcode (default: {CHOSEN} of them)"
    )
    parser.add_argument(
        "--truth-topic",
        metavar="TOPIC",
        help="topic of the true labels in the source (default: /ground_truth/labels, if there)",
    )
    add_reading_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Write the page."""
    from topo_region_seg.offline.cli.console import check_writable, note, progress, waiting, write_whole
    from topo_region_seg.offline.report.content import evenly, gather
    from topo_region_seg.offline.report.page import page
    from topo_region_seg.offline.runs.barcodes import barcodes_of
    from topo_region_seg.offline.runs.run import open_run
    from topo_region_seg.offline.runs.truth import truth_of_run

    output = args.output or beside(args.run)
    check_writable(output, (".html", ".htm"))
    found = open_run(args.run)
    count = len(found.record.frames)
    chosen = evenly(count, CHOSEN) if args.frames is None else chosen_frames(args.frames, count)
    with waiting("reading the truth"):
        truth = truth_of_run(found, args.source, args.truth_topic, reading_from(args))
    with waiting("computing barcodes"):
        barcodes = barcodes_of(found, chosen, args.source)
    with progress("drawing", count) as step:
        frames = gather(found, truth, chosen, barcodes, step)
    known = truth is not None and any(frame.quality for frame in frames)
    text = page(found, frames, truth.topic if truth and known else None)
    write_whole(output, text)
    for problem in found.problems:
        note(f"damaged: {problem}")
    if truth and (line := truth.note()):
        note(line)
    if missing := [index for index in chosen if index not in barcodes]:
        note(f"no barcode of frame {', '.join(map(str, missing))}: neither the run nor its source has it; see --source")
    print(f"{args.run}: {count} frames, {len(text.encode()) / 1e6:.1f} MB")
    print(f"wrote {output}")
    return status.FAILED if found.problems else status.DONE


def beside(path: Path) -> Path:
    """Return the page's default name: that of the file or folder, with the ending ``.html``."""
    found = path.resolve()
    return path.parent / f"{found.name if found.is_dir() else found.stem}.html"


def chosen_frames(text: str, count: int) -> list[int]:
    """Return the indices in a list such as ``0,5,7``, sorted.

    Raises
    ------
    ToolError
        One is not a number or not the index of a frame, or there are too many.
    """
    try:
        chosen = sorted({int(part) for part in text.split(",")})
    except ValueError:
        raise ToolError(f"--frames {text}: write numbers, such as --frames 0,5,7") from None
    if wrong := [index for index in chosen if not 0 <= index < count]:
        raise ToolError(f"--frames {text}: there is no frame {wrong[0]}; the run has frames 0 to {count - 1}")
    if len(chosen) > MOST_CHOSEN:
        raise ToolError(f"--frames: {len(chosen)} frames are too many for one page; choose at most {MOST_CHOSEN}")
    return chosen
