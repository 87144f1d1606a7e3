# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line: ``python -m benchmarks.tricks`` prints what each trick of the kernels gains."""

from __future__ import annotations

import argparse
import sys

from benchmarks import machine, recordings
from benchmarks.tricks.forms import FORMS
from benchmarks.tricks.race import best_times

WORTH = 1.1
"""How many times as long a stage must take without a trick for the trick to be worth its place."""


def main(arguments: list[str] | None = None) -> int:
    """Measure some forms, or all."""
    options = _parser().parse_args(arguments)
    print(f"first {recordings.source()} frame; load {machine.load()}; best processor times, ms", flush=True)
    for name in options.forms or FORMS:
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
    parser.add_argument("forms", nargs="*", choices=[*FORMS, []], metavar="form", help=f"one of: {', '.join(FORMS)}")
    return parser


if __name__ == "__main__":
    sys.exit(main())
