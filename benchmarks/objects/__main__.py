# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line: measures all data sets, prints tables, keeps all figures as JSON, writes them into docs/objects.md.

``python -m benchmarks.objects --set object_radius=0.012 --json b.json --against a.json`` compares with an earlier run,
``python -m benchmarks.objects --ablate`` with runs in which one part of the method after the other is switched off.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks import pcl_peers
from benchmarks.beyond.__main__ import with_measured
from benchmarks.machine import describe
from benchmarks.objects.ablations import PARTS
from benchmarks.objects.changes import changes
from benchmarks.objects.datasets import data_sets
from benchmarks.objects.frame import measure_frame
from benchmarks.objects.pictures import draw_low
from benchmarks.objects.programs import OURS, PEERS
from benchmarks.objects.tables import markdown, means, terminal, usual_ms
from topo_region_seg.offline.cli.parameters import read_value, split_assignment
from topo_region_seg.params import Params
from topo_region_seg.pipeline import warm_up

RESULTS = Path(__file__).resolve().parents[1] / "results" / "objects.json"
DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "objects.md"
BEGIN, END = "<!-- data sets: written by `python -m benchmarks.objects --publish` -->\n", "<!-- end of data sets -->\n"
NAMES = ("tabletop", "scenes", "simulated")
REPEATS = 5
"""Timed runs of a frame for publishing."""


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark; return 0 if every frame could be measured, else 1."""
    options = _parser().parse_args(arguments)
    params = params_from(options.set)
    peers = _peers(options.peers or options.publish)
    parts = list(PARTS) if options.ablate else []
    repeats = options.repeats or (REPEATS if options.publish else 1)
    found: dict[str, dict[str, dict[str, Any]]] = {}
    status = 0
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(options.jobs, spawn, initializer=warm_up) as pool:
        tasks: dict[str, dict[str, Future[dict[str, Any]]]] = {}
        sets = data_sets()
        for name in options.only or NAMES:
            if sets[name].missing:
                print(f"{name}: left out, {sets[name].missing}", flush=True)
                continue
            tasks[name] = {
                frame: pool.submit(measure_frame, name, frame, params, repeats, peers, parts)
                for frame in sets[name].names[:: options.every]
            }
        for name, frames in tasks.items():
            found[name] = {}
            for frame, task in frames.items():
                try:
                    found[name][frame] = task.result()
                except Exception as error:
                    status = 1
                    print(f"benchmarks.objects: error: {frame}: {type(error).__name__}: {error}", file=sys.stderr)
            print(
                terminal(sets[name].title, {frame: one[OURS] for frame, one in found[name].items()}) + "\n", flush=True
            )
    print(means(found, [OURS, *peers, *parts]))
    _print_time(found)
    options.json.parent.mkdir(parents=True, exist_ok=True)
    kept = {"set": options.set, "machine": describe(), "data": found}
    options.json.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {options.json}")
    if options.against:
        before = json.loads(options.against.read_text(encoding="utf-8"))["data"]
        print(f"\nfrom {options.against}:\n{changes(before, found)}")
    if options.pictures:
        for path in draw_low(found, params, options.pictures):
            print(f"wrote {path}")
    if options.publish:
        document = DOCUMENT.read_text(encoding="utf-8")
        text = markdown(found, [OURS, *peers])
        DOCUMENT.write_text(with_measured(document, text, BEGIN, END), encoding="utf-8")
        print(f"wrote {DOCUMENT}")
    return status


def params_from(assignments: list[str]) -> Params:
    """Return the parameters: objects, and what the assignments change."""
    values: dict[str, Any] = {"output": "objects"}
    for assignment in assignments:
        row, text = split_assignment(assignment)
        values[row.name] = read_value(row, text)
    return Params.from_mapping(values)


def _peers(wanted: bool) -> list[str]:
    if not wanted:
        return []
    try:
        pcl_peers.program()
    except pcl_peers.NoPclError as error:
        print(f"without other programs: {error}", flush=True)
        return []
    return list(PEERS)


def _print_time(found: dict[str, dict[str, dict[str, Any]]]) -> None:
    usual = usual_ms(found)
    for name, frames in found.items():
        times = {one[OURS]["cpu_ms"]: frame for frame, one in frames.items()}
        if times:
            ratio = f", {max(times) / usual:.1f} times the median tabletop" if usual else ""
            print(f"CPU, {name}: median {median(times):.0f} ms, worst {max(times):.0f} ms ({times[max(times)]}){ratio}")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m benchmarks.objects", description="Measure objects on all data sets.")
    parser.add_argument("--only", action="append", choices=NAMES, help="this data set alone; may be repeated")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="set a parameter, to compare")
    parser.add_argument("--peers", action="store_true", help="run PCL's programs too, if PCL is installed")
    parser.add_argument("--ablate", action="store_true", help="run without each part of the method, too")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="processes at a time (%(default)s)")
    parser.add_argument("--repeats", type=int, metavar="N", help="timed runs of a frame (1; for --publish 5)")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="only each N-th frame, for a look")
    parser.add_argument("--json", type=Path, default=RESULTS, metavar="FILE", help="for all figures (%(default)s)")
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare with the figures of an earlier run")
    parser.add_argument(
        "--pictures", type=Path, metavar="FOLDER", help="draw the frames with a weighted overlap below 0.6"
    )
    parser.add_argument("--publish", action="store_true", help=f"with --peers; write the tables into {DOCUMENT.name}")
    return parser


if __name__ == "__main__":
    sys.exit(main())
