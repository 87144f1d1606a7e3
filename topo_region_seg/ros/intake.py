# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The input of an active node: open while somebody wants what is made of its clouds.

A subscription costs a fifth of a core for clouds of 640x480 points at 30 Hz, whatever is done with them.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

from topo_region_seg.ros.demand import Demand
from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.input import FrameSource

STOP_SECONDS = 5.0
"""How long a transition or the end of the process waits for the frame being processed."""


class Intake:
    """Open and close the input by demand; nothing is open before :meth:`start`.

    Parameters
    ----------
    feed : Feed
        The camera's: its rates begin anew with each input.
    make : callable
        Makes the input.
    demand : Demand
        Says whether clouds are wanted.
    """

    def __init__(self, feed: Feed, make: Callable[[], FrameSource], demand: Demand) -> None:
        self._logger = feed.log.logger
        self._make = make
        self._demand = demand
        self._statistics = feed.statistics
        self._log = feed.log
        # Whoever activates the node may do so on another thread than the timer's.
        self._lock = threading.RLock()
        self._active = False
        self._input: FrameSource | None = None

    @property
    def input(self) -> FrameSource | None:
        """What is open at present."""
        return self._input

    @property
    def asleep(self) -> str | None:
        """Why an active node takes no clouds, None where it does or is not active."""
        return self._demand.reason if self._active and self._input is None else None

    def start(self) -> FrameSource:
        """Open the input, whoever wants it: who subscribes may not be known yet.

        Raises
        ------
        ParameterError
            A QoS override is invalid.
        """
        with self._lock:
            self._demand.start()
            self._input = self._open()
            self._active = True
            return self._input

    def follow(self) -> None:
        """Open or close the input as the demand is; to be called some times a second."""
        with self._lock:
            if not self._active:
                return
            wanted = self._demand.wanted()
            if self._input is None and wanted:
                self._reopen()
            elif self._input is not None and wanted and self._demand.missed and self._input.hears_the_past:
                # What was published before somebody wanted it comes once more.
                self._input.close(STOP_SECONDS)
                self._input = None
                self._reopen()
            elif self._input is not None and not wanted and self._demand.lapsed():
                self._logger.info(f"{self._demand.reason}: not listening to {self._input.topic} meanwhile")
                self._input.close(STOP_SECONDS)
                self._input = None

    def close(self) -> bool:
        """Close the input for good; return whether the running frame ended within :data:`STOP_SECONDS`."""
        with self._lock:
            ended = True
            if self._input is not None:
                ended = self._input.close(STOP_SECONDS)
            self._active, self._input = False, None
            return ended

    def _reopen(self) -> None:
        try:
            self._input = self._open()
        except Exception as error:  # of the middleware, which may have room again the next time
            self._log.throttled("input_not_opened", f"cannot listen to clouds: {type(error).__name__}: {error}")
        else:
            self._logger.info(f"{self._input.what} are wanted: listening to {self._input.topic}")

    def _open(self) -> FrameSource:
        self._statistics.restart()
        self._demand.missed = False
        return self._make()
