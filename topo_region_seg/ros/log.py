# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The log: where it goes, and warnings that come with a reason code: once, or at most once in a while."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rclpy.impl.rcutils_logger import RcutilsLogger


def unwritable_folder() -> str | None:
    """Return why rcl could not write its log files, None if it can; it ends the process where it cannot."""
    chosen, home = os.environ.get("ROS_LOG_DIR"), os.environ.get("ROS_HOME")
    folder = Path(chosen) if chosen else Path(home or "~/.ros") / "log"
    try:
        folder = folder.expanduser()
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError) as error:
        return f"{folder}: {getattr(error, 'strerror', None) or error}"
    return None if os.access(folder, os.W_OK) else f"{folder}: not writable"


class ReasonLog:
    """Log warnings by reason, so that one reason cannot hide another. Safe to use from several threads.

    Parameters
    ----------
    logger : RcutilsLogger
        Where the warnings go; kept as `logger`.
    period : callable
        Returns the least time between two warnings with the same reason, seconds.
    """

    def __init__(self, logger: RcutilsLogger, period: Callable[[], float]) -> None:
        self.logger = logger
        self._period = period
        self._lock = threading.Lock()
        self._last: dict[str, float] = {}
        self._held_back: dict[str, int] = {}

    def throttled(self, reason: str, text: str | Callable[[], str]) -> None:
        """Warn, unless the same reason was warned of less than a period ago; the next warning tells how many.

        A callable is called for the text only where there is a warning.
        """
        with self._lock:
            now = time.monotonic()
            if now - self._last.get(reason, float("-inf")) < self._period():
                self._held_back[reason] = self._held_back.get(reason, 0) + 1
                return
            self._last[reason] = now
            held_back = self._held_back.pop(reason, 0)
        more = f" (and {held_back} more since the last warning)" if held_back else ""
        self.logger.warning(f"[{reason}] {text if isinstance(text, str) else text()}{more}")

    def told(self, reason: str, text: str) -> None:
        """Say something that is no trouble, unless the same reason was told or warned of before."""
        if self._first(reason):
            self.logger.info(f"[{reason}] {text}")

    def once(self, reason: str, text: str) -> None:
        """Warn, unless the same reason was warned of before."""
        if self._first(reason):
            self.logger.warning(f"[{reason}] {text}")

    def _first(self, reason: str) -> bool:
        with self._lock:
            first = reason not in self._last
            self._last.setdefault(reason, time.monotonic())
        return first
