# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The way of one camera's frames through the node; all cameras of a node share its kernels and parameters."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.lifecycle import LifecycleNode
from rclpy.publisher import Publisher

from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.ros.demand import Demand
from topo_region_seg.ros.diagnostics import Condition
from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.input import FrameSource
from topo_region_seg.ros.inputs import open_input
from topo_region_seg.ros.intake import STOP_SECONDS, Intake
from topo_region_seg.ros.log import ReasonLog
from topo_region_seg.ros.node_params import NodeParams
from topo_region_seg.ros.processor import FrameProcessor
from topo_region_seg.ros.publishers import Outputs
from topo_region_seg.ros.reporter import Reporter
from topo_region_seg.ros.segment_once import SegmentOnce
from topo_region_seg.ros.transforms import Transforms


class Camera:
    """Topics, worker, tracks, figures and service of one camera.

    There are figures and the service from the beginning, the output topics from :meth:`configure` on, and the
    subscription and the worker thread from :meth:`activate` on, while clouds are wanted.

    Parameters
    ----------
    node : LifecycleNode
        The node.
    name : str
        What its topics begin with; empty for the only camera of a node.
    publisher : Publisher
        That of the node's diagnostics.
    refusal : callable
        Returns why no cloud can be processed at present, None if one can.
    settings : callable
        Returns the node's parameters of this moment.
    """

    def __init__(
        self,
        node: LifecycleNode,
        name: str,
        publisher: Publisher,
        refusal: Callable[[], str | None],
        settings: Callable[[], NodeParams],
    ) -> None:
        self.name = name
        self._settings = settings
        logger = node.get_logger().get_child(name) if name else node.get_logger()
        self.feed = Feed(node, ReasonLog(logger, lambda: settings().warning_period), name)
        service = f"~/{self.feed.topic('segment_once')}"
        self.requests = SegmentOnce(node, service, refusal, lambda: settings().request_timeout)
        self._reporter = Reporter(self.feed, publisher)
        self._outputs: Outputs | None = None
        self._processor: FrameProcessor | None = None
        self._intake: Intake | None = None

    def configure(self, params: Params) -> tuple[str, ...]:
        """Create the output topics; return those that cannot be, as their messages are missing.

        Raises
        ------
        ParameterError
            A QoS override is invalid.
        """
        self._outputs = Outputs(self.feed, lambda: self._settings().pass_fields)
        demand = Demand(self._outputs, self.requests, self._settings)
        processor = FrameProcessor(self.feed, Pipeline(params), self._outputs, demand, self.requests)
        self._processor = processor
        self._intake = Intake(self.feed, lambda: open_input(self.feed, processor, self._settings()), demand)
        return self._outputs.missing

    def activate(self, transforms: Transforms | None) -> FrameSource:
        """Subscribe, with no memory of earlier frames; return the input.

        Raises
        ------
        ParameterError
            A QoS override is invalid.
        """
        if self._processor is None or self._intake is None:
            raise RuntimeError("not configured")
        self._processor.forget()
        self._processor.transforms = transforms
        return self._intake.start()

    def close_input(self) -> None:
        """Unsubscribe, and wait for the frame that is being processed."""
        if self._intake is not None and not self._intake.close():
            self.feed.log.logger.warning(f"the last frame did not end within {STOP_SECONDS:.0f} s")
        if self._processor is not None:
            self._processor.transforms = None
        self.requests.give_up("the node was deactivated")

    def release(self) -> None:
        """Close the input and remove the output topics."""
        self.close_input()
        self._processor = self._intake = None
        if self._outputs is not None:
            self._outputs.destroy()
            self._outputs = None

    def destroy(self) -> None:
        """Remove everything."""
        self.release()
        self.requests.destroy()

    def use(self, params: Params) -> None:
        """Let frames from the next one on be segmented by other parameters."""
        if self._processor is None or self._processor.pipeline.params == params:
            return
        self._processor.pipeline = Pipeline(params)
        if self._intake is not None and self._intake.input is not None:
            self._intake.input.follow_publishers()  # color may count now, or no more

    def report(self, state: str, failure: str | None, overdue: float) -> None:
        """Publish the diagnostics; the node's state and troubles are as :class:`Condition` takes them."""
        intake = self._intake
        source = None if intake is None else intake.input
        if source is not None:
            source.follow_publishers()
        asleep = None if intake is None else intake.asleep
        self._reporter.report(Condition(state, self._settings(), failure, asleep, overdue), source)

    def follow_demand(self) -> None:
        """Listen while somebody wants it, and answer requests that have waited too long."""
        if self.requests.waiting():
            source = None if self._intake is None else self._intake.input
            points = self.feed.node.resolve_topic_name(self.feed.topic("points"))
            self.requests.expire(points if source is None else source.topic)
        if self._intake is not None:
            self._intake.follow()
