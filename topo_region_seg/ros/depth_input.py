# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames from depth images, in place of clouds: each with its camera_info and, where color counts, its color image.

Everything happens in short callbacks; a frame that is whole goes to the worker, and the newest wins. Memory is bounded
by the images that wait for partners.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from topo_region_seg.cloud.camera_info import choose_info, image_size, info_size, is_rectified
from topo_region_seg.cloud.pairing import Pair, Pairing
from topo_region_seg.cloud.stamp import stamp_of
from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.followed_topic import FollowedTopic
from topo_region_seg.ros.frame import DepthFrame, Frame
from topo_region_seg.ros.input import FrameSource
from topo_region_seg.ros.missing_images import color_apart, no_camera_info, no_color, other_size
from topo_region_seg.ros.node_params import NodeParams

DEPTH, INFO, COLOR = "depth/image", "depth/camera_info", "color/image"
INFOS = 4
"""Messages of camera_info that are kept: they may come a little before or after their images."""
COLORS_QUEUED = 4
"""Color images that the middleware keeps, as one that is displaced leaves its depth image without a partner."""
BRIEFLY = 2
"""Depth images that wait for a color image that the labels do not depend on."""


class _Taken(NamedTuple):
    """A depth image and when it arrived, monotonic clock, seconds."""

    msg: Any
    arrived: float


