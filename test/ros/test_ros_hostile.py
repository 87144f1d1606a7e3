# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One running node, over DDS, and what it must survive: hostile clouds, drivers, time that jumps, QoS, overload."""

from __future__ import annotations

import threading
import time
from array import array
from collections.abc import Callable, Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from places import ROOT

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

import clouds
from drivers import ROWS, Row, published
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import GetState
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.serialization import serialize_message
from ros_harness import NODE, PATIENCE, Client, NodeProcess, label_column, running_node, until
from sensor_msgs.msg import PointCloud2, PointField

from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.simulation import Camera, SimulatedFrame, simulate, tabletop
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

pytestmark = pytest.mark.usefixtures("default_parameters")

POLICY = ROOT / "security" / "region_segmentation.policy.xml"
FLAT = {"voxel_size": 0.0, "remove_floor": False, "min_region_size": 1, "small_regions": "remove"}
"""Parameters that leave small made clouds as they are."""


@pytest.fixture(scope="module")
def node(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[NodeProcess]:
    log = tmp_path_factory.mktemp("hostile") / "log.txt"
    with running_node(ros_domain, log, "-p", "warning_period:=0.0") as process:
        yield process


def ros_message(msg: Any) -> PointCloud2:
    """Return a message of rosbags' classes as one of rclpy's."""
    made = PointCloud2(
        height=msg.height,
        width=msg.width,
        is_bigendian=msg.is_bigendian,
        point_step=msg.point_step,
        row_step=msg.row_step,
        is_dense=msg.is_dense,
        data=array("B", bytes(msg.data)),
    )
    made.header.frame_id = msg.header.frame_id
    made.fields = [PointField(name=f.name, offset=f.offset, datatype=f.datatype, count=f.count) for f in msg.fields]
    return made


def good() -> PointCloud2:
    return ros_message(clouds.message(*clouds.scene(), height=48))


def changed(**values: Any) -> PointCloud2:
    msg = good()
    for name, value in values.items():
        setattr(msg, name, value)
    return msg


def with_field(index: int, **values: Any) -> PointCloud2:
    msg = good()
    for name, value in values.items():
        setattr(msg.fields[index], name, value)
    return msg


def with_fields(*more: PointField) -> PointCloud2:
    msg = good()
    msg.fields = [*msg.fields, *more]
    return msg


def field(name: str, **values: int) -> PointField:
    return PointField(**{"name": name, "offset": 20, "datatype": PointField.FLOAT32, "count": 1, **values})


def xyz_only(xyz: Any, **options: Any) -> PointCloud2:
    return ros_message(clouds.message(np.asarray(xyz), np.full((len(xyz), 3), 90, np.uint8), **options))


def stamped(nanosec: int) -> PointCloud2:
    msg = good()
    msg.header.stamp.nanosec = nanosec
    return msg


# Row of the table of hostile inputs, message, reason of the rejection.
REJECTED: list[tuple[int, Callable[[], PointCloud2], str]] = [
    (1, lambda: changed(width=2**32 - 1, height=2**32 - 1), "too_many_points"),
    (1, lambda: changed(width=2**16, height=2**16), "too_many_points"),
    (2, lambda: changed(width=4_000_001, height=1), "too_many_points"),
    (3, lambda: changed(point_step=0), "field_outside_point"),
    (3, lambda: changed(point_step=19), "field_outside_point"),
    (4, lambda: changed(data=array("B", bytes(100))), "data_too_short"),
    (8, lambda: changed(row_step=7, data=array("B", bytes(48 * 64 * 32 + 8))), "row_step_too_small"),
    (9, lambda: changed(fields=[]), "field_missing"),
    (9, lambda: with_field(2, name="w"), "field_missing"),
    (10, lambda: with_field(3, name="intensity"), "missing_color"),
    (12, lambda: with_field(0, datatype=0), "field_type"),
    (12, lambda: with_field(3, datatype=9), "field_type"),
    (12, lambda: with_field(1, count=0), "field_count"),
    (12, lambda: with_fields(field("x")), "field_duplicate"),
    (12, lambda: with_field(1, offset=2), "field_overlap"),
    (12, lambda: with_field(1, offset=2**32 - 2), "field_outside_point"),
    (14, lambda: with_fields(field("big", count=1_000_000)), "too_many_fields"),
    (14, lambda: with_fields(*(field(f"f{i}") for i in range(2_000))), "too_many_fields"),
    (16, lambda: with_field(0, datatype=PointField.INT32), "coordinate_type"),
    (29, lambda: stamped(10**9), "bad_stamp"),
]


@pytest.mark.parametrize(("row", "make", "reason"), REJECTED, ids=[f"{row}-{reason}" for row, _, reason in REJECTED])
def test_bad_clouds_are_rejected_with_a_reason(
    row: int, make: Callable[[], PointCloud2], reason: str, client: Client, node: NodeProcess
) -> None:
    code = f"[{reason}]"
    before = node.log.count(code)
    stamp = client.publish(make())
    until(lambda: node.log.count(code) > before, f"{code} in the log")
    assert client.labels_of(stamp) is None


def padded() -> PointCloud2:
    return ros_message(clouds.message(*clouds.scene(), height=48, row_padding=24))


def big_endian() -> PointCloud2:
    return ros_message(clouds.message(*clouds.scene(), height=48, big_endian=True))


def float64() -> PointCloud2:
    return ros_message(clouds.message(*clouds.scene(), height=48, driver=clouds.DRIVERS["float64"]))


def with_alpha() -> PointCloud2:
    return ros_message(clouds.message(*clouds.scene(), height=48, alpha=255))


def with_outliers() -> PointCloud2:
    xyz, rgb = clouds.scene()
    xyz[:4] = [[1e6, 0, 1e6], [1e30, 1e30, 1e30], [np.nan, 0, 1], [-np.inf, 0, 1]]
    return ros_message(clouds.message(xyz, rgb, height=48))


def without_frame() -> PointCloud2:
    msg = good()
    msg.header.frame_id = ""
    return msg


ACCEPTED: list[tuple[int, Callable[[], PointCloud2]]] = [
    (5, lambda: changed(data=good().data + array("B", bytes(99)))),
    (6, lambda: changed(row_step=0)),
    (7, padded),
    (13, lambda: with_fields(field("odd", datatype=99, offset=2**32 - 1, count=0))),
    (15, float64),
    (17, big_endian),
    (18, with_alpha),
    (19, with_outliers),
    (22, lambda: xyz_only([[0.0, 0.0, 1.0]])),
    (22, lambda: xyz_only([[0.0, 0.0, 1.0], [0.001, 0.0, 1.0]])),
    (23, lambda: xyz_only(np.ones((500, 3)))),
    (23, lambda: xyz_only(np.linspace([0, 0, 1], [1e-17, 0, 1], 300))),
    (28, without_frame),
]


@pytest.mark.parametrize(("row", "make"), ACCEPTED, ids=[str(row) for row, _ in ACCEPTED])
def test_odd_clouds_are_answered_as_the_pipeline_does(
    row: int, make: Callable[[], PointCloud2], client: Client
) -> None:
    assert client.set_atomically(FLAT).successful
    msg = make()
    answer = client.ask(msg)
    cloud = decode(msg, max_points=10**6)
    expected = Pipeline(Params(**FLAT)).run(cloud).labels
    np.testing.assert_array_equal(label_column(answer), expected)
    assert (answer.height, answer.width) == (msg.height, msg.width)
    assert answer.header.frame_id == msg.header.frame_id


@pytest.mark.parametrize("places", [1, 2, 3, 5])
def test_many_points_at_few_places_are_answered_with_the_default_parameters(places: int, client: Client) -> None:
    spots = np.random.default_rng(places).random((places, 3)) + [0, 0, 1]
    msg = xyz_only(np.repeat(spots, 3000, axis=0))
    expected = Pipeline(Params()).run(decode(msg, max_points=10**6)).labels
    np.testing.assert_array_equal(label_column(client.ask(msg)), expected)


def test_a_cloud_over_max_points_is_thinned_and_answered_whole(client: Client, node: NodeProcess) -> None:
    thinning = {**FLAT, "max_points": 1000, "over_max_points": "thin", "normal_radius": 0.05, "max_radius": 0.05}
    assert client.set_atomically(thinning).successful
    msg = good()
    answers = [label_column(client.ask(msg)) for _ in range(2)]
    expected = Pipeline(Params(**thinning)).run(decode(msg, max_points=10**6))
    assert len(expected.index) <= 1000 < np.count_nonzero(expected.labels)
    for labels in answers:
        np.testing.assert_array_equal(labels, expected.labels)
    assert node.log.count("[thinned] of 3072 points") == 1, "said once"
    before = node.log.count("[too_many_points]")
    assert client.set_parameters({"max_points": 700})[0].successful
    client.publish(msg)  # more than four times as many
    until(lambda: node.log.count("[too_many_points]") > before, "the rejection")


def test_bytes_that_are_no_message_end_nothing(client: Client) -> None:
    whole = serialize_message(good())
    rng = np.random.default_rng(3)
    for junk in (b"", b"junk", whole[:50], whole[:4] + b"\xff" * 99):
        client.points.publish(junk)
    for _ in range(60):
        torn = bytearray(whole)
        for place in rng.integers(4, 160, 4):
            torn[place] = rng.integers(256)
        client.points.publish(bytes(torn))
    client.ask(good())


# --- drivers ---

ON_THE_NODE = ("realsense-ros, default", "Azure Kinect", "Zivid", "gz-sim Harmonic, infinite", "Livox")


@pytest.fixture(scope="module")
def frame() -> SimulatedFrame:
    return simulate(tabletop(3), Camera.kinect(160, 120), seed=3)


@pytest.mark.parametrize("row", [row for row in ROWS if row.name in ON_THE_NODE], ids=lambda row: row.name)
def test_drivers(row: Row, client: Client, frame: SimulatedFrame) -> None:
    params = Params(normal_radius=0.03, max_radius=0.03, features="color+normals" if row.layout.color else "normals")
    assert client.set_atomically({name: getattr(params, name) for name in ("normal_radius", "max_radius", "features")})
    msg = ros_message(published(row, frame.cloud))
    answer = client.ask(msg)
    seg = Pipeline(params).run(decode(msg, max_points=10**6))
    np.testing.assert_array_equal(label_column(answer), seg.labels)
    assert (answer.height, answer.width) == (msg.height, msg.width)
    until(lambda: client.counts[-1].data == len(seg.regions), "the count")


def test_size_organization_and_frame_may_change_from_cloud_to_cloud(client: Client) -> None:
    for height, frame_id in ((48, "left"), (1, "left"), (32, "right"), (48, "")):
        msg = ros_message(clouds.message(*clouds.scene(), height=height))
        msg.header.frame_id = frame_id
        answer = client.ask(msg)
        assert (answer.height, answer.width, answer.header.frame_id) == (msg.height, msg.width, frame_id)


# --- time ---


def test_stamps_may_go_back_repeat_and_be_zero_or_negative(client: Client) -> None:
    msg = good()
    for sec in (2_000_000_000, 1_000, 1_000, 0, -5):
        seen = len(client.labeled)
        msg.header.stamp.sec = sec
        client.points.publish(msg)
        until(lambda seen=seen: len(client.labeled) > seen, f"the answer to stamp {sec}")
        assert client.labeled[-1].header.stamp.sec == sec


def test_simulated_time_that_stands_still_stops_nothing(client: Client) -> None:
    try:
        assert client.set_parameters({"use_sim_time": True})[0].successful
        client.ask(good())
        reports = len(client.diagnostics)
        until(lambda: len(client.diagnostics) > reports + 1, "diagnostics, which follow the wall clock")
        assert client.diagnostics[-1].header.stamp.sec == 0, "nobody publishes /clock"
    finally:
        assert client.set_parameters({"use_sim_time": False})[0].successful


# --- quality of service ---


def test_publishers_that_cannot_be_heard_are_named(client: Client, node: NodeProcess) -> None:
    assert client.set_parameters({"input_reliability": "reliable"})[0].successful
    restart_input(client)
    quiet = client.node.create_publisher(PointCloud2, "points", qos_profile_sensor_data)
    try:
        node.wait_for_log("[incompatible_qos]")
        assert "its reliability is less than this node asks for; set input_reliability to auto" in node.log
        until(lambda: client.figures()["publishers with incompatible QoS"] == "1", "the publisher in the diagnostics")
    finally:
        client.node.destroy_publisher(quiet)
        assert client.set_parameters({"input_reliability": "auto"})[0].successful
        restart_input(client)


def test_a_subscriber_that_asks_for_more_than_is_offered_is_named(client: Client, node: NodeProcess) -> None:
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    subscription = client.node.create_subscription(PointCloud2, "labeled_points", lambda _: None, latched)
    try:
        node.wait_for_log("DURABILITY")
    finally:
        client.node.destroy_subscription(subscription)


def restart_input(client: Client) -> None:
    assert client.change_state(Transition.TRANSITION_DEACTIVATE)
    assert client.change_state(Transition.TRANSITION_ACTIVATE)
    until(client.points.get_subscription_count, "the node to subscribe again")


# --- security ---


def test_the_policy_grants_exactly_what_the_node_has(client: Client) -> None:
    (profile,) = ElementTree.parse(POLICY).iter("profile")
    assert (profile.get("ns"), profile.get("node")) == ("/", NODE[1:])

    def granted(group: str, action: str) -> set[str]:
        names = [
            str(name.text) for element in profile.findall(group) if element.get(action) == "ALLOW" for name in element
        ]
        assert len(set(names)) == len(names)
        return {name.replace("~", NODE) if name[0] in "~/" else f"/{name}" for name in names}

    def present(names_and_types: list[tuple[str, list[str]]]) -> set[str]:
        return {name for name, _ in names_and_types}

    assert {element.tag for element in profile} == {"services", "topics"}
    graph = client.node
    # These only with vision_msgs.
    optional = {"/detections", "/surfaces"}
    published = present(graph.get_publisher_names_and_types_by_node(NODE[1:], "/"))
    assert granted("topics", "publish") - optional == published - optional
    assert optional <= granted("topics", "publish")
    # The clock only with use_sim_time, images with input:=depth, transforms with tf2_ros.
    optional = {"/clock", "/depth/image", "/depth/camera_info", "/color/image", "/tf", "/tf_static"}
    subscribed = present(graph.get_subscriber_names_and_types_by_node(NODE[1:], "/"))
    assert granted("topics", "subscribe") == subscribed | optional
    assert granted("services", "reply") == present(graph.get_service_names_and_types_by_node(NODE[1:], "/"))
    assert not graph.get_client_names_and_types_by_node(NODE[1:], "/")


# --- overload ---


def heavy() -> PointCloud2:
    """Return a cloud that takes a good part of a second: many points within the radius of each."""
    rng = np.random.default_rng(1)
    x, y = (0.002 * grid.ravel() for grid in np.meshgrid(np.arange(500), np.arange(400)))
    xyz = np.column_stack([x, y, 1.0 + rng.normal(0.0, 0.002, x.size)])
    return ros_message(clouds.message(xyz, rng.integers(60, 90, (x.size, 3), np.uint8), height=400))


def slow() -> PointCloud2:
    """Return a cloud of few bytes that, with `SLOWLY`, takes a third of a second: its transport leaves sockets free."""
    rng = np.random.default_rng(1)
    x, y = (0.002 * grid.ravel() for grid in np.meshgrid(np.arange(200), np.arange(200)))
    xyz = np.column_stack([x, y, 1.0 + rng.normal(0.0, 0.002, x.size)])
    return ros_message(clouds.message(xyz, rng.integers(60, 90, (x.size, 3), np.uint8), height=200))


SLOWLY = {"remove_floor": False, "max_radius": 0.03, "normal_radius": 0.1}


def test_services_answer_within_100_ms_while_clouds_are_processed(client: Client) -> None:
    assert client.set_atomically(SLOWLY).successful
    requests: list[tuple[type, str, Any]] = [
        (GetParameters, "get_parameters", GetParameters.Request(names=["max_radius"])),
        (
            SetParameters,
            "set_parameters",
            SetParameters.Request(parameters=[Parameter("color_threshold", value=9.0).to_parameter_msg()]),
        ),
        (GetState, "get_state", GetState.Request()),
    ]
    services = [(client.node.create_client(kind, f"{NODE}/{name}"), request) for kind, name, request in requests]
    for service, _ in services:
        assert service.wait_for_service(PATIENCE)
    msg = slow()
    stamp = client.publish(msg)
    early = 0
    for _ in range(20):
        for service, request in services:
            if client.labels_of(stamp) is not None:
                stamp = client.publish(msg)
                time.sleep(0.05)
            answered = threading.Event()
            service.call_async(request).add_done_callback(lambda _, answered=answered: answered.set())
            assert answered.wait(PATIENCE)
            early += client.labels_of(stamp) is None
            time.sleep(0.02)
    for service, _ in services:
        client.node.destroy_client(service)
    # A few may wait for other processes, or for DDS to send a lost datagram again; a node that works on its executor
    # answers after the cloud, always.
    assert early >= 0.8 * 20 * len(services), f"{early} of {20 * len(services)} calls were answered before the cloud"


def test_every_cloud_is_answered_dropped_or_rejected_even_when_the_input_closes(client: Client) -> None:
    msg = heavy()
    torn = changed(data=array("B", bytes(10)))
    for _ in range(3):
        for _ in range(4):
            client.publish(msg)
            client.publish(torn)
            time.sleep(0.02)
        restart_input(client)
    client.ask(good())

    def settled() -> bool:
        figures = client.figures()
        answered = sum(int(figures[f"clouds {what}"]) for what in ("processed", "dropped", "rejected"))
        return answered == int(figures["clouds received"])

    reports = len(client.diagnostics)
    until(lambda: len(client.diagnostics) > reports + 1 and settled(), f"sums that match: {client.figures()}")
    assert int(client.figures()["clouds dropped"]) > 0


def test_diagnostics_warn_of_rejected_clouds_and_count_them_by_reason(client: Client) -> None:
    before = int(client.figures().get("rejected: data_too_short", "0"))
    reports = len(client.diagnostics)
    client.publish(changed(data=array("B", bytes(10))))
    warned = until(
        lambda: [r.status[0] for r in client.diagnostics[reports:] if "data_too_short" in r.status[0].message],
        "a warning in the diagnostics",
    )
    assert warned[0].level == b"\x01"
    figures = {item.key: item.value for item in warned[0].values}
    assert int(figures["rejected: data_too_short"]) == before + 1
    assert {"latency, median (ms)", "latency, 95 % (ms)", "latency, 99 % (ms)", "latency, max (ms)"} <= set(figures)
    assert figures["stamp (s)"]
