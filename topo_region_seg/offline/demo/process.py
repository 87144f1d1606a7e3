# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A process beside this one, its output in a file: started, watched and always ended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType

TAIL = 12  # lines of its log that a failure shows
PATIENCE = 5.0  # seconds for a process to end after a signal


class DemoError(Exception):
    """The demonstration cannot go on; the message says why, the log's last lines included."""


class Process:
    """A Python module run in a process of its own; a context manager that ends it.

    Parameters
    ----------
    name : str
        What to call it in messages.
    arguments : sequence of str
        What follows ``python -m``.
    log : Path
        File for its output.
    domain : int
        Its ROS domain, on this machine alone.
    """

    def __init__(self, name: str, arguments: Sequence[str], log: Path, domain: int) -> None:
        self.name = name
        self._log = log
        environment = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        with log.open("w", encoding="utf-8") as stream:
            self._process = subprocess.Popen(
                [sys.executable, "-m", *arguments],
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                env={**os.environ, **environment},
            )

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        return self._process.poll() is None

    def check(self, ended_is_fine: bool = False) -> None:
        """Raise :class:`DemoError` if it failed, or ended at all unless that is fine."""
        status = self._process.poll()
        if status is None or (status == 0 and ended_is_fine):
            return
        how = f"ended with status {status}" if status >= 0 else f"was ended by {signal.Signals(-status).name}"
        raise DemoError(f"{self.name} {how}; the end of {self._log}:\n{self.tail()}")

    def tail(self) -> str:
        """Return the last lines of its output."""
        lines = self._log.read_text(encoding="utf-8", errors="replace").splitlines()[-TAIL:]
        return "\n".join(f"    {line}" for line in lines) or "    (empty)"

    def stop(self) -> None:
        """End it: ask, then insist."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            if not self.running:
                return
            self._process.send_signal(number)
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(PATIENCE)

    def __enter__(self) -> Process:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
