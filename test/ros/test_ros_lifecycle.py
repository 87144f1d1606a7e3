# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The node from start to end: lifecycle services, signals, and what is wrong on the command line."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from places import ROOT

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

import rclpy
from lifecycle_msgs.msg import Transition
from ros_harness import STARTUP, Client, NodeProcess, cloud_message, until

from topo_region_seg.ros.input import Input
from topo_region_seg.ros.region_segmentation import RegionSegmentation

CONFIG = ROOT / "config" / "region_segmentation.yaml"


@pytest.fixture
def start(ros_domain: int, tmp_path: Path) -> Iterator[Callable[..., NodeProcess]]:
    """Start nodes in a domain next to that of the other tests; all are ended afterwards."""
    nodes: list[NodeProcess] = []

    def start_one(*ros_args: str) -> NodeProcess:
        nodes.append(NodeProcess(ros_domain + 50, tmp_path / f"log{len(nodes)}.txt", *ros_args))
        return nodes[-1]

    yield start_one
    for node in nodes:
        node.stop()
        print(node.log)


@pytest.fixture
def client(ros_domain: int) -> Iterator[Client]:
    client = Client(ros_domain + 50)
    yield client
    client.close()


def test_every_transition_by_its_service(start: Callable[..., NodeProcess], client: Client) -> None:
    node = start("-p", "autostart:=false", "-p", "input_timeout:=0.0")
    assert client.state() == "unconfigured"
    assert not client.change_state(Transition.TRANSITION_ACTIVATE), "not possible yet, and no reason to die"
    assert "transition refused" in node.log
    assert client.state() == "unconfigured"

    msg = cloud_message(np.random.default_rng(1).random((100, 3)), np.zeros((100, 3), np.uint8))
    for _ in range(2):  # a second round finds no remains of the first
        assert client.change_state(Transition.TRANSITION_CONFIGURE)
        assert client.state() == "inactive"
        assert not client.node.count_subscribers("points"), "an inactive node holds no subscription"
        assert client.change_state(Transition.TRANSITION_ACTIVATE)
        client.wait_for_node()
        assert len(client.ask(msg).data) == 100 * 20
        until(lambda: client.figures()["state"] == "active", "the state in the diagnostics")
        assert client.change_state(Transition.TRANSITION_DEACTIVATE)
        until(lambda: not client.points.get_subscription_count(), "the subscription to go")
        answered = len(client.labeled)
        client.publish(msg)
        assert client.change_state(Transition.TRANSITION_CLEANUP)
        assert client.state() == "unconfigured"
        until(lambda: not client.node.count_publishers("labeled_points"), "the topics to go")
        assert len(client.labeled) == answered

    assert client.change_state(Transition.TRANSITION_CONFIGURE)
    assert client.change_state(Transition.TRANSITION_ACTIVATE)
    assert client.change_state(Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert client.state() == "finalized"
    assert node.stop() == 0
    assert "Traceback" not in node.log


def test_a_failing_configuration_is_logged_and_leaves_the_node_unconfigured(
    start: Callable[..., NodeProcess], client: Client
) -> None:
    node = start("-p", "qos_overrides./labeled_points.publisher.reliability:=sometimes")
    node.wait_for_log("configure failed")
    assert "sometimes" in node.log
    assert client.state() == "unconfigured"
    assert node.stop() == 0


def test_topics_take_quality_of_service_from_parameters(start: Callable[..., NodeProcess], client: Client) -> None:
    policies = {"reliability": "best_effort", "depth": 3, "durability": "volatile"}
    overrides = [f"-p qos_overrides./points.subscription.{name}:={value}" for name, value in policies.items()]
    overrides.append("-p qos_overrides./labeled_points.publisher.reliability:=best_effort")
    overrides.append("-p qos_overrides./diagnostics.publisher.reliability:=best_effort")
    node = start(*" ".join(overrides).split())
    node.wait_for_log("active: waiting")
    until(lambda: client.points.get_subscription_count(), "the node to subscribe")
    (info,) = client.node.get_subscriptions_info_by_topic("points")
    assert info.qos_profile.reliability.name == "BEST_EFFORT", "although the only publisher is reliable"
    assert client.get_parameter("qos_overrides./points.subscription.depth") == 3
    assert client.get_parameter("qos_overrides./diagnostics.publisher.depth") == 10
    for topic, reliability in (
        ("labeled_points", "BEST_EFFORT"),
        ("/diagnostics", "BEST_EFFORT"),
        *((topic, "RELIABLE") for topic in ("region_count", "regions", "barcode", "region_markers", "region_colors")),
    ):
        (info,) = client.node.get_publishers_info_by_topic(topic)
        assert info.qos_profile.reliability.name == reliability
        for policy in ("history", "depth", "reliability"):
            name = f"qos_overrides.{client.node.resolve_topic_name(topic)}.publisher.{policy}"
            assert client.get_parameter(name), name


@pytest.mark.parametrize("override", ["reliability:=sometimes", "depth:=many"])
def test_an_impossible_quality_of_service_of_the_diagnostics_is_one_line(
    override: str, start: Callable[..., NodeProcess]
) -> None:
    node = start("-p", f"qos_overrides./diagnostics.publisher.{override}")
    assert node.process.wait(STARTUP) == 2
    assert "/diagnostics: " in node.log and override.partition(":=")[2] in node.log
    assert "Traceback" not in node.log


@pytest.mark.parametrize("enclave", ["region_segmentation", "unknown"])
def test_a_keystore_that_cannot_be_used_is_one_line(
    enclave: str, start: Callable[..., NodeProcess], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Enforced security must never become a node without it: rcl finds files without content, or no folder.
    folder = tmp_path / "keystore" / "enclaves" / "region_segmentation"
    folder.mkdir(parents=True)
    for name in ("identity_ca.cert", "permissions_ca.cert", "cert", "key"):
        (folder / f"{name}.pem").touch()
    for name in ("governance", "permissions"):
        (folder / f"{name}.p7s").touch()
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", str(tmp_path / "keystore"))
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    node = start("--enclave", f"/{enclave}")
    assert node.process.wait(STARTUP) == 2
    assert "Traceback" not in node.log
    wanted = "error creating node" if enclave == "region_segmentation" else "does not exist"
    assert wanted in node.log.splitlines()[-1]


def test_a_failing_activation_is_logged_and_leaves_the_node_inactive(
    start: Callable[..., NodeProcess], client: Client
) -> None:
    node = start("-p", "qos_overrides./points.subscription.reliability:=sometimes")
    node.wait_for_log("activate failed")
    assert "sometimes" in node.log
    assert client.state() == "inactive"
    assert client.change_state(Transition.TRANSITION_CLEANUP)
    assert node.stop() == 0


def test_a_failing_deactivation_releases_everything_and_begins_anew(
    ros_domain: int, client: Client, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    rclpy.init(domain_id=ros_domain + 50)
    node = RegionSegmentation()
    try:
        node.trigger_configure()
        node.trigger_activate()
        assert node.state == "active"
        until(lambda: client.node.count_subscribers("points"), "the subscription")
        close, calls = Input.close, []

        def fail_once(self: Input, timeout: float) -> bool:
            calls.append(timeout)
            if len(calls) == 1:
                raise OSError("the middleware is gone")
            return close(self, timeout)

        monkeypatch.setattr(Input, "close", fail_once)
        node.trigger_deactivate()
        assert node.state == "unconfigured"
        assert "deactivate failed: OSError: the middleware is gone" in capfd.readouterr().err
        until(lambda: not client.node.count_subscribers("points"), "the subscription to go")
        until(lambda: not client.node.count_publishers("labeled_points"), "the topics to go")
        node.trigger_configure()
        node.trigger_activate()
        assert node.state == "active"
    finally:
        node.destroy_node()
        rclpy.shutdown()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("when", ["active", "unconfigured", "busy"])
def test_a_signal_ends_the_node_cleanly(
    start: Callable[..., NodeProcess], ros_domain: int, number: signal.Signals, when: str
) -> None:
    node = start("-p", f"autostart:={str(when != 'unconfigured').lower()}")
    node.wait_for_log("autostart is off" if when == "unconfigured" else "active: waiting")
    if when == "busy":
        client = Client(ros_domain + 50)
        client.wait_for_node()
        rng = np.random.default_rng(1)
        client.publish(cloud_message(rng.random((200_000, 3)), rng.integers(0, 255, (200_000, 3), np.uint8)))
        until(lambda: client.figures()["clouds received"] != "0", "the cloud to arrive")
        client.close()
    assert node.stop(number) == 0
    assert "Traceback" not in node.log
    assert "Error" not in node.log


def test_the_shipped_parameter_file_is_the_default(start: Callable[..., NodeProcess], client: Client) -> None:
    node = start("--params-file", str(CONFIG), "-r", "__ns:=/robot")
    node.wait_for_log("active: waiting for clouds on /robot/points")
    assert "unknown parameter" not in node.log


@pytest.mark.parametrize(
    ("argument", "text"),
    [
        ("normal_radius:=1", "normal_radius = 1: ROS tells 1 from 1.0; write 1.0"),
        ("max_radius:=-1.0", "max_radius = -1.0: must be at least 1e-06 m"),
        ("features:=colour", "features = 'colour': must be one of color+normals, color, normals"),
        ("min_range:=11.0", "min_range (11.0) is greater than max_range (10.0)"),
        ("crop_box:=[1.0]", "crop_box = [1.0]: must have 0 or 6 numbers, has 1"),
        ("no value", "Failed to parse ROS arguments"),
    ],
)
def test_invalid_start_values_are_named_in_one_line(
    start: Callable[..., NodeProcess], argument: str, text: str
) -> None:
    node = start("-p", argument)
    assert node.process.wait(20) == 2
    assert text in node.log
    assert "Traceback" not in node.log


def test_silence_is_reported_with_advice(start: Callable[..., NodeProcess], client: Client) -> None:
    node = start("-p", "input_timeout:=2.0", "-p", "warning_period:=1.0", "-r", "points:=elsewhere")
    node.wait_for_log("no clouds on /elsewhere")
    # In the first or a later report: discovery may take longer than the silence.
    node.wait_for_log("-r points:=/points")
    until(
        lambda: client.diagnostics and client.diagnostics[-1].status[0].level == b"\x02", "an error in the diagnostics"
    )
    assert client.diagnostics[-1].status[0].message.startswith("no clouds for")
