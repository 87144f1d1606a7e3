# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from itertools import islice
from types import SimpleNamespace

import pytest
from bag_maker import cloud_entries, write_mcap, write_ros1

pytest.importorskip("rclpy", reason="rclpy cannot be imported")

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2

from topo_region_seg.ros import player
from topo_region_seg.ros.player import Playback


@pytest.fixture
def listener(ros_domain):
    """Receives clouds on /points, reliably; every message with its time of arrival."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=ros_domain)
    node = Node("listener", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    received: list[tuple[float, PointCloud2]] = []
    qos = QoSProfile(depth=50, reliability=ReliabilityPolicy.RELIABLE)
    node.create_subscription(PointCloud2, "/points", lambda msg: received.append((time.monotonic(), msg)), qos)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    yield received
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown(context=context)
    thread.join(timeout=5)


def play(domain, *arguments):
    return subprocess.Popen(
        [sys.executable, "-m", "topo_region_seg", "play", *map(str, arguments)],
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finish(process, timeout=60):
    _, err = process.communicate(timeout=timeout)
    return process.returncode, err


@pytest.mark.parametrize("write", [write_mcap, write_ros1])
def test_recorded_clouds_arrive_unchanged(write, listener, ros_domain, tmp_path):
    entries = cloud_entries(3)
    bag = write(tmp_path / ("a.mcap" if write is write_mcap else "a.bag"), entries)
    status, err = finish(play(ros_domain, bag, "--rate", "10"))
    assert status == 0, err
    assert "published 3 clouds" in err
    assert len(listener) == 3
    for (_, msg), (*_, sent) in zip(listener, entries, strict=True):
        assert (msg.header.stamp.sec, msg.header.frame_id) == (sent.header.stamp.sec, sent.header.frame_id)
        assert (msg.height, msg.width, msg.point_step) == (sent.height, sent.width, sent.point_step)
        assert bytes(msg.data) == sent.data.tobytes()


@pytest.fixture
def clock(monkeypatch):
    """The player's time, in which only sleeping takes any; a list of one, seconds."""
    now = [50.0]

    def sleep(seconds):
        assert 0.0 < seconds <= 0.1, "so that Ctrl-C is heard"
        now[0] += seconds

    monkeypatch.setattr(player, "time", SimpleNamespace(monotonic=lambda: now[0], sleep=sleep))
    return now


def at_their_times(clock, times, count, late=0.0, **how):
    """Return when the first `count` clouds of given recorded times went out, seconds; each takes `late` s."""
    node = SimpleNamespace(context=SimpleNamespace(ok=lambda: True))
    recorded = [(int(t * 1e9), str(number)) for number, t in enumerate(times)]
    begun, out = clock[0], []
    for data in islice(player._at_their_times(node, lambda: iter(recorded), Playback("/points", **how), print), count):
        assert data == str(len(out) % len(times))
        out.append(clock[0] - begun)
        clock[0] += late
    return out


@pytest.mark.parametrize("late", [0.0, 0.03])
@pytest.mark.parametrize(
    ("how", "wanted"),
    [
        ({}, [0.0, 1.0, 3.0]),
        ({"rate": 2.0}, [0.0, 0.5, 1.5]),
        ({"hz": 5.0}, [0.0, 0.2, 0.4]),
        ({"loop": True}, [0.0, 1.0, 3.0, 4.5, 5.5, 7.5, 9.0]),  # a mean pause between two rounds
        ({"loop": True, "rate": 2.0}, [0.0, 0.5, 1.5, 2.25, 2.75]),
        ({"loop": True, "hz": 5.0}, [0.0, 0.2, 0.4, 0.6, 0.8]),
    ],
)
def test_clouds_go_out_at_their_times_and_what_sending_takes_delays_none(how, wanted, late, clock):
    assert at_their_times(clock, [7.0, 8.0, 10.0], len(wanted), late, **how) == pytest.approx(wanted, abs=late + 1e-9)


def test_a_single_cloud_is_repeated_once_a_second(clock):
    assert at_their_times(clock, [7.0], 3, loop=True, rate=2.0) == pytest.approx([0.0, 0.5, 1.0])
    assert at_their_times(clock, [7.0], 5) == [0.0]


def test_what_comes_too_late_goes_out_at_once(clock):
    found = at_their_times(clock, [0.0, 1.0, 2.0, 3.0], 4, late=1.7)
    assert found == pytest.approx([0.0, 1.7, 3.4, 5.1])


def test_loop_with_fresh_stamps_until_ctrl_c(listener, ros_domain, tmp_path):
    bag = write_mcap(tmp_path / "a.mcap", cloud_entries(2))
    started = time.time()
    process = play(ros_domain, bag, "--hz", "20", "--loop", "--stamp", "now")
    deadline = time.monotonic() + 30
    while len(listener) < 7 and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    status, err = finish(process)
    assert status == 0 and "Traceback" not in err, err
    assert len(listener) >= 7
    stamps = [msg.header.stamp.sec + msg.header.stamp.nanosec * 1e-9 for _, msg in listener]
    assert stamps == sorted(stamps)
    assert started - 1 < stamps[0] < time.time() + 1
    assert bytes(listener[2][1].data) == bytes(listener[0][1].data)


