# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``topo_region_seg compile``: fill the cache of compiled kernels, as a step of an installation."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time

from topo_region_seg.compiled.cache import cache_folder, environment
from topo_region_seg.compiled.threads import cores
from topo_region_seg.offline.cli import status
from topo_region_seg.offline.cli.status import ToolError

PROCESSES = (
    ("pipeline.warm_up(['regions'])",),
    ("oriented.warm_up_boxes()", "surfaces.warm_up_surfaces()", "pipeline.warm_up(['objects', 'supervoxels'])"),
)
"""What compiles about half of the kernels each; those that both need are compiled by who comes first."""
LAST = ("pipeline.warm_up()",)
IMPORTS = "from topo_region_seg import pipeline; from topo_region_seg.beyond.boxes import oriented, surfaces; "


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.epilog = "example: NUMBA_CACHE_DIR=/opt/kernels topo_region_seg compile"


def run(args: argparse.Namespace) -> int:
    """Compile in several processes, then see that all is there."""
    folder = cache_folder()
    if folder is None:
        raise ToolError("no folder for compiled kernels can be written to; set NUMBA_CACHE_DIR to one")
    before, started = _count(folder), time.monotonic()
    together = PROCESSES if cores() > 1 else ()
    for calls in (together, (LAST,)):
        children = [_child(part) for part in calls]
        try:
            for child in children:
                _, errors = child.communicate()
                if child.returncode:
                    raise ToolError(f"the kernels cannot be compiled: {_reason(errors, child.returncode)}")
        finally:
            for child in children:
                child.kill()
    seconds, new = time.monotonic() - started, _count(folder) - before
    print(f"{new} kernels compiled in {seconds:.0f} s into {folder}" if new else f"all kernels are in {folder}")
    return status.DONE


def _reason(errors: str, code: int) -> str:
    """Return the line of a traceback that says most."""
    lines = [line for line in errors.splitlines() if line.strip() and not line.startswith(" ")]
    return next((line for line in lines if "Error" in line), lines[-1] if lines else f"exit status {code}")


def _child(calls: tuple[str, ...]) -> subprocess.Popen[str]:
    code = IMPORTS + "; ".join(calls)
    return subprocess.Popen([sys.executable, "-c", code], env=environment(), stderr=subprocess.PIPE, text=True)


def _count(folder: os.PathLike[str]) -> int:
    return sum(name.endswith(".nbc") for _, _, names in os.walk(folder) for name in names)
