# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line: ``python -m benchmarks.tricks`` prints what each trick of the kernels gains."""

from __future__ import annotations

import argparse
import sys

from benchmarks import machine, recordings
from benchmarks.tricks import constants
from benchmarks.tricks.forms import FORMS
from benchmarks.tricks.race import best_times

WORTH = 1.1
"""How many times as long a stage must take without a trick for the trick to be worth its place."""


def main(arguments: list[str] | None = None) -> int:
    """Measure some forms, or all."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.what[:1] == ["constants"]:
        constants.show(options.what[1:])
        return 0
    print(f"first {recordings.source()} frame; load {machine.load()}; best processor times, ms", flush=True)
    unknown = [name for name in options.what if name not in FORMS]
    if unknown:
        parser.error(f"no trick is called {unknown[0]}; there are {', '.join(FORMS)}")
    for name in options.what or FORMS:
        form = FORMS[name]
        with_it, without = best_times([("", {}), (name, {})], form.stages)
        print(f"{form.words} (left out: {name})", flush=True)
        for stage in form.stages:
            times = without[stage] / with_it[stage]
            print(
                f"  {stage:14}{with_it[stage]:9.2f}{without[stage]:9.2f}{times:7.2f} times as long without", flush=True
            )
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m benchmarks.tricks", description="What each trick of the kernels gains.")
    parser.add_argument(
        "what",
        nargs="*",
        help=f"tricks to leave out, all by default: {', '.join(FORMS)}; or 'constants', and words of their names",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
