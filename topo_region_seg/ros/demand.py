# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which clouds are to be processed: those that somebody wants, and no more of them than the limit allows."""

from __future__ import annotations

import time
from collections.abc import Callable

from topo_region_seg.ros.node_params import NodeParams
from topo_region_seg.ros.publishers import Outputs
from topo_region_seg.ros.segment_once import SegmentOnce

SETTLING = 1.0
"""Seconds after activation in which every cloud is processed: who subscribes already may not be known yet."""
KEPT_OPEN = 2.0
"""Seconds for which the node goes on listening to clouds that nobody wants: opening the input anew takes time."""
NOBODY, NOT_REQUESTED, RATE_LIMIT = "nobody subscribes", "not requested", "rate limit"
"""Why a cloud is passed over."""


class Demand:
    """Say whether clouds are wanted. Safe to use from several threads.

    Parameters
    ----------
    outputs : Outputs
        The topics.
    requests : SegmentOnce
        The service.
    params : callable
        Returns the node's parameters of this moment.

    Attributes
    ----------
    missed : bool
        Whether a cloud came that nobody got, since this was last set to false.
    """

    def __init__(self, outputs: Outputs, requests: SegmentOnce, params: Callable[[], NodeParams]) -> None:
        self._outputs = outputs
        self._requests = requests
        self._params = params
        self.missed = False
        self.start()

    def start(self) -> None:
        """Begin a new stretch of input."""
        self._settled = time.monotonic() + SETTLING
        self._wanted_at = time.monotonic()
        self._due = 0.0

    @property
    def reason(self) -> str:
        """Why no clouds are wanted, where none are."""
        return "waiting for ~/segment_once (on_request)" if self._params().on_request else NOBODY

    def wanted(self) -> bool:
        """Whether somebody wants clouds at this moment."""
        if self._requests.waiting() or (not self._params().on_request and self._outputs.wanted()):
            self._wanted_at = time.monotonic()
            return True
        return False

    def lapsed(self) -> bool:
        """Whether clouds come that nobody has wanted for so long that the input can be closed.

        An input without clouds costs nothing, and tells that there are none.
        """
        return self.missed and time.monotonic() - self._wanted_at > KEPT_OPEN

    def declined(self, arrived: float) -> str | None:
        """Return why the cloud that arrived at a time (monotonic clock, seconds) is passed over, None if it is not."""
        params = self._params()
        if self._requests.waiting(arrived):
            return None
        if params.on_request:
            self.missed = True
            return NOT_REQUESTED
        if not self._outputs.wanted():
            self.missed = True
            if time.monotonic() > self._settled:
                return NOBODY
        if params.rate_limit > 0.0:
            period = 1.0 / params.rate_limit
            if arrived < self._due:
                return RATE_LIMIT
            # From when it was due, so that the rate is kept on average; but what was missed is not made up for.
            self._due = (self._due if arrived < self._due + period else arrived) + period
        return None
