# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""SIGINT and SIGTERM, taken by a thread of their own, so that neither tears what the others are doing.

Imports little, as a signal that comes before it is at work ends the process with a traceback.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from typing import NoReturn

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Ending:
    """Take the signals that end a process, from now on; to be made in the main thread before there are others.

    Until :meth:`by` is called there is nothing to clean up, and the process ends at once with status 0.

    Attributes
    ----------
    requested : threading.Event
        Set by the first signal.
    """

    def __init__(self) -> None:
        self.requested = threading.Event()
        self._lock = threading.Lock()
        self._end: Callable[[], object] = _at_once
        # Threads inherit the mask, so that no other one gets a signal.
        signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        threading.Thread(target=self._wait, name="signals", daemon=True).start()

    def by(self, end: Callable[[], object]) -> None:
        """Call `end`, on the thread of the signals, when the first one comes; further ones change nothing."""
        with self._lock:
            self._end = end

    def _wait(self) -> None:
        signal.sigwait(SIGNALS)
        with self._lock:
            self.requested.set()
            self._end()


def _at_once() -> NoReturn:
    os._exit(0)
