# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The lifecycle node: what exists in which state, and what happens on the way from one to the other."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter

from topo_region_seg.parameter_table import ParameterError
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.ros import parameters
from topo_region_seg.ros.demand import Demand
from topo_region_seg.ros.diagnostics import Condition
from topo_region_seg.ros.input import FrameSource
from topo_region_seg.ros.inputs import open_input
from topo_region_seg.ros.intake import STOP_SECONDS, Intake
from topo_region_seg.ros.invalid_transitions import refuse_invalid_transitions
from topo_region_seg.ros.log import ReasonLog
from topo_region_seg.ros.node_params import NodeParams
from topo_region_seg.ros.parameter_names import unknown
from topo_region_seg.ros.processor import FrameProcessor
from topo_region_seg.ros.publishers import Outputs
from topo_region_seg.ros.qos_overrides import unused
from topo_region_seg.ros.reporter import Reporter
from topo_region_seg.ros.segment_once import SegmentOnce
from topo_region_seg.ros.statistics import Statistics
from topo_region_seg.ros.transforms import Transforms
from topo_region_seg.ros.warm_up import warm_up_kernels

DEMAND_SECONDS = 0.1
"""Time between two looks at who wants clouds."""

LAST_REPORTS = 3
"""How often a node that could not start reports so before its process ends: listeners find it at their own pace."""

RECOVERY = "recovery"


