# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The input with other middlewares than Fast DDS, and with publishers of every quality, without a network."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from rclpy.event_handler import UnsupportedEventTypeError
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2

from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.followed_topic import OVERLAP_SECONDS
from topo_region_seg.ros.input import Input
from topo_region_seg.ros.input_quality import InputQuality
from topo_region_seg.ros.log import ReasonLog
from topo_region_seg.ros.statistics import Statistics

RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
VOLATILE, LATCHED = DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL
TOPIC = "/points"


class Node:
    """As much of a node as the input uses."""

    def __init__(self, overrides: dict[str, Any] | None = None, events: bool = True) -> None:
        self.publishers: list[QoSProfile] = []
        self.subscriptions: list[SimpleNamespace] = []
        self.lines: list[str] = []
        self._events = events
        self._parameter_overrides = {name: Parameter(name, value=value) for name, value in (overrides or {}).items()}

    def resolve_topic_name(self, topic: str) -> str:
        return TOPIC

    def get_publishers_info_by_topic(self, topic: str) -> list[SimpleNamespace]:
        assert topic == TOPIC
        return [SimpleNamespace(qos_profile=profile) for profile in self.publishers]

    def create_subscription(
        self, kind: type, topic: str, callback: Any, profile: QoSProfile, *, event_callbacks: Any = None, **_: Any
    ) -> SimpleNamespace:
        if event_callbacks is not None and not self._events:
            raise UnsupportedEventTypeError
        made = SimpleNamespace(callback=callback, qos_profile=profile, events=event_callbacks)
        self.subscriptions.append(made)
        return made

    def destroy_subscription(self, subscription: SimpleNamespace) -> None:
        self.subscriptions.remove(subscription)

    def get_logger(self) -> Any:
        return SimpleNamespace(warning=self.lines.append, debug=self.lines.append)


def opened(node: Node, reliability: str = "auto") -> tuple[Input, Statistics, list[float]]:
    """Return an input, its statistics and the stamps of the clouds that were processed."""
    statistics, seen = Statistics(), []
    log = ReasonLog(node.get_logger(), lambda: 0.0)
    source = Input(
        Feed(node, log, statistics=statistics), lambda frame: seen.append(frame.msg.header.stamp.sec), reliability
    )
    return source, statistics, seen


def cloud(sec: int = 0) -> PointCloud2:
    msg = PointCloud2()
    msg.header.stamp.sec = sec
    return msg


def info(number: int | None, published: int = 0) -> dict[str, Any]:
    return {"source_timestamp": published, "received_timestamp": 0, "publication_sequence_number": number}


def test_messages_without_numbers_are_taken_and_none_is_counted_as_skipped() -> None:
    node = Node()
    node.publishers = [QoSProfile(depth=1)]
    source, statistics, _ = opened(node)
    for sec in range(5):
        node.subscriptions[0].callback(cloud(sec), info(None, published=10 + 10 * sec))
    assert statistics.snapshot().received == 5
    source.close(10)
    now = statistics.snapshot()
    assert now.received == 5 and now.lost == 0


def test_numbers_that_are_left_out_are_clouds_that_were_skipped() -> None:
    node = Node()
    node.publishers = [QoSProfile(depth=1)]
    source, statistics, _ = opened(node)
    for number in (3, 4, 8):
        node.subscriptions[0].callback(cloud(), info(number, published=number))
    assert statistics.snapshot().received == 3 + 3
    source.close(10)


@pytest.mark.parametrize("number", [None, 7])
@pytest.mark.parametrize("published", [0, 99])
def test_the_second_subscription_of_an_overlap_delivers_nothing_twice(number: int | None, published: int) -> None:
    node = Node()
    source, statistics, _ = opened(node)
    node.publishers = [QoSProfile(depth=1, reliability=BEST_EFFORT)]
    source.follow_publishers()
    assert [s.qos_profile.reliability for s in node.subscriptions] == [RELIABLE, BEST_EFFORT]
    for subscription in node.subscriptions:
        subscription.callback(cloud(5), info(number, published))
    assert statistics.snapshot().received == 1
    source.close(10)
    assert not node.subscriptions


def test_a_camera_without_clock_time_and_numbers_is_heard_in_full() -> None:
    node = Node()
    source, statistics, _ = opened(node)
    for _ in range(4):
        node.subscriptions[0].callback(cloud(), {})
    assert statistics.snapshot().received == 4
    source.close(10)


def test_a_middleware_without_events_is_followed_by_asking(monkeypatch: pytest.MonkeyPatch) -> None:
    node = Node(events=False)
    source, *_ = opened(node)
    assert node.subscriptions[0].events is None
    node.publishers = [QoSProfile(depth=1, reliability=BEST_EFFORT)]
    source.follow_publishers()
    assert node.subscriptions[-1].qos_profile.reliability == BEST_EFFORT
    monkeypatch.setattr("topo_region_seg.ros.followed_topic.OVERLAP_SECONDS", 0.0)
    source.follow_publishers()
    assert len(node.subscriptions) == 1, "the old one goes when the overlap ends"
    source.close(10)
    assert OVERLAP_SECONDS > 0.0


