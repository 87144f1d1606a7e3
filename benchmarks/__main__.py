# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line of the benchmark: runs the parts, keeps their results, writes the report."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import tempfile
import time
from datetime import date
from pathlib import Path
from typing import Any

from benchmarks import machine, pcl_peers, plots, report
from benchmarks.checks import DisagreementError
from benchmarks.results import Setting

PARTS = (
    "filtration",
    "scaling",
    "worst_cases",
    "frames",
    "end_to_end",
    "memory",
    "start",
    "table_one",
    "replay",
    "any_radius",
)
ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "benchmarks" / "results"
DOCUMENTS = ROOT / "docs"
MARKS = {True: "yes", False: "NO", None: "--"}


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark; return 0 if all parts ran, 1 if some failed or programs disagreed."""
    options = _parser().parse_args(arguments)
    document = options.output / "benchmarks.json"
    parts = json.loads(document.read_text(encoding="utf-8")) if document.exists() and options.only else {}
    options.output.mkdir(parents=True, exist_ok=True)
    status = 0
    with tempfile.TemporaryDirectory(prefix="benchmark-") as folder:
        for name in options.only or PARTS:
            try:
                parts[name] = run_part(name, Setting(options.quick, Path(folder)))
            except Exception as error:
                if options.debug:
                    raise
                kind = "results differ" if isinstance(error, DisagreementError) else type(error).__name__
                print(f"benchmarks: error: {name}: {kind}: {error}", file=sys.stderr, flush=True)
                status = 1
    parts = {name: parts[name] for name in PARTS if name in parts}
    document.write_text(json.dumps(parts, indent=1) + "\n", encoding="utf-8")
    pictures = plots.draw(parts, options.output / "images")
    text = report.markdown(parts, pictures)
    (options.output / "benchmarks.md").write_text(text, encoding="utf-8")
    print(f"wrote {options.output / 'benchmarks.md'}, {document.name} and {len(pictures)} pictures")
    return status


def run_part(name: str, setting: Setting) -> dict[str, Any]:
    """Measure one part and print its goals; return all that is known of it, as JSON can carry it."""
    part = importlib.import_module(f"benchmarks.parts.{name}")
    print(f"{part.TITLE}", flush=True)
    before, pace, started = machine.load(), machine.pace(), time.monotonic()
    result = part.measure(setting)
    seconds = time.monotonic() - started
    for line in result.lines:
        print(f"  {MARKS[line.reached]:4}{line.goal} -- {line.figure} ({line.on})")
    print(f"  in {seconds:.0f} s", flush=True)
    return {
        "title": part.TITLE,
        "date": date.today().isoformat(),
        "quick": setting.quick,
        "seconds": round(seconds, 1),
        "load_before": before,
        "load_after": machine.load(),
        "pace_ms": [pace, machine.pace()],
        "machine": {**machine.describe(), "pcl": pcl_peers.version()},
        **result.as_dict(),
    }


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m benchmarks", description="Measure, beside other programs.")
    parser.add_argument("--quick", action="store_true", help="fewer clouds and repetitions: under two minutes")
    parser.add_argument(
        "--only", action="append", choices=PARTS, help="run this part alone, keep the others' results; may be repeated"
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=RESULTS,
        metavar="FOLDER",
        help="for benchmarks.json, .md and images (%(default)s)",
    )
    parser.add_argument(
        "--publish", action="store_const", const=DOCUMENTS, dest="output", help=f"the same as --output {DOCUMENTS}"
    )
    parser.add_argument("--debug", action="store_true", help="stop at the first error, with a traceback")
    return parser


if __name__ == "__main__":
    sys.exit(main())
