# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Compare what two revisions make of the same clouds and recordings, bit for bit, and how long they take.

Usage: ``python scripts/compare_revisions.py BASE [--quick] [--data DIR] [--time N] [--json FILE]``

BASE is any name that git knows; it is compared with these sources as they are, changes that are not committed
included. Compared are labels, components with their deaths, barcodes, tables of regions, features, adjacency and cuts
at other scales from the Python API, and the encoded messages of every topic that ``replay`` writes. Parameters of the
result are not compared, nor is adjacency where the scale is chosen for each cloud.

Exit status: 0 all equal; 1 something differs; 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from dataclasses import asdict
from itertools import chain, islice
from pathlib import Path

from revision_comparison.comparison import Comparison, Outcome
from revision_comparison.cpu_time import ROUNDS, Timing, measure
from revision_comparison.inputs import BAGS, ROOT, SIMULATED_BAG, recorded, stored
from revision_comparison.revisions import RevisionError, Worker, unpacked

DATA = ROOT.parent / "shared" / "data"
TIMED_CLOUDS = 3


def parsed() -> argparse.Namespace:
    """Return the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("base", metavar="BASE", help="the revision to compare with")
    parser.add_argument("--quick", action="store_true", help="a few clouds only, in about a minute")
    parser.add_argument("--data", type=Path, default=DATA, help="folder of real data (default: %(default)s)")
    parser.add_argument(
        "--time", metavar="N", type=int, default=0, help="measure the CPU time too: N runs of each output a round"
    )
    parser.add_argument("--only-time", action="store_true", help="compare no results")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write what was found for machines")
    args = parser.parse_args()
    if args.only_time and args.time < 1:
        parser.error("--only-time: say how many runs with --time N")
    if not args.data.is_dir():
        print(f"note: no data at {args.data}; only bags/ and the simulator are compared (--data DIR)")
    return args


def timed(tree: Path, data: Path, runs: int, folder: Path) -> list[Timing]:
    """Time the first clouds of a real recording, or of the simulated one."""
    bag = data / BAGS[0] if (data / BAGS[0]).exists() else SIMULATED_BAG
    clouds = [stored(cloud, folder) for cloud in islice(recorded(bag), TIMED_CLOUDS)]
    print(f"CPU time a cloud, first {TIMED_CLOUDS} of {bag.name}, {ROUNDS} rounds of {runs} runs of each", flush=True)
    times: list[Timing] = []
    for number, so_far in enumerate(measure((tree, ROOT), clouds, runs)):
        times = so_far
        print(f"round {number + 1} of {ROUNDS}", file=sys.stderr, flush=True)
    for timing in times:
        print(timing.line())
    return times


def main() -> int:
    """Compare, print and return the exit status."""
    args = parsed()
    started = time.monotonic()
    outcomes: list[Outcome] = []
    times: list[Timing] = []
    try:
        tree = unpacked(args.base)
        with tempfile.TemporaryDirectory() as folder, Worker(tree) as base, Worker(ROOT) as present:
            comparison = Comparison(base, present, Path(folder))
            print(f"{args.base} ({tree.name}) is compared with {ROOT}; loading or compiling the kernels", flush=True)
            comparison.start()
            if not args.only_time:
                quick = args.quick
                for outcome in chain(
                    comparison.clouds(args.data, quick=quick), comparison.replays(args.data, quick=quick)
                ):
                    print(outcome.line(), flush=True)
                    outcomes.append(outcome)
            if args.time:
                times = timed(tree, args.data, args.time, Path(folder))
    except RevisionError as error:
        print(f"compare_revisions: error: {error}", file=sys.stderr)
        return 2
    differing = sum(bool(outcome.problems) for outcome in outcomes)
    if outcomes:
        arrays = sum(outcome.compared for outcome in outcomes)
        print(
            f"{len(outcomes)} configurations, {arrays} arrays and messages compared in {time.monotonic() - started:.0f}"
            f" s: {f'{differing} differ' if differing else 'all equal, bit for bit'}"
        )
    if args.json:
        found = {"base": args.base, "outcomes": [*map(asdict, outcomes)], "times": [*map(asdict, times)]}
        args.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
