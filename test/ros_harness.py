# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The node in a process of its own, and a client that talks to it over DDS. Import only where rclpy is."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from array import array
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.srv import ChangeState, GetState
from places import ROOT, TEST
from rcl_interfaces.msg import Parameter as ParameterMsg
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters, SetParametersAtomically
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import UInt32

from topo_region_seg.params import Params

NODE = "/region_segmentation"
PATIENCE = 20.0
"""Seconds for what takes a fraction of one on an idle machine."""
STARTUP = 150.0
"""Seconds for what may have to wait for kernels to be compiled."""


def until(condition: Callable[[], Any], what: str, timeout: float = PATIENCE) -> Any:
    """Return the first true value of `condition`, or fail after `timeout` seconds."""
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.02)
    raise AssertionError(f"not within {timeout:.0f} s: {what}")


class NodeProcess:
    """`region_segmentation_node` in its own process; its log goes to `log_file`.

    `environment` is what differs from this process's.
    """

    def __init__(
        self, domain: int, log_file: Path, *ros_args: str, environment: Mapping[str, str] | None = None
    ) -> None:
        self._log_file = log_file
        env = {**os.environ, "ROS_DOMAIN_ID": str(domain), "PYTHONPATH": str(ROOT), **(environment or {})}
        command = [sys.executable, "-m", "topo_region_seg.ros.node", "--ros-args", *ros_args]
        with log_file.open("w") as log:
            self.process = subprocess.Popen(command, cwd=log_file.parent, env=env, stdout=log, stderr=log)

    @property
    def log(self) -> str:
        return self._log_file.read_text()

    def wait_for_log(self, text: str, timeout: float = STARTUP) -> None:
        def found() -> bool:
            assert self.process.poll() is None or text in self.log, self.log
            return text in self.log

        until(found, f"'{text}' in the log:\n{self.log}", timeout)

    def stop(self, number: signal.Signals = signal.SIGINT) -> int:
        """Send a signal, return the exit status."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise


@contextmanager
def running_node(
    domain: int, log_file: Path, *ros_args: str, environment: Mapping[str, str] | None = None
) -> Iterator[NodeProcess]:
    """Run a node, show its log in the end, and hold that it ended well and met no unforeseen error."""
    process = NodeProcess(domain, log_file, *ros_args, environment=environment)
    try:
        yield process
    finally:
        status = process.stop()
        print(process.log)
    assert status == 0
    assert "Traceback" not in process.log
    assert "internal_error" not in process.log


class Client:
    """A node in the test's process, spinning on a thread: publishes clouds, collects answers, calls services.

    With `labels` false it subscribes to diagnostics alone.
    """

    def __init__(self, domain: int, *, labels: bool = True) -> None:
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node("client", context=self.context)
        self.points = self.node.create_publisher(PointCloud2, "points", 10)
        self.labeled = self.collect(PointCloud2, "labeled_points") if labels else []
        self.counts = self.collect(UInt32, "region_count") if labels else []
        self.diagnostics = self.collect(DiagnosticArray, "/diagnostics")
        self._sent = 0
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._executor.shutdown()
        self._thread.join(PATIENCE)
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.context)

    def collect(self, kind: type, topic: str) -> list[Any]:
        """Return a list that every message of `topic` is appended to."""
        inbox: list[Any] = []
        self.node.create_subscription(kind, topic, inbox.append, QoSProfile(depth=100))
        return inbox

    def wait_for_node(self) -> None:
        """Wait until clouds reach the node and its labels reach the client."""
        until(self.points.get_subscription_count, "a subscription to the clouds", STARTUP)
        until(lambda: self.node.count_publishers("labeled_points"), "a publisher of labels")
        until(lambda: self.diagnostics, "diagnostics")

    def reset_parameters(self) -> None:
        """Give the segmentation its default parameters, but for lists: an empty one is of no type."""
        values = {row.name: row.default for row in Params.table() if row.type is not tuple}
        assert self.set_atomically(values).successful

    def publish(self, msg: PointCloud2) -> int:
        """Publish with a stamp of its own; return the stamp's seconds."""
        self._sent += 1
        msg.header.stamp.sec = self._sent
        self.points.publish(msg)
        return self._sent

    def labels_of(self, stamp: int) -> Any:
        return next((m for m in reversed(self.labeled) if m.header.stamp.sec == stamp), None)

    def ask(self, msg: PointCloud2) -> PointCloud2:
        """Publish until the node answers: a best-effort subscription may miss a cloud."""
        stamps: list[int] = []
        for _ in range(5):
            stamps.append(self.publish(msg))
            try:
                return until(lambda: next(filter(None, map(self.labels_of, stamps)), None), "labels", 5.0)
            except AssertionError:
                continue
        raise AssertionError("no labels for any of 5 clouds")

    def call(self, kind: type, name: str, request: Any) -> Any:
        client = self.node.create_client(kind, f"{NODE}/{name}")
        try:
            assert client.wait_for_service(PATIENCE), f"service {name} is missing"
            done = threading.Event()
            future = client.call_async(request)
            future.add_done_callback(lambda _: done.set())
            assert done.wait(STARTUP), f"no answer from {name}"
            return future.result()
        finally:
            self.node.destroy_client(client)

    def state(self) -> str:
        return str(self.call(GetState, "get_state", GetState.Request()).current_state.label)

    def change_state(self, transition: int) -> bool:
        request = ChangeState.Request()
        request.transition.id = transition
        return bool(self.call(ChangeState, "change_state", request).success)

    def set_parameters(self, values: Mapping[str, Any]) -> list[Any]:
        request = SetParameters.Request(parameters=_messages(values))
        return list(self.call(SetParameters, "set_parameters", request).results)

    def set_atomically(self, values: Mapping[str, Any]) -> Any:
        request = SetParametersAtomically.Request(parameters=_messages(values))
        return self.call(SetParametersAtomically, "set_parameters_atomically", request).result

    def get_parameter(self, name: str) -> Any:
        value = self.call(GetParameters, "get_parameters", GetParameters.Request(names=[name])).values[0]
        return Parameter.from_parameter_msg(ParameterMsg(name=name, value=value)).value

    def describe(self, name: str) -> Any:
        return self.call(
            DescribeParameters, "describe_parameters", DescribeParameters.Request(names=[name])
        ).descriptors[0]

    def figures(self) -> dict[str, str]:
        """Return the values of the newest diagnostics."""
        return {item.key: item.value for item in self.diagnostics[-1].status[0].values}


