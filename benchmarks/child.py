# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Functions run in processes of their own, whose memory and start are theirs alone.

``python -m benchmarks.child MODULE FUNCTION JSON`` calls the function and prints what it returns.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
MARK = "result: "


class ChildError(Exception):
    """The process failed; the message ends with the last of what it said."""


def call(
    module: str,
    function: str,
    *,
    environment: Mapping[str, str] | None = None,
    timeout: float = 1800.0,
    **arguments: Any,
) -> Any:
    """Call `benchmarks.MODULE.FUNCTION(**arguments)` in a new process; arguments and result are JSON."""
    command = ["-m", "benchmarks.child", f"benchmarks.{module}", function, json.dumps(arguments)]
    output = python(command, timeout, environment)
    return json.loads(output.rpartition(MARK)[2])


def python(
    arguments: list[str],
    timeout: float,
    environment: Mapping[str, str] | None = None,
) -> str:
    """Run Python and return what it printed on both streams; raise :class:`ChildError` if it fails."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        env={**os.environ, **(environment or {})},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=timeout,
        check=False,
    )
    if done.returncode:
        raise ChildError(f"{' '.join(arguments[:4])} ended with {done.returncode}: {done.stdout.strip()[-800:]}")
    return done.stdout


def reset_peak() -> None:
    """Let the peak of this process's memory start over, with nothing set aside by the allocator."""
    ctypes.CDLL(None).malloc_trim(0)
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def memory() -> tuple[int, int]:
    """Return the present and the peak resident memory of this process, bytes."""
    fields = dict(
        line.split(":", 1) for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines() if ":" in line
    )
    return int(fields["VmRSS"].split()[0]) * 1024, int(fields["VmHWM"].split()[0]) * 1024


def main() -> None:
    """Call the function that the arguments name."""
    module, function, arguments = sys.argv[1:4]
    result = getattr(importlib.import_module(module), function)(**json.loads(arguments))
    print(MARK + json.dumps(result), flush=True)


if __name__ == "__main__":
    main()
