# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A subscription that hears every publisher of a topic, and as well as it can.

Nothing here is particular to one middleware: some number no messages, and some have no events.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.event_handler import (
    QoSMessageLostInfo,
    QoSRequestedIncompatibleQoSInfo,
    SubscriptionEventCallbacks,
    UnsupportedEventTypeError,
)
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, qos_policy_name_from_kind
from rclpy.subscription import Subscription

from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.input_quality import FOLLOWED, InputQuality
from topo_region_seg.ros.qos_overrides import overriding
from topo_region_seg.ros.transport import PROFILES, fast_dds, profiles_variable

OVERLAP_SECONDS = 1.0
"""How long an old subscription outlives its successor: publishers must have discovered the new one by then."""
REMEMBERED = 16
"""Messages that are recognized when the second subscription of an overlap delivers them, too."""


class FollowedTopic:
    """Subscribe to a topic with the quality of service of its publishers, whatever it becomes.

    Parameters
    ----------
    feed : Feed
        The camera's. Publishers that cannot be heard are counted and, where `counts` is true, what is lost on the way.
    kind : type
        Class of the messages, which have a header.
    name : str
        Name of the topic, before remapping.
    receive : callable
        Called with each message and how many were published since the last one, but never delivered.
    reliability : str
        As :class:`InputQuality` takes it.
    what : str
        What the messages are, for the log.
    depth : int
        Messages that the middleware keeps.
    counts : bool
        Whether these are the messages that frames are counted by.

    Raises
    ------
    ParameterError
        A QoS override is invalid.
    """

    def __init__(
        self,
        feed: Feed,
        kind: type,
        name: str,
        receive: Callable[[Any, int], None],
        reliability: str,
        *,
        what: str = "clouds",
        depth: int = 1,
        counts: bool = True,
    ) -> None:
        self._node = node = feed.node
        self._kind = kind
        self._name = name
        self._deliver = receive
        self._statistics = feed.statistics
        self._log = feed.log
        self._what = what
        self._depth = depth
        self._counts = counts
        self.quality = InputQuality(node, self.topic, reliability)
        self._overrides = overriding(node, name, "subscription", self.quality.overridable)
        self._present = self.quality.wanted()
        self._recent: deque[tuple[Any, ...]] = deque(maxlen=REMEMBERED)
        self._last_number: int | None = None
        self._retired: Subscription | None = None
        self._switched = 0.0
        # Whoever activates the node may do so on another thread than the one that gets the events.
        self._lock = threading.RLock()
        with self._lock:
            self._subscription = self._subscribe()

    @property
    def topic(self) -> str:
        """Full name of the topic, remapping included."""
        return str(self._node.resolve_topic_name(self._name))

    @property
    def possible_overrides(self) -> list[str]:
        """Names of the overrides that are declared only where they are given."""
        return [self.quality.override(kind) for kind in FOLLOWED]

    @property
    def hears_the_past(self) -> bool:
        """Whether it gets what was published before it was there, by publishers that keep it."""
        return bool(self._subscription.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL)

    def follow_publishers(self) -> None:
        """Give the subscription the quality that hears all publishers; harmless to call at any time."""
        with self._lock:
            wanted = self.quality.wanted()
            if self._retired is not None:
                if time.monotonic() - self._switched < OVERLAP_SECONDS:
                    return
                self._end_overlap()
            if wanted != self._present:
                # The successor is there before the old subscription goes, so that nothing falls between them.
                self._present = wanted
                self._retired, self._switched = self._subscription, time.monotonic()
                self._subscription = self._subscribe()
                self._node.get_logger().debug(f"subscription to {self.topic} is now {wanted}")

    def close(self) -> None:
        """Unsubscribe."""
        with self._lock:
            self._end_overlap()
            self._node.destroy_subscription(self._subscription)

    def _subscribe(self) -> Subscription:
        events = SubscriptionEventCallbacks(
            matched=self._note_match, incompatible_qos=self._warn_incompatible, message_lost=self._count_lost
        )

        def subscribe(**more: Any) -> Subscription:
            return self._node.create_subscription(
                self._kind,
                self._name,
                self._receive,
                self._present.profile(self._depth),
                qos_overriding_options=self._overrides,
                **more,
            )

        try:
            return subscribe(event_callbacks=events)
        except UnsupportedEventTypeError:
            # The once-a-second call of follow_publishers has to do.
            return subscribe()

    def _end_overlap(self) -> None:
        if self._retired is not None:
            self._node.destroy_subscription(self._retired)
            self._retired = None

    def _receive(self, msg: Any, info: Mapping[str, Any]) -> None:
        number, published = info.get("publication_sequence_number"), info.get("source_timestamp")
        stamp = msg.header.stamp
        identity = (published, number, stamp.sec, stamp.nanosec)
        # Without number and time, equal stamps may also be those of a camera that has no clock.
        if identity in self._recent and (published or number is not None or self._retired is not None):
            return  # both subscriptions of an overlap have it
        self._recent.append(identity)
        skipped = 0
        if number is not None:
            last = number if self._last_number is None else self._last_number
            skipped = max(0, number - last - 1) if self.quality.publishers == 1 else 0
            self._last_number = max(number, last)
        self._deliver(msg, skipped)

    def _count_lost(self, event: QoSMessageLostInfo) -> None:
        if self._counts:
            self._statistics.lost(event.total_count_change)
        segment = f", or start the publisher with {profiles_variable()}={PROFILES}" if fast_dds() else ""
        self._log.throttled(
            "lost_in_transport",
            f"{self._what} are lost between publisher and node on {self.topic} ({self._present} QoS); "
            f"publish reliably{segment}",
        )

    def _note_match(self, _: object) -> None:
        self._last_number = None  # each publisher numbers its messages from 1
        self.follow_publishers()

    def _warn_incompatible(self, event: QoSRequestedIncompatibleQoSInfo) -> None:
        self.follow_publishers()
        policy = event.last_policy_kind
        if policy in self.quality.followed:
            return
        self._statistics.incompatible(event.total_count_change)
        remedy = (
            "set input_reliability to auto"
            if policy == QoSPolicyKind.RELIABILITY and policy not in self.quality.overridable
            else f"change {self.quality.override(policy)}"
        )
        self._log.throttled(
            "incompatible_qos",
            f"a publisher on {self.topic} cannot be heard: its {qos_policy_name_from_kind(policy).lower()} is less "
            f"than this node asks for; {remedy}",
        )
