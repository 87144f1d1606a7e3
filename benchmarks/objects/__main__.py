# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line: measures all data sets, prints a row for each frame, and keeps all figures as JSON."""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from statistics import fmean, median
from typing import Any

from benchmarks.objects.datasets import data_sets
from benchmarks.objects.frame import measure_frame
from topo_region_seg.offline.cli.parameters import read_value, split_assignment
from topo_region_seg.params import Params
from topo_region_seg.pipeline import warm_up

RESULTS = Path(__file__).resolve().parents[1] / "results" / "objects.json"
SHOWN = {
    "WOv": "wov",
    "Fos": "fos",
    "Fus": "fus",
    "ovl P": "overlap_precision",
    "ovl R": "overlap_recall",
    "ovl F": "overlap_f",
    "F75": "f75",
    "P@.5": "precision_50",
    "R@.5": "recall_50",
    "bnd F": "boundary_f",
    "rep.": "reported",
    "true": "true",
    "CPU ms": "cpu_ms",
}


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark; return 0."""
    options = _parser().parse_args(arguments)
    values: dict[str, Any] = {"output": "objects"}
    for assignment in options.set:
        row, text = split_assignment(assignment)
        values[row.name] = read_value(row, text)
    params = Params.from_mapping(values)
    found: dict[str, dict[str, Any]] = {}
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(options.jobs, spawn, initializer=warm_up) as pool:
        for name, data in data_sets().items():
            if options.only and name not in options.only:
                continue
            if data.missing:
                print(f"{name}: left out, {data.missing}")
                continue
            tasks = [pool.submit(measure_frame, name, frame, params, options.repeats) for frame in data.names]
            found[name] = {frame: task.result() for frame, task in zip(data.names, tasks, strict=True)}
            _print(data.title, found[name])
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps({"set": options.set, "data": found}, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {options.json}")
    return 0


def _print(title: str, frames: dict[str, Any]) -> None:
    print(f"\n{title}\n{'':28}" + "".join(f"{head:>8}" for head in SHOWN))
    for name, one in frames.items():
        print(f"{name + ', ' + one['kind']:28.28}" + "".join(_cell(one[key]) for key in SHOWN.values()))
    every = list(frames.values())
    print(f"{'mean':28}" + "".join(_cell(_mean([one[key] for one in every])) for key in SHOWN.values()))
    if any("whole_wov" in one for one in every):
        whole = [_mean([one.get(f"whole_{key}", one.get(key)) for one in every]) for key in SHOWN.values()]
        print(f"{'mean, whole objects':28}" + "".join(map(_cell, whole)))
    times = [one["cpu_ms"] for one in every]
    print(f"CPU: median {median(times):.1f} ms, worst {max(times):.1f} ms", flush=True)


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return fmean(known) if known else None


def _cell(value: float | None) -> str:
    if value is None:
        return f"{'n/a':>8}"
    return f"{value:8d}" if isinstance(value, int) else f"{value:8.3f}" if value < 10 else f"{value:8.1f}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m benchmarks.objects", description="Measure objects on all data sets.")
    parser.add_argument("--only", action="append", choices=[*data_sets()], help="this data set alone; may be repeated")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="set a parameter, to compare")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="processes at a time (%(default)s)")
    parser.add_argument("--repeats", type=int, default=1, metavar="N", help="timed runs of a frame (%(default)s)")
    parser.add_argument("--json", type=Path, default=RESULTS, metavar="FILE", help="for all figures (%(default)s)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
