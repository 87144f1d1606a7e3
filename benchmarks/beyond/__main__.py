# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line: runs the parts; with --publish puts each part's tables and pictures into docs/.

A part is a module of this folder with ``TITLE``, ``DOCUMENT`` (its file in docs/) and
``measure(setting, images) -> str``, which draws into the folder `images` and returns Markdown tables.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import tempfile
import time
from datetime import date
from pathlib import Path

from benchmarks import machine
from benchmarks.results import Setting

PARTS = ("regions", "objects", "tracking", "supervoxels", "steadiness", "auto_radius")
DOCUMENTS = Path(__file__).resolve().parents[2] / "docs"
BEGIN, END = "<!-- measured: written by `make beyond` -->\n", "<!-- end of measured -->\n"


def main(arguments: list[str] | None = None) -> int:
    """Run the parts; return 0 if all ran, 1 if some failed."""
    options = _parser().parse_args(arguments)
    status = 0
    with tempfile.TemporaryDirectory(prefix="beyond-") as folder:
        for name in options.only or PARTS:
            part = importlib.import_module(f"benchmarks.beyond.{name}")
            print(part.TITLE, flush=True)
            started = time.monotonic()
            images = DOCUMENTS / "images" if options.publish else Path(folder, "images")
            images.mkdir(parents=True, exist_ok=True)
            try:
                measured = part.measure(Setting(options.quick, Path(folder)), images)
            except Exception as error:
                if options.debug:
                    raise
                print(f"benchmarks.beyond: error: {name}: {type(error).__name__}: {error}", file=sys.stderr)
                status = 1
                continue
            print(f"{measured}\n  in {time.monotonic() - started:.0f} s", flush=True)
            if options.publish:
                document = DOCUMENTS / part.DOCUMENT
                document.write_text(with_measured(document.read_text(encoding="utf-8"), measured), encoding="utf-8")
                print(f"wrote {document}", flush=True)
    return status


def with_measured(document: str, measured: str, begin: str = BEGIN, end: str = END) -> str:
    """Return the text of a document with `measured` between the lines `begin` and `end`.

    Raises
    ------
    ValueError
        If the markers are missing.
    """
    before, begun, rest = document.partition(begin)
    _, ended, after = rest.partition(end)
    if not begun or not ended:
        raise ValueError(f"the document lacks the lines '{begin.strip()}' and '{end.strip()}'")
    on = machine.describe()
    line = f"Measured on {date.today().isoformat()}, {on['cpu']}, {on['cores']} cores, commit {on['commit']}."
    return f"{before}{begin}\n{measured.strip()}\n\n{line}\n\n{end}{after}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m benchmarks.beyond", description="Measure what goes beyond the paper.")
    parser.add_argument("--quick", action="store_true", help="fewer frames and repetitions, for a look")
    parser.add_argument("--only", action="append", choices=PARTS, help="run this part alone; may be repeated")
    parser.add_argument("--publish", action="store_true", help="write tables and pictures into docs/")
    parser.add_argument("--debug", action="store_true", help="stop at the first error, with a traceback")
    return parser


if __name__ == "__main__":
    sys.exit(main())
