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
    assert "transition refused" in node.log or "Unable to start transition" in node.log, "rclpy's own, from Kilted on"
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


WRONG_OUTPUT = "qos_overrides./labeled_points.publisher.reliability"
WRONG_INPUT = "qos_overrides./points.subscription.reliability"


@pytest.mark.parametrize("name", [WRONG_OUTPUT, WRONG_INPUT])
def test_a_start_that_fails_ends_the_process_and_names_the_parameter(
    name: str, start: Callable[..., NodeProcess], client: Client
) -> None:
    node = start("-p", f"{name}:=besteffort")
    assert node.process.wait(STARTUP) == 1
    text = f"{name} = 'besteffort': must be one of system_default, reliable, best_effort"
    assert text in node.log.splitlines()[-1]
    assert "Traceback" not in node.log
    until(
        lambda: any(r.status[0].level == b"\x02" and text in r.status[0].message for r in client.diagnostics), "ERROR"
    )


def test_a_transition_that_fails_is_an_error_until_one_succeeds(
    start: Callable[..., NodeProcess], client: Client
) -> None:
    node = start("-p", "autostart:=false", "-p", f"{WRONG_INPUT}:=sometimes")
    assert client.change_state(Transition.TRANSITION_CONFIGURE)
    assert not client.change_state(Transition.TRANSITION_ACTIVATE)
    assert client.state() == "inactive"
    assert f"activate failed: {WRONG_INPUT} = 'sometimes'" in node.log

    def newest() -> tuple[bytes, str]:
        status = client.diagnostics[-1].status[0] if client.diagnostics else None
        return (status.level, status.message) if status else (b"", "")

    until(lambda: newest()[0] == b"\x02" and newest()[1].startswith("activate failed"), "an error in the diagnostics")
    assert client.change_state(Transition.TRANSITION_CLEANUP)
    until(lambda: newest() == (b"\x00", "unconfigured"), "no error any more")
    assert node.stop() == 0


def test_a_configuration_that_fails_leaves_nothing_behind(start: Callable[..., NodeProcess], client: Client) -> None:
    name = "qos_overrides./barcode.publisher.depth"
    node = start("-p", "autostart:=false", "-p", f"{name}:=many")
    for _ in range(2):
        assert not client.change_state(Transition.TRANSITION_CONFIGURE)
        assert client.state() == "unconfigured"
        until(lambda: not client.node.count_publishers("labeled_points"), "the topics that were made before to go")
    assert f"configure failed: {name} = 'many': must be a whole number" in node.log
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
    name, value = override.split(":=")
    assert f"qos_overrides./diagnostics.publisher.{name} = '{value}': must be " in node.log
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


def test_a_failing_deactivation_releases_everything_and_starts_over(
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
        failure = "deactivate failed: OSError: the middleware is gone"
        assert failure in capfd.readouterr().err

        def told() -> bool:
            node._report()  # as its timer does once a second: the first one may come before the client knows the node
            return any(report.status[0].message == failure for report in client.diagnostics)

        until(told, "the failure to be told")
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
        ("normal_radius:=2", "normal_radius = 2.0: must be at most 1 m"),
        ("normal_radius:=wide", "normal_radius = 'wide': must be a number"),
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


def test_whole_numbers_and_lists_of_them_are_taken_for_lengths(
    start: Callable[..., NodeProcess], client: Client
) -> None:
    lists = ("-p", "crop_box:=[-1, -2, 0, 1, 2, 3]")
    start("-p", "autostart:=false", "-p", "max_range:=3", "-p", "min_region_size:=50.0", *lists)
    assert (client.get_parameter("max_range"), client.get_parameter("min_region_size")) == (3.0, 50)
    assert list(client.get_parameter("crop_box")) == [-1.0, -2.0, 0.0, 1.0, 2.0, 3.0]
    results = client.set_parameters({"max_range": 4, "crop_box": [0, 0, 0, 1, 1, 1], "warning_period": 2})
    assert [result.successful for result in results] == [True] * 3
    value = client.get_parameter("max_range")
    assert isinstance(value, float) and value == 4.0, "still a double"
    assert not client.set_parameters({"filtration_steps": 2.5})[0].successful
    assert not client.set_parameters({"max_range": 2000})[0].successful


def test_overrides_of_no_topic_are_named(start: Callable[..., NodeProcess]) -> None:
    given = [
        "/pionts.subscription.depth:=3",
        "/points.subscription.durabilty:=volatile",
        "/labeled_points.publisher.durability:=volatile",
        "/points.subscription.depth:=3",
        "/parameter_events.publisher.depth:=10",
    ]
    node = start(*(part for text in given for part in ("-p", f"qos_overrides.{text}")), "-p", "use_sim_timee:=true")
    node.wait_for_log("active: waiting")
    warned = [line.partition("unknown parameter ")[2] for line in node.log.splitlines() if "unknown parameter" in line]
    assert sorted(warned) == [
        "'qos_overrides./labeled_points.publisher.durability' ignored; did you mean "
        "'qos_overrides./labeled_points.publisher.reliability'?",
        "'qos_overrides./pionts.subscription.depth' ignored; did you mean 'qos_overrides./points.subscription.depth'?",
        "'qos_overrides./points.subscription.durabilty' ignored; did you mean "
        "'qos_overrides./points.subscription.durability'?",
        "'use_sim_timee' ignored; did you mean 'use_sim_time'?",
    ]


def test_a_parameter_file_without_effect_is_one_line(start: Callable[..., NodeProcess], tmp_path: Path) -> None:
    other, missing = tmp_path / "other.yaml", tmp_path / "missing.yaml"
    other.write_text("/segmentation:\n  ros__parameters:\n    max_radius: 0.03\n")
    node = start("--params-file", str(other), "-p", "autostart:=false")
    node.wait_for_log("autostart is off")
    assert f"{other}: holds parameters for /segmentation, none for /region_segmentation" in node.log
    refused = start("--params-file", str(missing))
    assert refused.process.wait(STARTUP) == 2
    assert str(missing) in refused.log.splitlines()[-1] and "Error opening YAML file" in refused.log.splitlines()[-1]
    assert "Traceback" not in refused.log


def test_without_a_folder_for_logs_it_runs_and_says_so(
    start: Callable[..., NodeProcess], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "file" / "log"))
    node = start("-p", "autostart:=false")
    node.wait_for_log("autostart is off")
    assert "no log file is written" in node.log and "set ROS_LOG_DIR" in node.log
    assert node.stop() == 0


def test_silence_is_reported_with_advice(start: Callable[..., NodeProcess], client: Client) -> None:
    node = start("-p", "input_timeout:=2.0", "-p", "warning_period:=1.0", "-r", "points:=elsewhere")
    node.wait_for_log("no clouds on /elsewhere")
    # In the first or a later report: discovery may take longer than the silence.
    node.wait_for_log("-r points:=/points")
    until(
        lambda: client.diagnostics and client.diagnostics[-1].status[0].level == b"\x02", "an error in the diagnostics"
    )
    assert client.diagnostics[-1].status[0].message.startswith("no clouds for")