class RegionSegmentation(LifecycleNode):  # type: ignore[misc]  # rclpy is untyped
    """Segment every cloud on `points`, or what depth images show, the newest first.

    Unconfigured: parameters, diagnostics and the service `~/segment_once`. Inactive: also compiled kernels and the
    output topics. Active: also, while clouds are wanted, the subscription and the worker thread.

    Attributes
    ----------
    start_failed : bool
        Whether :meth:`autostart` could not activate the node.

    Raises
    ------
    ParameterError
        If a parameter given at start is invalid.
    """

    def __init__(self) -> None:
        super().__init__("region_segmentation")
        try:
            self._set_up()
        except Exception:
            super().destroy_node()  # or its services would be found, and answer nobody, until Python forgets it
            raise

    def _set_up(self) -> None:
        self._params = parameters.declare(self, Params)
        self._node_params = parameters.declare(self, NodeParams)
        self._log = ReasonLog(self.get_logger(), lambda: self._node_params.warning_period)
        for line in unknown(self._parameter_overrides):
            self.get_logger().warning(line)
        self.add_pre_set_parameters_callback(self._type_parameters)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)

        self._statistics = Statistics()
        self._outputs: Outputs | None = None
        self._processor: FrameProcessor | None = None
        self._intake: Intake | None = None
        self._failure: str | None = None
        self._due_since: float | None = time.monotonic()
        self._warned_of_overrides = False
        self.start_failed = False
        self._reporter = Reporter(self, self._statistics)
        self._requests = SegmentOnce(self, self._refusal, lambda: self._node_params.request_timeout)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._report, clock=steady)
        self.create_timer(DEMAND_SECONDS, self._follow_demand, clock=steady)
        refuse_invalid_transitions(self)

    def autostart(self) -> None:
        """Configure and activate on a thread of its own, unless the parameter `autostart` is false.

        Shuts the context down if that fails: a process that lives on would look like a node that works.
        """
        if self._node_params.autostart:
            threading.Thread(target=self._autostart, name="autostart", daemon=True).start()
        else:
            self.get_logger().info("autostart is off: waiting for the lifecycle service 'configure'")

    def destroy_node(self) -> None:
        """Stop the work and remove the node."""
        self._release()
        super().destroy_node()

    # Lifecycle. What fails on the way up falls back to the state before; what fails on the way down is released.

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Load the kernels and create the output topics."""

        def configure() -> None:
            warm_up_kernels(self.get_logger(), self.context.ok)
            self._outputs = Outputs(self, self._log, lambda: self._node_params.pass_fields)
            demand = Demand(self._outputs, self._requests, lambda: self._node_params)
            given = self._outputs, demand, self._requests, self._statistics, self._log
            self._processor = FrameProcessor(self, Pipeline(self._params), *given)
            self._intake = Intake(self, self._make_input, demand, self._statistics, self._log)

        return self._transition("configure", configure, undo=self._release)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the output topics and subscribe to the clouds."""

        def activate() -> None:
            if self._processor is None or self._intake is None:
                raise RuntimeError("not configured")
            super(RegionSegmentation, self).on_activate(state)
            self._processor.forget()
            if Transforms.wanted(self._node_params):
                self._processor.transforms = Transforms(self, self._node_params)
            source = self._intake.start()
            self._warn_of_unused_overrides(source)
            self._due_since = None
            self.get_logger().info(f"active: waiting for {source.what} on {source.topic}")

        return self._transition("activate", activate, undo=self._close_input)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Unsubscribe, so that nothing waits in a queue, and close the output topics."""

        def deactivate() -> None:
            self._due_since = None
            self._close_input()
            super(RegionSegmentation, self).on_deactivate(state)
            self.get_logger().info("inactive")

        return self._transition("deactivate", deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Remove the output topics."""
        return self._transition("cleanup", self._take_down)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release everything; the node stays, finalized, until the process ends."""
        return self._transition("shutdown", self._take_down)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release everything and begin again, unconfigured."""
        return self._transition(RECOVERY, self._release)

    def _transition(
        self, name: str, action: Callable[[], None], undo: Callable[[], None] | None = None
    ) -> TransitionCallbackReturn:
        try:
            action()
            if name != RECOVERY:  # after which the earlier failure still has to be reported
                self._failure = None
            return TransitionCallbackReturn.SUCCESS
        except ExternalShutdownException:
            return TransitionCallbackReturn.FAILURE
        except Exception as error:
            reason = str(error) if isinstance(error, ParameterError) else f"{type(error).__name__}: {error}"
            self._failure = f"{name} failed: {reason}"
            self.get_logger().error(self._failure)
            if undo is None:
                return TransitionCallbackReturn.ERROR
            undo()
            return TransitionCallbackReturn.FAILURE

    def _autostart(self) -> None:
        success = TransitionCallbackReturn.SUCCESS
        try:
            started = self.trigger_configure() == success and self.trigger_activate() == success
        except Exception as error:
            started, self._failure = False, f"autostart failed: {type(error).__name__}: {error}"
        if started or not self.context.ok():
            return  # not ok: a signal ended the node while it started
        self.get_logger().fatal(f"not started, and ends: {self._failure}")
        self.start_failed = True
        self._reporter.wait_for_listeners()
        for _ in range(LAST_REPORTS):
            self._report()
            self._reporter.wait_until_heard()
        self.context.try_shutdown()

    def _warn_of_unused_overrides(self, source: FrameSource) -> None:
        if not self._warned_of_overrides:
            self._warned_of_overrides = True
            for line in unused(self, source.possible_overrides):
                self.get_logger().warning(line)

    @property
    def state(self) -> str:
        """Label of the present lifecycle state."""
        return str(self._state_machine.current_state[1])

    def _make_input(self) -> FrameSource:
        assert self._processor is not None
        return open_input(self, self._processor, self._statistics, self._log, self._node_params)

    def _refusal(self) -> str | None:
        """Return why no cloud can be processed at present."""
        return None if self.state == "active" else f"the node is {self.state}; activate it first"

    def _close_input(self) -> None:
        if self._intake is not None and not self._intake.close():
            self.get_logger().warning(f"the last frame did not end within {STOP_SECONDS:.0f} s")
        if self._processor is not None and self._processor.transforms is not None:
            self._processor.transforms.close()
            self._processor.transforms = None
        self._requests.give_up("the node was deactivated")

    def _take_down(self) -> None:
        self._due_since = None
        self._release()

    def _release(self) -> None:
        self._close_input()
        self._processor = self._intake = None
        if self._outputs is not None:
            self._outputs.destroy()
            self._outputs = None

    # Parameters: checked as a whole, in force from the next frame on.

    def _type_parameters(self, changes: Sequence[Parameter]) -> list[Parameter]:
        return parameters.typed(parameters.typed(changes, Params), NodeParams)

    def _check_parameters(self, changes: Sequence[Parameter]) -> SetParametersResult:
        for current in (self._params, self._node_params):
            result = parameters.check(current, changes)
            if not result.successful:
                return result
        return result

    def _apply_parameters(self, changes: Sequence[Parameter]) -> None:
        before = {**self._params.as_dict(), **self._node_params.as_dict()}
        self._params = parameters.read(self, Params)
        self._node_params = parameters.read(self, NodeParams)
        if self._processor is not None and self._processor.pipeline.params != self._params:
            self._processor.pipeline = Pipeline(self._params)
            if self._intake is not None and self._intake.input is not None:
                self._intake.input.follow_publishers()  # color may count now, or no more
        after = {**self._params.as_dict(), **self._node_params.as_dict()}
        changed = [f"{name} = {value}" for name, value in after.items() if value != before[name]]
        if changed:
            self.get_logger().info(f"parameters changed: {', '.join(changed)}")

    def _report(self) -> None:
        intake, limit = self._intake, self._node_params.inactive_timeout
        source = None if intake is None else intake.input
        if source is not None:
            source.follow_publishers()
        waited = 0.0 if self._due_since is None else time.monotonic() - self._due_since
        condition = Condition(
            self.state,
            self._node_params,
            failure=self._failure,
            asleep=None if intake is None else intake.asleep,
            overdue=waited if 0.0 < limit < waited else 0.0,
        )
        self._reporter.report(condition, source)

    def _follow_demand(self) -> None:
        if self._requests.waiting():
            self._requests.expire(self.resolve_topic_name("points"))
        if self._intake is not None:
            self._intake.follow()