class DepthInput(FrameSource):
    """Take depth images, depth 1, and process the newest with the camera_info and color image that belong to it.

    Parameters
    ----------
    feed, process
        As :class:`FrameSource` takes them.
    settings : NodeParams
        Reliability, and how the images are packed.
    color : callable
        Returns whether the labels depend on color (True), color is of use (None) or is not (False); at any time.

    Raises
    ------
    ParameterError
        A QoS override is invalid.
    """

    what = "depth images"
    kind = "sensor_msgs/msg/Image"

    def __init__(
        self, feed: Feed, process: Callable[[Frame], None], settings: NodeParams, color: Callable[[], bool | None]
    ) -> None:
        super().__init__(feed, process, DEPTH)
        self._node = feed.node
        self._log = feed.log
        self._settings = settings
        self._color_counts = color
        self._lock = threading.RLock()
        self._infos: deque[CameraInfo] = deque(maxlen=INFOS)
        self._without_info: tuple[_Taken, Any] | None = None
        self._pairing: Pairing[_Taken, Any] | None = None
        self._color_needed = False
        self._followed: list[FollowedTopic] = []
        packed = settings.depth_transport != "raw"
        if packed:
            self.kind = "sensor_msgs/msg/CompressedImage"
        try:
            with self._lock:
                # What image_transport appends is not remapped.
                name = f"{self._full(DEPTH)}/{settings.depth_transport}" if packed else self.name
                self._follow(CompressedImage if packed else Image, name, self._take_depth, self.what, counts=True)
                self._rectified = is_rectified(self.topic)
                self._follow(CameraInfo, feed.topic(INFO), self._take_info, "camera_info")
                self._follow_color()
        except Exception:
            self._worker.stop()
            for topic in self._followed:
                topic.close()
            raise

    @property
    def _topics(self) -> list[FollowedTopic]:
        return list(self._followed)

    @property
    def color_topic(self) -> str:
        """Full name of the topic of color images."""
        name, transport = self._full(COLOR), self._settings.color_transport
        return name if transport == "raw" else f"{name}/{transport}"

    @property
    def info_topic(self) -> str:
        """Full name of the topic of camera_info."""
        return self._full(INFO)

    def _full(self, name: str) -> str:
        return str(self._node.resolve_topic_name(self._feed.topic(name)))

    def follow_publishers(self) -> None:
        """Give the subscriptions the quality that hears all publishers, and take color images where they count."""
        with self._lock:
            self._follow_color()
            super().follow_publishers()

    def close(self, timeout: float) -> bool:
        """Unsubscribe, forget what waits, wait for the running frame; return whether it ended in time."""
        with self._lock:
            for _ in range(self._waiting):
                self._statistics.dropped()
            self._pairing, self._without_info = None, None
        return super().close(timeout)

    @property
    def _waiting(self) -> int:
        return (len(self._pairing) if self._pairing else 0) + (self._without_info is not None)

    def _follow(
        self,
        kind: type,
        name: str,
        receive: Callable[[Any, int], None],
        what: str,
        *,
        depth: int = 1,
        counts: bool = False,
    ) -> None:
        reliability = self._settings.input_reliability
        topic = FollowedTopic(self._feed, kind, name, receive, reliability, what=what, depth=depth, counts=counts)
        self._followed.append(topic)

    def _follow_color(self) -> None:
        """Subscribe to color images where they count, and unsubscribe where they do no more."""
        counts = self._color_counts()
        needed = bool(counts)
        wanted = needed or (counts is None and self._node.count_publishers(self.color_topic) > 0)
        if wanted == (self._pairing is not None) and needed == self._color_needed:
            return
        waiting = self._pairing.flush() if self._pairing else []
        self._color_needed = needed
        if not wanted:
            self._followed.pop().close()
            self._pairing = None
        else:
            if self._pairing is None:
                packed = self._settings.color_transport != "raw"
                name, kind = (self.color_topic, CompressedImage) if packed else (self._feed.topic(COLOR), Image)
                self._follow(kind, name, self._take_color, "color images", depth=COLORS_QUEUED)
            self._pairing = Pairing() if needed else Pairing(room=BRIEFLY)
        self._decided(waiting)

    def _take_depth(self, msg: Any, skipped: int) -> None:
        self._statistics.received(displaced=False, skipped=skipped)
        taken = _Taken(msg, time.monotonic())
        with self._lock:
            if self._pairing is None:
                self._submit(taken, None)
            else:
                self._decided(self._pairing.add_depth(stamp_of(msg), taken))

    def _take_color(self, msg: Any, _: int) -> None:
        with self._lock:
            if self._pairing is not None:
                self._decided(self._pairing.add_color(stamp_of(msg), msg))

    def _take_info(self, msg: CameraInfo, _: int) -> None:
        with self._lock:
            self._infos.append(msg)
            if self._without_info is not None:
                waiting, self._without_info = self._without_info, None
                self._submit(*waiting)

    def _decided(self, pairs: list[Pair[_Taken, Any]]) -> None:
        for pair in pairs:
            if pair.color is not None or not self._color_needed:
                self._submit(pair.depth, pair.color)
            elif pair.apart is None:
                self._reject("no_color", lambda: no_color(self._node, self.topic, self.color_topic))
            else:
                period = self._pairing.period if self._pairing else 0.0
                self._reject("color_apart", color_apart(self.topic, self.color_topic, pair.apart, period))

    def _submit(self, depth: _Taken, color: Any) -> None:
        """Hand over a frame; one without camera_info waits for it, until the next comes."""
        if self._without_info is not None:
            self._reject_without_info(self._without_info[0].msg)
            self._without_info = None
        info = choose_info(self._infos, depth.msg)
        if info is None:
            self._without_info = depth, color
            return
        frame = DepthFrame(depth.msg, depth.arrived, info=info, color=color, rectified=self._rectified)
        if self._worker.submit(frame):
            self._statistics.dropped()

    def _reject_without_info(self, depth: Any) -> None:
        if not self._infos:
            self._reject("no_camera_info", lambda: no_camera_info(self._node, self.topic, self.info_topic))
        else:
            described = info_size(self._infos[-1])
            text = other_size(self.topic, self.info_topic, image_size(depth), described)
            self._reject("camera_info_size", text)

    def _reject(self, reason: str, text: str | Callable[[], str]) -> None:
        self._statistics.rejected(reason)
        self._log.throttled(reason, text)
