# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``evaluate``: how well the regions of recorded clouds match known objects."""

from __future__ import annotations

import argparse
from pathlib import Path

from topo_region_seg.offline.cli import status
from topo_region_seg.offline.cli.evaluation_options import (
    add_cluster_arguments,
    add_source_arguments,
    note_notices,
    note_troubles,
    runner_from,
    sources_from,
    status_of,
)
from topo_region_seg.offline.cli.parameters import add_parameter_arguments, params_from
from topo_region_seg.offline.cli.status import ToolError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    add_source_arguments(parser)
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the results as JSON")
    parser.add_argument("--csv", metavar="FILE", type=Path, help="write the results as CSV, one row per frame")
    add_cluster_arguments(parser)
    add_parameter_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Measure all recordings, print tables and write what was asked for."""
    from topo_region_seg.offline.cli.console import check_writable, note, output, progress, write_whole
    from topo_region_seg.offline.cli.evaluation_output import csv_text, json_text
    from topo_region_seg.offline.cli.evaluation_tables import bag_table, frame_table, identity_table
    from topo_region_seg.offline.cli.interrupt import stop_request
    from topo_region_seg.offline.evaluation.jobs import Job, Plan
    from topo_region_seg.offline.evaluation.measures import DETECTION, LEAKAGE, SEGMENTATION

    params = params_from(args)
    for file in (args.json, args.csv):
        if file:
            check_writable(file)
    plan = Plan([Job(source, params) for source in sources_from(args)])
    found = {done.place: done.result for done in plan.failed}
    with (
        runner_from(args) as runner,
        stop_request() as stop,
        progress("evaluating", plan.clouds) as step,
    ):
        for done in plan.run(runner, step, stop.is_set):
            found[done.place] = done.result
        interrupted = stop.is_set()
    results = [found[place] for place in sorted(found)]
    if len(results) == 1 and results[0].error and not results[0].topic:
        raise ToolError(results[0].error)
    if args.json:
        write_whole(args.json, json_text(results, params))
    if args.csv:
        write_whole(args.csv, csv_text(results))
    if any(result.frames for result in results):
        for measures in (SEGMENTATION, DETECTION, LEAKAGE):
            output().print(frame_table(results, measures))
            output().print(bag_table(results, measures))
        if any(result.identity for result in results):
            output().print(identity_table(results))
    note_notices(results)
    for result in results:
        note_troubles(result)
    if interrupted:
        note("interrupted: the results so far are kept")
    for written in (args.json, args.csv):
        if written:
            print(f"wrote {written}")
    return status.INTERRUPTED if interrupted else status_of(results)
