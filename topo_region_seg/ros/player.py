# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishes recorded clouds as a camera would: raw messages, at their times, once somebody listens."""

from __future__ import annotations

import signal
import struct
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2

from topo_region_seg.ros.memory import keep_freed_memory
from topo_region_seg.ros.transport import use_shared_memory_for_clouds

Clouds = Callable[[], Iterator[tuple[int, bytes]]]
"""Begins anew at each call; yields (time in ns, CDR bytes)."""

DEPTH = 5
ACKNOWLEDGE_TIMEOUT = 5.0
"""How long to wait at the end for the last clouds to be received, seconds."""


class NobodySubscribedError(Exception):
    """The wait for subscribers was given up."""


@dataclass(frozen=True)
class Playback:
    """How to publish.

    Parameters
    ----------
    topic : str
        Where to, relative or absolute.
    rate : float
        Speed as a factor of the recorded one.
    hz : float or None
        Clouds a second in place of the recorded times.
    loop : bool
        Begin anew at the end.
    reliable : bool
        Reliable or best effort.
    stamp_now : bool
        Put the present time into the headers.
    wait_for : int
        Start when this many subscribe.
    wait_timeout : float
        Longest wait for them, seconds.
    """

    topic: str
    rate: float = 1.0
    hz: float | None = None
    loop: bool = False
    reliable: bool = True
    stamp_now: bool = False
    wait_for: int = 1
    wait_timeout: float = float("inf")


def play(
    clouds: Clouds,
    playback: Playback,
    *,
    report: Callable[[str], None],
    step: Callable[[], None],
    ros_arguments: Sequence[str] = (),
) -> int:
    """Publish all clouds, and return how many; ends early on Ctrl-C, which is ignored from then on.

    Raises
    ------
    NobodySubscribedError
        Nobody came in time.
    """
    keep_freed_memory()
    use_shared_memory_for_clouds()
    rclpy.init(args=list(ros_arguments))
    published = 0
    node: Node | None = None
    try:
        node = Node("topo_region_seg_player")
        policy = ReliabilityPolicy.RELIABLE if playback.reliable else ReliabilityPolicy.BEST_EFFORT
        publisher = node.create_publisher(PointCloud2, playback.topic, QoSProfile(depth=DEPTH, reliability=policy))
        _wait_for_subscribers(node, publisher, playback, report)
        for data in _at_their_times(node, clouds, playback):
            publisher.publish(_stamped(node, data) if playback.stamp_now else data)
            published += 1
            step()
        # A reliable publisher that goes at once takes with it what was not received yet.
        if playback.reliable and published:
            publisher.wait_for_all_acked(Duration(seconds=ACKNOWLEDGE_TIMEOUT))
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except rclpy_implementation.RCLError:
        # A signal that comes inside of publish() leaves no other trace than its dead context.
        if node is None or node.context.ok():
            raise
    finally:
        # All is done: what stops a launch now must find an end like any other, not one by a signal.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        rclpy.try_shutdown()
    return published


def _wait_for_subscribers(node: Node, publisher: Publisher, playback: Playback, report: Callable[[str], None]) -> None:
    give_up = time.monotonic() + playback.wait_timeout
    waiting = False
    while (count := publisher.get_subscription_count()) < playback.wait_for:
        if time.monotonic() > give_up:
            raise NobodySubscribedError(
                f"{count} of {playback.wait_for} subscribed to {publisher.topic_name} in {playback.wait_timeout:g} s"
            )
        if not waiting:
            waiting = True
            who = "a subscriber" if playback.wait_for == 1 else f"{playback.wait_for} subscribers"
            report(f"waiting for {who} of {publisher.topic_name} (Ctrl-C ends)")
        # Spinning also lets the middleware log subscribers whose QoS does not match.
        rclpy.spin_once(node, timeout_sec=0.05)


def _at_their_times(node: Node, clouds: Clouds, playback: Playback) -> Iterator[bytes]:
    """Yield each cloud when it is due; the next one is read before the wait, so that reading does not delay it."""
    while True:
        first: int | None = None
        start = time.monotonic()
        count = 0
        for log_time, data in clouds():
            first = log_time if first is None else first
            due = count / playback.hz if playback.hz else (log_time - first) * 1e-9 / playback.rate
            _sleep_until(node, start + due)
            yield data
            count += 1
            last_due = due
        if not playback.loop or count == 0:
            return
        # The pause before the first cloud of the next round is the mean of those between the clouds.
        pause = 1.0 / playback.hz if playback.hz else last_due / (count - 1) if count > 1 else 1.0 / playback.rate
        _sleep_until(node, start + last_due + pause)


def _sleep_until(node: Node, due: float) -> None:
    while (left := due - time.monotonic()) > 0.0:
        if not node.context.ok():
            raise ExternalShutdownException
        time.sleep(min(left, 0.1))


def _stamped(node: Node, data: bytes) -> bytes:
    """Return the message with the present time in its header, which lies first, after 4 bytes of encapsulation."""
    sec, nanosec = node.get_clock().now().seconds_nanoseconds()
    order = "<" if data[1] & 1 else ">"
    return data[:4] + struct.pack(f"{order}iI", sec, nanosec) + data[12:]
