# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The lifecycle node: what exists in which state, and what happens on the way from one to the other."""

from __future__ import annotations

import os
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
from topo_region_seg.ros import parameters
from topo_region_seg.ros.camera import Camera
from topo_region_seg.ros.input import FrameSource
from topo_region_seg.ros.invalid_transitions import refuse_invalid_transitions
from topo_region_seg.ros.log import ReasonLog
from topo_region_seg.ros.node_params import NodeParams
from topo_region_seg.ros.parameter_names import unknown
from topo_region_seg.ros.qos_overrides import unused
from topo_region_seg.ros.rclpy_private import given_parameters, lifecycle_state
from topo_region_seg.ros.reporter import diagnostics_publisher, wait_for_listeners, wait_until_heard
from topo_region_seg.ros.transforms import Transforms
from topo_region_seg.ros.warm_up import warm_up_kernels

DEMAND_SECONDS = 0.1
"""Time between two looks at who wants clouds."""

LAST_REPORTS = 3
"""How often a node that could not start reports so before its process ends: listeners find it at their own pace."""

RECOVERY = "recovery"


class RegionSegmentation(LifecycleNode):  # type: ignore[misc]  # rclpy is untyped
    """Segment every cloud on `points`, or what depth images show, the newest first; of several cameras each its own.

    Unconfigured: parameters, diagnostics and the service `~/segment_once`. Inactive: also compiled kernels and the
    output topics. Active: also, while clouds are wanted, subscriptions and worker threads.

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
        for line in unknown(given_parameters(self)):
            self.get_logger().warning(line)
        self._cameras: list[Camera] = []
        self._transforms: Transforms | None = None
        self.add_pre_set_parameters_callback(self._type_parameters)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)

        self._failure: str | None = None
        self._due_since: float | None = time.monotonic()
        self._warned_of_overrides = False
        self.start_failed = False
        self._diagnostics = diagnostics_publisher(self)
        self._make_cameras()
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
            self._make_cameras()
            missing = [camera.configure(self._params) for camera in self._cameras]
            if any(missing):
                apt = f"sudo apt install ros-{os.environ.get('ROS_DISTRO') or 'jazzy'}-vision-msgs"
                text = f"{' and '.join(missing[0])} are not published: vision_msgs is missing; {apt}"
                self._log.told("vision_msgs_missing", text)

        return self._transition("configure", configure, undo=self._release)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the output topics and subscribe to the clouds."""

        def activate() -> None:
            super(RegionSegmentation, self).on_activate(state)
            if Transforms.wanted(self._node_params):
                self._transforms = Transforms(self, self._node_params)
            sources = [camera.activate(self._transforms) for camera in self._cameras]
            self._warn_of_unused_overrides(sources)
            self._due_since = None
            topics = ", ".join(source.topic for source in sources)
            self.get_logger().info(f"active: waiting for {sources[0].what} on {topics}")

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
        wait_for_listeners(self._diagnostics)
        for _ in range(LAST_REPORTS):
            self._report()
            wait_until_heard(self._diagnostics)
        self.context.try_shutdown()

    def _warn_of_unused_overrides(self, sources: Sequence[FrameSource]) -> None:
        if not self._warned_of_overrides:
            self._warned_of_overrides = True
            for line in unused(self, [name for source in sources for name in source.possible_overrides]):
                self.get_logger().warning(line)

    @property
    def state(self) -> str:
        """Label of the present lifecycle state."""
        return lifecycle_state(self)

    def _make_cameras(self) -> None:
        """Have the cameras that the parameter names; one of the same name goes on with its counts."""
        names = self._node_params.cameras or ("",)
        present = {camera.name: camera for camera in self._cameras}
        if tuple(present) == names:
            return
        for name in set(present) - set(names):
            present.pop(name).destroy()
        self._cameras = [present.get(name) or self._make_camera(name) for name in names]

    def _make_camera(self, name: str) -> Camera:
        return Camera(self, name, self._diagnostics, self._refusal, lambda: self._node_params)

    def _refusal(self) -> str | None:
        """Return why no cloud can be processed at present."""
        return None if self.state == "active" else f"the node is {self.state}; activate it first"

    def _close_input(self) -> None:
        for camera in self._cameras:
            camera.close_input()
        if self._transforms is not None:
            self._transforms.close()
            self._transforms = None

    def _take_down(self) -> None:
        self._due_since = None
        self._release()

    def _release(self) -> None:
        self._close_input()
        for camera in self._cameras:
            camera.release()

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
        for camera in self._cameras:
            camera.use(self._params)
        after = {**self._params.as_dict(), **self._node_params.as_dict()}
        changed = [f"{name} = {value}" for name, value in after.items() if value != before[name]]
        if changed:
            self.get_logger().info(f"parameters changed: {', '.join(changed)}")

    def _report(self) -> None:
        limit = self._node_params.inactive_timeout
        waited = 0.0 if self._due_since is None else time.monotonic() - self._due_since
        for camera in self._cameras:
            camera.report(self.state, self._failure, waited if 0.0 < limit < waited else 0.0)

    def _follow_demand(self) -> None:
        for camera in self._cameras:
            camera.follow_demand()