@pytest.fixture
def handler_of_ctrl_c():
    handler = signal.getsignal(signal.SIGINT)
    yield
    signal.signal(signal.SIGINT, handler)


@pytest.mark.usefixtures("handler_of_ctrl_c")
def test_a_signal_between_two_clouds_ends_as_ctrl_c_does(ros_domain, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros_domain + 50))
    data = serialize_message(PointCloud2())
    playback = Playback("/points", hz=1e6, wait_for=0)
    # The second cloud is due at once: nothing looks at the context between its end and the publishing.
    played = player.play(lambda: iter([(0, data), (0, data)]), playback, report=print, step=rclpy.shutdown)
    assert played.published == 1


def test_signals_after_the_last_cloud_change_nothing(ros_domain, tmp_path):
    bag = write_mcap(tmp_path / "a.mcap", cloud_entries(1))
    process = play(ros_domain + 50, bag, "--wait-for", "0")
    line = process.stderr.readline()
    while process.poll() is None:  # the interpreter takes its time to end
        process.send_signal(signal.SIGINT)
        time.sleep(0.001)
    assert (process.returncode, process.stderr.read()) == (1, ""), "1, as nobody has received it"
    assert line.startswith("published 1 cloud ")


def test_nobody_subscribes(ros_domain, tmp_path):
    bag = write_mcap(tmp_path / "a.mcap", cloud_entries(1))
    status, err = finish(play(ros_domain + 50, bag, "--wait-timeout", "0.5", "--remap-to", "elsewhere"))
    lines = err.strip().splitlines()
    assert status == 2
    assert lines[0].startswith("waiting for a subscriber of /elsewhere")
    assert "0 of 1 subscribed to /elsewhere" in lines[1] and len(lines) == 2


def test_best_effort_without_waiting(ros_domain, tmp_path):
    bag = write_mcap(tmp_path / "a.mcap", cloud_entries(2))
    status, err = finish(play(ros_domain + 50, bag, "--wait-for", "0", "--qos", "best_effort", "--hz", "50"))
    assert status == 1
    assert err.strip().endswith("published 2 clouds of /camera/points on points, but nobody subscribed to /points")


def test_a_subscriber_that_has_not_received_the_last_cloud_is_no_success(ros_domain, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros_domain + 50))
    publisher = SimpleNamespace(topic_name="/points", wait_for_all_acked=lambda _: acknowledged[0])
    playback = Playback("/points")
    for acknowledged in ([True], [False]):
        why = player._why_unheard(publisher, playback, heard=True)
        assert (why is None) == acknowledged[0]
    assert "received the last ones within 5 s" in why and "--ipc=host" in why
    assert player._why_unheard(publisher, replace(playback, reliable=False), heard=True) is None, "nobody acknowledges"


def test_a_middleware_that_cannot_tell_what_was_received_is_no_failure():
    def refuse(_):
        raise player.rclpy_implementation.RCLError("not supported")

    publisher = SimpleNamespace(topic_name="/points", wait_for_all_acked=refuse)
    assert player._why_unheard(publisher, Playback("/points"), heard=True) is None


def pauses(times, **how):
    said = []
    clouds = [(int(t * 1e9), b"") for t in times]
    waits = [wait for wait, _ in player._pauses(clouds, Playback("/points", **how), said.append)]
    return waits, said


def test_gaps_that_no_camera_makes_are_said_and_skipped():
    waits, said = pauses([0.0, 1.7e9, 1.7e9 + 0.5, 1.7e9 + 9.5, 1.7e9 + 30.0])
    assert waits == pytest.approx([0.0, 1.0, 0.5, 9.0, 1.0])
    assert said == [
        "skipped a gap of 53.9 years in the recorded times, before cloud 2",
        "skipped a gap of 20.5 s in the recorded times, before cloud 5",
    ]


def test_times_that_go_back_are_no_wait_and_no_rush():
    waits, said = pauses([100.0, 101.0, 5.0, 6.0, 7.0])
    assert waits == pytest.approx([0.0, 1.0, 0.0, 1.0, 1.0])
    assert not said


@pytest.mark.parametrize(("how", "expected"), [({"rate": 4.0}, [0.0, 0.5, 0.25]), ({"hz": 5.0}, [0.0, 0.2, 0.2])])
def test_the_speed_is_that_which_is_asked_for(how, expected):
    waits, said = pauses([10.0, 12.0, 1e6], **how)
    assert waits == pytest.approx(expected)
    assert len(said) == ("rate" in how), "a frequency has no gaps"


def test_ros_arguments_are_passed_on(ros_domain, tmp_path):
    bag = write_mcap(tmp_path / "a.mcap", cloud_entries(1))
    process = play(ros_domain + 50, bag, "--wait-timeout", "0.3", "--ros-args", "-r", "points:=/camera/depth/points")
    status, err = finish(process)
    assert status == 2 and "/camera/depth/points" in err
