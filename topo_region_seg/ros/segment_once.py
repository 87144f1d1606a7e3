# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The service `~/segment_once`: it has the next cloud processed, and answers when that is done."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode
from std_srvs.srv import Trigger


@dataclass(eq=False)
class _Request:
    """A request that waits for its answer; `header` names who asked."""

    response: Trigger.Response
    header: Any = None
    since: float = field(default_factory=time.monotonic)
    done: bool = False


class SegmentOnce:
    """Hold requests until a cloud that came after them has been processed, or until they have waited too long.

    rclpy answers a service with what its callback returns, and keeps a core busy while a callback that awaits is not
    done. So the callback returns at once, and what rclpy would send then is sent when there is something to say.

    Parameters
    ----------
    node : LifecycleNode
        The node that offers the service.
    name : str
        Name of the service.
    refusal : callable
        Returns why no cloud can be processed at present, None if one can.
    timeout : callable
        Returns the longest wait, seconds.
    """

    def __init__(
        self, node: LifecycleNode, name: str, refusal: Callable[[], str | None], timeout: Callable[[], float]
    ) -> None:
        self._node = node
        self._refusal = refusal
        self._timeout = timeout
        self._lock = threading.Lock()
        self._requests: list[_Request] = []
        self._service = node.create_service(Trigger, name, self._take)
        self._send = self._service.send_response
        self._service.send_response = self._send_or_hold
        # Answers leave on the executor's thread, whoever has them.
        self._finished = node.create_guard_condition(self._answer)

    def destroy(self) -> None:
        """Offer the service no longer."""
        self.give_up("the service is gone")
        self._node.destroy_service(self._service)
        self._node.destroy_guard_condition(self._finished)

    def waiting(self, arrived: float = float("inf")) -> bool:
        """Whether somebody waits for a cloud, or for one that arrived at a time (monotonic clock, seconds)."""
        with self._lock:
            return any(not request.done and request.since <= arrived for request in self._requests)

    def finish(self, arrived: float, success: bool, text: str) -> None:
        """Answer those who waited for the cloud that arrived at a time (monotonic clock, seconds)."""
        with self._lock:
            done = [request for request in self._requests if not request.done and request.since <= arrived]
            for request in done:
                request.response.success, request.response.message, request.done = success, text, True
        if done:
            self._finished.trigger()

    def give_up(self, text: str) -> None:
        """Answer all who wait that nothing comes of it."""
        self.finish(float("inf"), False, text)

    def expire(self, topic: str) -> None:
        """Answer those who have waited too long for a cloud on a topic; to be called now and then."""
        limit = self._timeout()
        self.finish(time.monotonic() - limit, False, f"no cloud came on {topic} and was processed within {limit:g} s")

    def _take(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if (text := self._refusal()) is not None:
            response.success, response.message = False, text
        else:
            with self._lock:
                self._requests.append(_Request(response))
        return response

    def _send_or_hold(self, response: Trigger.Response, header: Any) -> None:
        with self._lock:
            for request in self._requests:
                if request.response is response:
                    request.header = header
                    if request.done:
                        self._finished.trigger()
                    return
        self._send(response, header)

    def _answer(self) -> None:
        with self._lock:
            done = [request for request in self._requests if request.done and request.header is not None]
            self._requests = [request for request in self._requests if request not in done]
        for request in done:
            with suppress(rclpy_implementation.RCLError):  # who asked has gone
                self._send(request.response, request.header)
