# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``sweep``: every combination of parameter values on every recording, to find the best."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

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
from topo_region_seg.offline.cli.parameter_grid import SET_MANY, Combination, grid_from
from topo_region_seg.offline.cli.parameters import add_parameter_arguments
from topo_region_seg.offline.cli.status import ToolError

if TYPE_CHECKING:
    from topo_region_seg.offline.cli.sweep_output import Outcome
    from topo_region_seg.offline.evaluation.results import BagResult


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    add_source_arguments(parser)
    parser.add_argument(
        "-o", "--output", metavar="FOLDER", type=Path, help="write sweep.csv, sweep.json and sweep.png to a folder"
    )
    parser.add_argument("--plot", metavar="FILE", type=Path, help="draw quality against time (.png, .pdf, .svg)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the results as JSON")
    parser.add_argument("--csv", metavar="FILE", type=Path, help="write the results as CSV, one row per combination")
    parser.add_argument(
        "--cache",
        metavar="FOLDER",
        type=Path,
        help="keep results here; an interrupted sweep continues where it stopped (default: the user's cache folder)",
    )
    add_cluster_arguments(parser)
    add_parameter_arguments(parser, "NAME=VALUE,...", SET_MANY)


def run(args: argparse.Namespace) -> int:
    """Try all combinations, print a table and write what was asked for."""
    from topo_region_seg.offline.cli.console import note, progress, waiting
    from topo_region_seg.offline.cli.interrupt import stop_request
    from topo_region_seg.offline.evaluation.cache import ResultCache, default_folder
    from topo_region_seg.offline.evaluation.jobs import Job
    from topo_region_seg.offline.evaluation.sweep import Sweep

    grid = grid_from(args)
    _prepare(args)
    sources = sources_from(args)
    jobs = [Job(source, combination.params) for combination in grid for source in sources]
    with waiting("looking for cached results"):
        sweep = Sweep(jobs, ResultCache(args.cache or default_folder()))
    note(
        f"{_several(len(grid), 'combination')} x {_several(len(sources), 'recording')}: {len(jobs)} runs, "
        f"{sweep.cached} of them in the cache"
    )
    if len(sources) == 1 and not sweep.clouds and not sweep.cached:
        raise ToolError(sweep.results[0].error)
    interrupted = False
    if sweep.clouds:
        with runner_from(args) as runner, stop_request() as stop, progress("sweeping", sweep.clouds) as step:
            sweep.run(runner, step, stop.is_set, note)
            interrupted = stop.is_set()
    outcomes = _outcomes(grid, len(sources), sweep.results)
    if any(outcome.frames for outcome in outcomes):
        _show(args, outcomes, cached=sweep.cached, computed=sweep.computed)
    note_notices(sweep.results.values())
    for result in _distinct(sweep.results):
        note_troubles(result, most=3)
    if interrupted:
        note("interrupted: the same command continues from here")
        return status.INTERRUPTED
    return status_of(list(sweep.results.values()))


def _prepare(args: argparse.Namespace) -> None:
    """Refuse outputs that cannot be written, before the work begins."""
    from topo_region_seg.offline.cli import sweep_output  # noqa: F401 - what it needs may be missing
    from topo_region_seg.offline.cli.console import check_picture, check_writable

    if args.output:
        try:
            args.output.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ToolError(f"{args.output}: cannot be created ({error.strerror}); choose another place") from None
        args.csv = args.csv or args.output / "sweep.csv"
        args.json = args.json or args.output / "sweep.json"
        args.plot = args.plot or args.output / "sweep.png"
    for file in (args.csv, args.json):
        if file:
            check_writable(file)
    check_picture(args.plot)


def _outcomes(grid: list[Combination], bags: int, results: dict[int, BagResult]) -> list[Outcome]:
    """Return the combinations that are complete for all recordings, the best first."""
    from topo_region_seg.offline.cli.sweep_output import Outcome

    outcomes = []
    for number, combination in enumerate(grid):
        found = [results[place] for place in range(number * bags, (number + 1) * bags) if place in results]
        if len(found) == bags:
            outcomes.append(Outcome(combination, found))
    return sorted(outcomes, key=lambda outcome: outcome.order)


def _show(args: argparse.Namespace, outcomes: list[Outcome], *, cached: int, computed: int) -> None:
    from topo_region_seg.offline.cli.console import output, write_whole
    from topo_region_seg.offline.cli.sweep_output import csv_text, json_text, sweep_table
    from topo_region_seg.offline.figures.sweep import plot_sweep

    output().print(sweep_table(outcomes))
    best = outcomes[0]
    print(f"best: {best.combination.text} (WOv {best.mean['wov'] or 0.0:.3f})")
    if args.csv:
        write_whole(args.csv, csv_text(outcomes))
    if args.json:
        write_whole(args.json, json_text(outcomes, cached=cached, computed=computed))
    drawn = [o for o in outcomes if o.ms is not None and o.mean["wov"] is not None]
    if args.plot and drawn:
        names = [outcome.combination.text for outcome in drawn]
        plot_sweep([o.ms or 0.0 for o in drawn], [o.mean["wov"] or 0.0 for o in drawn], names, args.plot)
    for written in (args.csv, args.json, args.plot if drawn else None):
        if written:
            print(f"wrote {written}")


def _distinct(results: dict[int, BagResult]) -> list[BagResult]:
    """Return one result for each set of problems: most are the same for every combination."""
    found: dict[object, BagResult] = {}
    for result in results.values():
        problems = result.error, tuple(result.rejected), tuple(result.problems), result.truncated, result.without_truth
        found.setdefault((result.bag, problems), result)
    return list(found.values())


def _several(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
