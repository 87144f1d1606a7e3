# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Where frames come from, and the worker thread behind it; exists only while the node is active."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from rclpy.qos import QoSPolicyKind
from sensor_msgs.msg import PointCloud2

from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.followed_topic import FollowedTopic
from topo_region_seg.ros.frame import Frame
from topo_region_seg.ros.worker import NewestWinsWorker


class FrameSource:
    """What all inputs have: a topic that frames are counted by, maybe others beside it, and the newest-wins worker.

    Parameters
    ----------
    feed : Feed
        The camera's: what arrives, is dropped, is lost or is rejected is counted.
    process : callable
        Called on the worker thread with each frame.
    name : str
        Name of the topic, as it is for a node with one camera.

    Attributes
    ----------
    what : str
        What comes on the topic, for the log.
    kind : str
        Type of the topic.
    name : str
        Name of the topic before remapping.
    """

    what: ClassVar[str]
    kind: str

    def __init__(self, feed: Feed, process: Callable[[Frame], None], name: str) -> None:
        self._feed = feed
        self._statistics = feed.statistics
        self.name = feed.topic(name)
        self._worker = NewestWinsWorker(process, "segmentation")

    @property
    def _topics(self) -> list[FollowedTopic]:
        """Topics that are subscribed to, the one that frames are counted by first."""
        raise NotImplementedError

    @property
    def topic(self) -> str:
        """Full name of the topic that frames are counted by, remapping included."""
        return self._topics[0].topic

    @property
    def possible_overrides(self) -> list[str]:
        """Names of QoS overrides that are declared only where they are given."""
        return [name for topic in self._topics for name in topic.possible_overrides]

    @property
    def hears_the_past(self) -> bool:
        """Whether it gets what was published before it was there, by publishers that keep it."""
        return self._topics[0].hears_the_past

    def durability_override(self) -> str:
        """Return the name of the parameter that overrides the durability of the topic."""
        return self._topics[0].quality.override(QoSPolicyKind.DURABILITY)

    def follow_publishers(self) -> None:
        """Give the subscriptions the quality that hears all publishers; harmless to call at any time."""
        for topic in self._topics:
            topic.follow_publishers()

    def close(self, timeout: float) -> bool:
        """Unsubscribe, forget what waits, wait for the running frame; return whether it ended in time."""
        for topic in self._topics:
            topic.close()
        ended, forgot = self._worker.stop(timeout)
        if forgot:
            self._statistics.dropped()
        return ended


class Input(FrameSource):
    """Take clouds from `points`, depth 1, and process the newest.

    Parameters
    ----------
    feed, process
        As :class:`FrameSource` takes them.
    reliability : str
        As :class:`InputQuality` takes it.

    Raises
    ------
    ParameterError
        A QoS override is invalid.
    """

    what = "clouds"
    kind = "sensor_msgs/msg/PointCloud2"

    def __init__(self, feed: Feed, process: Callable[[Frame], None], reliability: str) -> None:
        super().__init__(feed, process, "points")
        try:
            self._points = FollowedTopic(feed, PointCloud2, self.name, self._receive, reliability)
        except Exception:
            self._worker.stop()
            raise

    @property
    def _topics(self) -> list[FollowedTopic]:
        return [self._points]

    def _receive(self, msg: PointCloud2, skipped: int) -> None:
        self._statistics.received(displaced=self._worker.submit(Frame(msg)), skipped=skipped)