class Heard:
    """What a listener in a process of its own hears on some topics.

    Parameters
    ----------
    folder : Path
        Where it writes the messages, CDR.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def all(self, name: str) -> list[bytes]:
        """Return the messages of a topic, serialized, in their order."""
        return [file.read_bytes() for file in sorted(self._folder.glob(f"{name}.*.cdr"))]

    def forget(self) -> None:
        for file in self._folder.glob("*.cdr"):
            file.unlink(missing_ok=True)


@contextmanager
def listening(
    domain: int, folder: Path, topics: Mapping[str, str], environment: Mapping[str, str] | None = None
) -> Iterator[Heard]:
    """Listen to topics, names without a slash and their types, with message packages that only `environment` has."""
    command = [sys.executable, str(TEST / "ros_listener.py"), str(domain), str(folder)]
    command += [f"/{name}={kind}" for name, kind in topics.items()]
    env = {**os.environ, "PYTHONPATH": str(ROOT), **(environment or {})}
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "listening\n"
            yield Heard(folder)
        finally:
            process.kill()


def _messages(values: Mapping[str, Any]) -> list[ParameterMsg]:
    return [
        (value if isinstance(value, Parameter) else Parameter(name, value=value)).to_parameter_msg()
        for name, value in values.items()
    ]


def cloud_message(xyz: npt.NDArray[Any], rgb: npt.NDArray[Any] | None, height: int = 1) -> PointCloud2:
    """Return the points as depth_image_proc lays them out: x0 y4 z8 rgb16, point_step 32."""
    names, offsets = ["x", "y", "z"], [0, 4, 8]
    if rgb is not None:
        names, offsets = [*names, "rgb"], [*offsets, 16]
    layout = {"names": names, "formats": ["<f4"] * len(names), "offsets": offsets, "itemsize": 32}
    table = np.zeros(len(xyz), np.dtype(layout))
    for axis, name in enumerate("xyz"):
        table[name] = xyz[:, axis]
    if rgb is not None:
        red, green, blue = rgb.astype(np.uint32).T
        table["rgb"] = (red << 16 | green << 8 | blue).view(np.float32)
    data = array("B")
    data.frombytes(table.tobytes())
    width = len(xyz) // height
    msg = PointCloud2(height=height, width=width, point_step=32, row_step=32 * width, is_dense=False, data=data)
    msg.fields = [
        PointField(name=name, offset=offset, datatype=PointField.FLOAT32, count=1)
        for name, offset in zip(names, offsets, strict=True)
    ]
    msg.header.frame_id = "camera_depth_optical_frame"
    return msg


def label_column(msg: PointCloud2) -> npt.NDArray[np.uint32]:
    """Return the labels of a labeled cloud."""
    offset = next(f.offset for f in msg.fields if f.name == "label")
    table = np.frombuffer(msg.data, np.uint8).reshape(-1, msg.point_step)
    return table[:, offset : offset + 4].copy().view("<u4")[:, 0]
