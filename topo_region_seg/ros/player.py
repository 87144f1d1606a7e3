# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishes recorded clouds or images as a camera would: raw messages, at their times, once somebody listens."""

from __future__ import annotations

import signal
import struct
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy

from topo_region_seg.ros.listener import message_class
from topo_region_seg.ros.memory import keep_freed_memory
from topo_region_seg.ros.transport import SHARED_MEMORY, fast_dds, prepare_fast_dds

Images = Mapping[str, bytes]
"""What a camera sends at one time, CDR bytes by topic."""
Clouds = Callable[[], Iterator[tuple[int, bytes | Images]]]
"""Starts over at each call; yields (time in ns, CDR bytes of a cloud, or images)."""
T = TypeVar("T")

CLOUD = "sensor_msgs/msg/PointCloud2"
PACKINGS = ("compressedDepth", "compressed")
DEPTH = 5
ACKNOWLEDGE_TIMEOUT = 5.0
"""How long to wait at the end for the last clouds to be received, seconds."""
LONGEST_GAP, SHORT_GAP = 10.0, 1.0
"""Pauses between recorded clouds, seconds: longer than any that a camera makes, and what is made of them."""


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
        Start over at the end.
    reliable : bool
        Reliable or best effort.
    stamp_now : bool
        Put the present time into the headers.
    wait_for : int
        Start when this many subscribe.
    wait_timeout : float
        Longest wait for them, seconds.
    images : mapping of str to str
        Topics of images and their types; `topic` is one of them. Empty for clouds.
    """

    topic: str
    rate: float = 1.0
    hz: float | None = None
    loop: bool = False
    reliable: bool = True
    stamp_now: bool = False
    wait_for: int = 1
    wait_timeout: float = float("inf")
    images: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Played:
    """What became of the clouds.

    Parameters
    ----------
    published : int
        How many went out.
    unheard : str or None
        Why they have reached nobody, or the last ones not all subscribers; None if they have.
    """

    published: int
    unheard: str | None


def play(
    clouds: Clouds,
    playback: Playback,
    *,
    report: Callable[[str], None],
    step: Callable[[], None],
    ros_arguments: Sequence[str] = (),
) -> Played:
    """Publish all clouds; ends early on Ctrl-C, which is ignored from then on.

    Raises
    ------
    NobodySubscribedError
        Nobody came in time.
    """
    keep_freed_memory()
    prepare_fast_dds()
    rclpy.init(args=list(ros_arguments))
    published, heard = 0, False
    unheard: str | None = None
    node: Node | None = None
    try:
        node = Node("topo_region_seg_player")
        policy = ReliabilityPolicy.RELIABLE if playback.reliable else ReliabilityPolicy.BEST_EFFORT
        publishers = {
            topic: node.create_publisher(
                message_class(kind), _remapped(node, topic), QoSProfile(depth=DEPTH, reliability=policy)
            )
            for topic, kind in (playback.images or {playback.topic: CLOUD}).items()
        }
        publisher = publishers[playback.topic]
        _wait_for_subscribers(node, publisher, playback, report)
        for data in _at_their_times(node, clouds, playback, report):
            _send(node, publishers, data if isinstance(data, Mapping) else {playback.topic: data}, playback.stamp_now)
            published += 1
            heard = heard or publisher.get_subscription_count() > 0
            step()
        if published:
            unheard = _why_unheard(publisher, playback, heard)
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
    return Played(published, unheard)


def _remapped(node: Node, topic: str) -> str:
    """Return the name of a topic; where image_transport packs, the name before that is remapped."""
    base, _, packing = topic.rpartition("/")
    return f"{node.resolve_topic_name(base)}/{packing}" if packing in PACKINGS else topic


def _send(node: Node, publishers: Mapping[str, Publisher], messages: Images, stamp_now: bool) -> None:
    now = node.get_clock().now().seconds_nanoseconds() if stamp_now else None
    for topic, data in messages.items():
        publishers[topic].publish(data if now is None else _stamped(data, *now))


def _why_unheard(publisher: Publisher, playback: Playback, heard: bool) -> str | None:
    """Wait for the last clouds to be received, as a reliable publisher that goes at once takes them with it."""
    if not heard:
        return f"nobody subscribed to {publisher.topic_name}"
    if not playback.reliable or _acknowledged(publisher):
        return None
    why = f"not every subscriber to {publisher.topic_name} received the last ones within {ACKNOWLEDGE_TIMEOUT:.0f} s"
    if fast_dds():
        why += (
            f"; a subscriber in another container must share {SHARED_MEMORY} (--ipc=host), "
            "or both set FASTDDS_BUILTIN_TRANSPORTS=UDPv4"
        )
    return why


def _acknowledged(publisher: Publisher) -> bool:
    try:
        return bool(publisher.wait_for_all_acked(Duration(seconds=ACKNOWLEDGE_TIMEOUT)))
    except rclpy_implementation.RCLError:
        return True  # a middleware that cannot tell


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


def _at_their_times(
    node: Node, clouds: Callable[[], Iterator[tuple[int, T]]], playback: Playback, report: Callable[[str], None]
) -> Iterator[T]:
    """Yield each cloud when it is due; the next one is read before the wait, so that reading does not delay it."""
    while True:
        start = time.monotonic()
        count, due = 0, 0.0
        for pause, data in _pauses(clouds(), playback, report):
            due += pause
            _sleep_until(node, start + due)
            yield data
            count += 1
        if not playback.loop or count == 0:
            return
        # The pause before the first cloud of the next round is the mean of those between the clouds.
        mean = 1.0 / playback.hz if playback.hz else due / (count - 1) if count > 1 else 1.0 / playback.rate
        _sleep_until(node, start + due + mean)


def _pauses(
    clouds: Iterable[tuple[int, T]], playback: Playback, report: Callable[[str], None]
) -> Iterator[tuple[float, T]]:
    """Yield the time to wait before each cloud, seconds, and its data; times that go back are no wait."""
    last: int | None = None
    for count, (log_time, data) in enumerate(clouds):
        pause = 0.0 if last is None else max(0.0, (log_time - last) * 1e-9)
        last = log_time
        if playback.hz:
            pause = 1.0 / playback.hz if count else 0.0
        elif pause > LONGEST_GAP:
            report(f"skipped a gap of {_duration(pause)} in the recorded times, before cloud {count + 1}")
            pause = SHORT_GAP
        yield pause / (1.0 if playback.hz else playback.rate), data


def _duration(seconds: float) -> str:
    for unit, length in (("years", 365.25 * 86_400), ("days", 86_400), ("hours", 3_600)):
        if seconds >= 2 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.1f} s"


def _sleep_until(node: Node, due: float) -> None:
    while (left := due - time.monotonic()) > 0.0:
        if not node.context.ok():
            raise ExternalShutdownException
        time.sleep(min(left, 0.1))


def _stamped(data: bytes, sec: int, nanosec: int) -> bytes:
    """Return the message with another time in its header, which lies first, after 4 bytes of encapsulation."""
    order = "<" if data[1] & 1 else ">"
    return data[:4] + struct.pack(f"{order}iI", sec, nanosec) + data[12:]