def test_a_publisher_that_comes_is_followed_at_once_and_its_numbers_begin_anew() -> None:
    node = Node()
    node.publishers = [QoSProfile(depth=1)]
    source, statistics, _ = opened(node)
    node.subscriptions[0].callback(cloud(1), info(3, published=1))
    node.publishers = [QoSProfile(depth=1, reliability=BEST_EFFORT)]
    node.subscriptions[0].events.matched(SimpleNamespace())
    assert [s.qos_profile.reliability for s in node.subscriptions] == [RELIABLE, BEST_EFFORT]
    node.subscriptions[1].callback(cloud(2), info(9, published=2))
    assert statistics.snapshot().received == 2, "none of the new one's is missing"
    node.subscriptions[1].callback(cloud(3), info(11, published=3))
    assert statistics.snapshot().received == 4
    source.close(10)


def test_the_old_subscription_goes_only_after_the_overlap(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr("topo_region_seg.ros.followed_topic.time", SimpleNamespace(monotonic=lambda: now[0]))
    node = Node()
    source, *_ = opened(node)
    node.publishers = [QoSProfile(depth=1, reliability=BEST_EFFORT)]
    for after, left in ((0.0, 2), (0.9 * OVERLAP_SECONDS, 2), (1.1 * OVERLAP_SECONDS, 1), (9.0, 1)):
        now[0] = 100.0 + after
        source.follow_publishers()
        assert len(node.subscriptions) == left
    source.close(10)


CASES: list[tuple[list[tuple[ReliabilityPolicy, DurabilityPolicy]], ReliabilityPolicy, DurabilityPolicy]] = [
    ([], RELIABLE, VOLATILE),
    ([(RELIABLE, VOLATILE)], RELIABLE, VOLATILE),
    ([(BEST_EFFORT, VOLATILE)], BEST_EFFORT, VOLATILE),
    ([(RELIABLE, LATCHED)], RELIABLE, LATCHED),
    ([(BEST_EFFORT, LATCHED), (RELIABLE, LATCHED)], BEST_EFFORT, LATCHED),
    # A transient-local subscription would not hear the volatile one.
    ([(RELIABLE, LATCHED), (RELIABLE, VOLATILE)], RELIABLE, VOLATILE),
]


@pytest.mark.parametrize(("publishers", "reliability", "durability"), CASES)
def test_the_quality_hears_every_publisher(
    publishers: list[tuple[ReliabilityPolicy, DurabilityPolicy]],
    reliability: ReliabilityPolicy,
    durability: DurabilityPolicy,
) -> None:
    node = Node()
    node.publishers = [QoSProfile(depth=1, reliability=r, durability=d) for r, d in publishers]
    quality = InputQuality(node, TOPIC, "auto")
    wanted = quality.wanted()
    assert (wanted.reliability, wanted.durability) == (reliability, durability)
    assert quality.publishers == len(publishers)
    profile = wanted.profile()
    assert (profile.depth, profile.reliability, profile.durability) == (1, reliability, durability)
    for other in node.publishers:  # what DDS asks of a pair: offered is at least requested
        assert not (other.reliability == BEST_EFFORT and profile.reliability == RELIABLE)
        assert not (other.durability == VOLATILE and profile.durability == LATCHED)


@pytest.mark.parametrize("reliability", ["reliable", "best_effort"])
def test_what_a_parameter_holds_follows_nobody(reliability: str) -> None:
    node = Node()
    node.publishers = [QoSProfile(depth=1, reliability=BEST_EFFORT, durability=LATCHED)]
    quality = InputQuality(node, TOPIC, reliability)
    assert quality.wanted().reliability == ReliabilityPolicy[reliability.upper()]
    assert quality.followed == {QoSPolicyKind.DURABILITY}


def test_what_an_override_holds_follows_nobody_and_is_declared() -> None:
    node = Node({f"qos_overrides.{TOPIC}.subscription.durability": "volatile"})
    node.publishers = [QoSProfile(depth=1, durability=LATCHED)]
    quality = InputQuality(node, TOPIC, "auto")
    assert quality.wanted().durability == VOLATILE
    assert QoSPolicyKind.DURABILITY in quality.overridable
    assert QoSPolicyKind.RELIABILITY not in quality.overridable, "it would hold the value of the first subscription"


def test_a_publisher_that_cannot_be_heard_is_named_with_what_holds_the_policy() -> None:
    node = Node({f"qos_overrides.{TOPIC}.subscription.durability": "transient_local"})
    source, statistics, _ = opened(node, "reliable")
    warn = node.subscriptions[0].events.incompatible_qos
    for kind, remedy in (
        (QoSPolicyKind.RELIABILITY, "set input_reliability to auto"),
        (QoSPolicyKind.DURABILITY, f"change qos_overrides.{TOPIC}.subscription.durability"),
    ):
        warn(SimpleNamespace(last_policy_kind=kind, total_count_change=1))
        assert node.lines[-1].endswith(f"its {kind.name.lower()} is less than this node asks for; {remedy}")
    assert statistics.snapshot().incompatible == 2
    source.close(10)


@pytest.mark.parametrize(("middleware", "told"), [("", True), ("rmw_cyclonedds_cpp", False)])
def test_advice_on_lost_clouds_is_that_of_the_middleware(
    middleware: str, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", middleware)
    node = Node()
    source, *_ = opened(node)
    node.subscriptions[0].events.message_lost(SimpleNamespace(total_count_change=2))
    assert ("fastdds.xml" in node.lines[-1]) == told
    source.close(10)
