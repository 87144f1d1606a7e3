# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A child process with its output in a file; it always ends with the demonstration."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType

TAIL = 12  # last lines of the log in an error message
PATIENCE = 5.0  # seconds for a process to end after a signal


class DemoError(Exception):
    """The demonstration cannot go on; the message says why, with the last lines of the log."""


class Process:
    """A Python module in a child process; a context manager that ends it.

    Parameters
    ----------
    name : str
        Its name in messages.
    arguments : sequence of str
        Arguments after ``python -m``.
    log : Path
        File for its output.
    domain : int
        Its ROS domain, on this machine only.
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
        """Raise :class:`DemoError` if it failed, or if it ended at all unless that is fine."""
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
        """End it, with stronger signals if it does not react."""
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
