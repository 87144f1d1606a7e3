# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""From an arrived message to published regions; a bad frame is counted and logged, and never ends the node."""

from __future__ import annotations

import time
import traceback
from typing import Any

from topo_region_seg.beyond.tracking.tracker import Tracker
from topo_region_seg.clock import cpu_seconds
from topo_region_seg.cloud.layout import CloudFormatError
from topo_region_seg.compiled.threads import at_most
from topo_region_seg.pipeline import MissingColorError, Pipeline
from topo_region_seg.ros.demand import Demand
from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.frame import Frame
from topo_region_seg.ros.publishers import Outputs
from topo_region_seg.ros.segment_once import SegmentOnce
from topo_region_seg.ros.transforms import Transforms, in_frame

ASKED_FOR = frozenset({"thinned"})
"""Notices of what a parameter asks for: said once, and no reason to warn in the diagnostics."""


class FrameProcessor:
    """Decode, segment and publish one frame after the other.

    `feed` is the camera's. `pipeline` may be replaced at any time; a frame is processed by the one that was there when
    it began. `transforms` place the clouds, where parameters ask for them; None else.
    """

    def __init__(self, feed: Feed, pipeline: Pipeline, outputs: Outputs, demand: Demand, requests: SegmentOnce) -> None:
        self.pipeline = pipeline
        self.transforms: Transforms | None = None
        self._context = feed.node.context
        self._clock = feed.node.get_clock()
        self._logger = feed.log.logger
        self._outputs = outputs
        self._demand = demand
        self._requests = requests
        self._statistics = feed.statistics
        self._log = feed.log
        self._greeted = False
        self._tracker = Tracker()

    def forget(self) -> None:
        """Begin a new stream: regions of before give their labels to none."""
        self._tracker = Tracker()

    def process(self, frame: Frame) -> None:
        """Answer `frame`, pass it over where nobody wants it, or count and log why not. Never raises."""
        try:
            if (reason := self._demand.declined(frame.arrived)) is None:
                self._answer(frame)
            else:
                self._statistics.passed_over(reason)
                self._logger.debug(f"cloud {_stamp(frame.msg)} passed over: {reason}")
        except CloudFormatError as error:
            self._reject(frame, error.reason, f"cloud rejected: {error.detail}")
        except MissingColorError as error:
            self._reject(frame, "missing_color", f"cloud rejected: {error}")
        except Exception as error:
            if not self._context.ok():
                return  # a signal ended the node while it worked
            self._logger.debug(traceback.format_exc())
            where = traceback.extract_tb(error.__traceback__)[-1]
            text = f"frame failed: {type(error).__name__}: {error} ({where.filename}:{where.lineno})"
            self._reject(frame, "internal_error", text)

    def _answer(self, frame: Frame) -> None:
        pipeline = self.pipeline
        started, cpu_started = time.monotonic(), cpu_seconds()
        with at_most(pipeline.params.threads):
            cloud = frame.decode(
                max_points=pipeline.params.point_limit,
                warn=self._log.once,
                needs_color=pipeline.needs_color,
            )
        msg, frame_id = frame.msg, frame.msg.header.frame_id
        if self.transforms is not None:
            cloud, frame_id = self.transforms.place(cloud, msg.header)
            msg = in_frame(msg, frame_id)
        decoded, cpu_decoded = time.monotonic(), cpu_seconds()
        if not frame_id:
            self._log.once("empty_frame_id", "clouds have an empty frame_id; RViz and tf cannot place the output")
        stamp = msg.header.stamp
        seg = pipeline.run(cloud, self._notice)
        seconds = stamp.sec + 1e-9 * stamp.nanosec
        seg = self._tracker.follow(cloud, seg, seconds, frame_id, self._notice)
        segmented, cpu_segmented = time.monotonic(), cpu_seconds()
        topics = self._outputs.publish(msg, cloud, seg)
        published, cpu_published = time.monotonic(), cpu_seconds()

        stages = {"decode": 1e3 * (decoded - started), **seg.ms, "publish": 1e3 * (published - segmented)}
        decode_cpu, publish_cpu = cpu_decoded - cpu_started, cpu_published - cpu_segmented
        cpu_stages = {"decode": 1e3 * decode_cpu, **seg.cpu_ms, "publish": 1e3 * publish_cpu}
        # In plain numbers: a stamp may be negative, which rclpy's Time refuses.
        age = 1e-6 * (self._clock.now().nanoseconds - stamp.sec * 1_000_000_000 - stamp.nanosec)
        latency = 1e3 * (published - frame.arrived)
        self._statistics.processed(
            stages,
            latency,
            age,
            points=len(cloud),
            regions=len(seg.regions),
            stamp=_stamp(frame.msg),
            frame_id=frame_id,
            cpu_ms=cpu_stages,
            sensor=seg.sensor_model,
        )
        told = f"cloud {_stamp(frame.msg)}: {cloud.width}x{cloud.height} points, {len(seg.regions)} regions"
        times = ", ".join(f"{stage} {ms:.1f}" for stage, ms in stages.items())
        self._logger.debug(f"{told}, {latency:.1f} ms ({times}), published {', '.join(topics) or 'nothing'}")
        self._requests.finish(frame.arrived, True, f"{told}, {latency:.0f} ms")
        if not self._greeted:
            self._greeted = True
            self._logger.info(
                f"first cloud answered: {cloud.width}x{cloud.height} points in frame '{frame_id}', "
                f"{len(seg.regions)} regions, {latency:.0f} ms"
            )

    def _notice(self, code: str, text: str) -> None:
        if code in ASKED_FOR:
            self._log.once(code, text)
            return
        self._statistics.noticed(code, text)
        self._log.throttled(code, text)

    def _reject(self, frame: Frame, reason: str, text: str) -> None:
        self._statistics.rejected(reason)
        self._log.throttled(reason, text)
        self._requests.finish(frame.arrived, False, f"{text} ({reason})")


def _stamp(msg: Any) -> str:
    return f"{msg.header.stamp.sec}.{msg.header.stamp.nanosec:09d}"
