# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One node process over real DDS: clouds in, labels out, parameters, diagnostics."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from ros_harness import Client, NodeProcess, cloud_message, label_column, running_node, until
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

pytestmark = pytest.mark.usefixtures("default_parameters")


@pytest.fixture(scope="module")
def node(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[NodeProcess]:
    log = tmp_path_factory.mktemp("node") / "log.txt"
    with running_node(ros_domain, log, "-p", "warning_period:=0.0", "-p", "max_radus:=0.5") as process:
        yield process


def two_sheets(side: int = 40) -> tuple[Any, Any]:
    """Return a red and a blue square of side x side points, 4 mm apart, and a row without depth."""
    x, y = (0.004 * grid.ravel() for grid in np.meshgrid(np.arange(2 * side), np.arange(side)))
    xyz = np.column_stack([x - 0.16, y, np.where(x < 0.004 * side, 0.8, 1.0)]).astype(np.float32)
    rgb = np.where((x < 0.004 * side)[:, None], [200, 30, 30], [30, 30, 200]).astype(np.uint8)
    xyz[:side] = np.nan
    return xyz, rgb


def sheets_message(side: int = 40) -> PointCloud2:
    return cloud_message(*two_sheets(side), height=side)


def test_labels_keep_header_size_and_order(client: Client) -> None:
    msg = sheets_message()
    counts = len(client.counts)
    answer = client.ask(msg)
    assert answer.header.frame_id == msg.header.frame_id
    assert (answer.height, answer.width) == (40, 80)
    assert [f.name for f in answer.fields] == ["x", "y", "z", "rgb", "label"]
    assert decode(answer, max_points=10_000).xyz.tobytes() == decode(msg, max_points=10_000).xyz.tobytes()
    labels = label_column(answer).reshape(40, 80)
    assert (labels[0, :40] == 0).all(), "points without depth have no label"
    assert set(np.unique(labels)) == {0, 1, 2}
    assert len(set(labels[5:35, 5])) == len(set(labels[5:35, 75])) == 1
    assert labels[20, 5] != labels[20, 75]
    until(lambda: len(client.counts) > counts, "a count")
    assert client.counts[-1].data == 2


def test_live_and_offline_labels_are_identical(client: Client) -> None:
    msg = sheets_message()
    offline = Pipeline(Params()).run(decode(msg, max_points=10_000)).labels
    np.testing.assert_array_equal(label_column(client.ask(msg)), offline)


def test_a_malformed_cloud_is_rejected_and_the_next_one_answered(client: Client, node: NodeProcess) -> None:
    torn = sheets_message()
    torn.data = torn.data[:-7]
    bad = client.publish(torn)
    node.wait_for_log("[data_too_short]")
    good = client.ask(sheets_message())
    assert good.header.stamp.sec > bad
    assert client.labels_of(bad) is None
    until(lambda: client.figures().get("rejected: data_too_short", "0") != "0", "the rejected cloud in the diagnostics")


def test_a_cloud_without_color_is_rejected_until_color_is_not_needed(client: Client, node: NodeProcess) -> None:
    xyz, _ = two_sheets()
    client.publish(cloud_message(xyz, None, height=40))
    node.wait_for_log("[missing_color]")
    assert client.set_parameters({"features": "normals"})[0].successful
    assert set(np.unique(label_column(client.ask(cloud_message(xyz, None, height=40))))) == {0, 1, 2}


@pytest.mark.parametrize("shape", [(0, 0), (0, 1), (1, 0)])
def test_an_empty_cloud_gets_an_empty_answer(client: Client, shape: tuple[int, int]) -> None:
    msg = cloud_message(np.empty((0, 3)), np.empty((0, 3), np.uint8))
    msg.height, msg.width = shape
    msg.row_step = 0
    answer = client.ask(msg)
    assert (answer.height, answer.width, len(answer.data)) == (*shape, 0)
    until(lambda: client.counts[-1].data == 0, "count 0")


def test_a_cloud_without_a_valid_point_gets_label_0_everywhere(client: Client) -> None:
    answer = client.ask(cloud_message(np.full((12, 3), np.nan), np.zeros((12, 3), np.uint8), height=3))
    assert (label_column(answer) == 0).all()
    assert (answer.height, answer.width) == (3, 4)


@pytest.mark.parametrize(
    ("code", "change", "parameters"),
    [
        ("out_of_range", 1000.0, {"max_range": 10.0}),
        ("no_regions", 1.0, {"min_region_size": 1_000_000, "small_regions": "remove"}),
        ("all_invalid", np.nan, {"max_range": 10.0}),
    ],
)
def test_an_answer_without_regions_says_why(
    code: str, change: float, parameters: dict[str, Any], client: Client, node: NodeProcess
) -> None:
    assert client.set_atomically(parameters).successful
    xyz, rgb = two_sheets()

    def count() -> int:
        return int(client.figures().get(f"notice: {code}", "0"))

    seen, before = len(client.diagnostics), count()
    assert not label_column(client.ask(cloud_message(xyz * change, rgb, height=40))).any()
    until(lambda: count() > before, "the notice to be counted")
    reports = [status for report in client.diagnostics[seen:] for status in report.status]
    texts = [
        found[1] for s in reports if (found := re.search(rf"\b{code}: ([^;,]*)", s.message)) and s.level == b"\x01"
    ]
    assert texts
    assert f"[{code}] {texts[0]}" in node.log


def test_what_is_not_always_made_arrives_while_somebody_subscribes(client: Client) -> None:
    inboxes = {
        topic: client.collect(kind, topic)
        for topic, kind in (
            ("regions", PointCloud2),
            ("barcode", PointCloud2),
            ("region_markers", MarkerArray),
            ("region_colors", PointCloud2),
        )
    }
    for topic in inboxes:
        until(lambda topic=topic: client.node.count_subscribers(topic), topic)
    until(lambda: client.ask(sheets_message()) and all(inboxes.values()), "all four")
    regions, bars, markers, colored = (inbox[-1] for inbox in inboxes.values())
    names = [f.name for f in regions.fields]
    assert names[:5] == ["x", "y", "z", "label", "size"]
    assert {"persistence", "L", "a", "b", "normal_x"} <= set(names)
    assert regions.width == 2
    assert [f.name for f in bars.fields] == ["x", "y", "z", "birth", "death", "label"]
    assert bars.width == 40 * 80 - 40, "one bar a valid point"
    assert {m.ns for m in markers.markers} >= {"boxes", "labels"}
    assert regions.header == bars.header
    assert [f.name for f in colored.fields] == ["x", "y", "z", "rgb", "label"]
    assert set(np.unique(label_column(colored))) == {0, 1, 2}


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"max_radius": -1.0}, "out of range"),
        ({"max_radius": float("nan")}, "out of range"),
        ({"max_radius": "wide"}, "max_radius = 'wide': must be a number or auto"),
        ({"normal_radius": "wide"}, "Wrong parameter type"),
        ({"filtration_steps": 0}, "out of range"),
        ({"features": "colour"}, "must be one of color+normals, color, normals"),
        ({"crop_box": [0.0, 1.0]}, "must have 0 or 6 numbers"),
        ({"crop_box": [1.0, 0.0, 0.0, 0.0, 1.0, 1.0]}, "minimum must be less"),
        ({"crop_box": [0.0, 0.0, 0.0, 1.0, 1.0, float("inf")]}, "finite"),
        ({"min_range": 20.0}, "greater than max_range"),
        ({"radius": 0.6}, "radius (0.6) is greater than max_radius (0.5)"),
        ({"min_color_threshold": 50.0}, "greater than color_threshold"),
        ({"autostart": False}, "read-only"),
        ({"no_such": 1.0}, "undeclared"),
    ],
)
def test_invalid_parameters_are_rejected_with_the_reason(client: Client, values: dict[str, Any], reason: str) -> None:
    before = client.get_parameter("max_radius")
    result = client.set_atomically({"max_radius": 0.5, **values})
    assert not result.successful
    assert reason in result.reason
    assert client.get_parameter("max_radius") == before, "nothing of a rejected set is in force"


def test_a_pair_that_contradicts_only_halfway_is_set_at_once(client: Client) -> None:
    assert client.set_atomically({"min_range": 20.0, "max_range": 30.0}).successful
    assert (label_column(client.ask(sheets_message())) == 0).all(), "everything is nearer than 20 m"


def test_changed_parameters_are_in_force_from_the_next_cloud_on(client: Client) -> None:
    assert client.set_parameters({"min_region_size": 10_000, "small_regions": "remove"})[0].successful
    assert (label_column(client.ask(sheets_message())) == 0).all()


def test_the_scale_of_the_regions_is_set_and_left_to_max_radius_again(client: Client) -> None:
    # No two points are as near to each other as this.
    assert client.set_parameters({"radius": 0.0005, "small_regions": "remove"})[0].successful
    assert (label_column(client.ask(sheets_message())) == 0).all()
    assert client.set_parameters({"radius": 0.0})[0].successful
    assert (label_column(client.ask(sheets_message())) > 0).any()


def test_crop_box_is_set_and_emptied_again(client: Client) -> None:
    assert client.set_parameters({"crop_box": [-1.0, -1.0, 0.9, 1.0, 1.0, 1.1]})[0].successful
    cropped = label_column(client.ask(sheets_message())).reshape(40, 80)
    assert (cropped[:, :40] == 0).all()
    # What `ros2 param set NODE crop_box "[]"` sends: an empty list of the first type that fits.
    assert client.set_parameters({"crop_box": Parameter("crop_box", Parameter.Type.BOOL_ARRAY, [])})[0].successful
    assert len(client.get_parameter("crop_box")) == 0
    assert label_column(client.ask(sheets_message())).reshape(40, 80)[20, 5] > 0


def test_objects_are_asked_for_while_it_runs(client: Client) -> None:
    message = sheets_message()
    # The sheets fill the image: by themselves they are taken for background.
    parameters = {"output": "objects", "min_confidence": 0.0}
    assert all(result.successful for result in client.set_parameters(parameters))
    cloud = decode(message, max_points=10**6)
    wanted = Pipeline(Params.from_mapping(parameters)).run(cloud).labels
    np.testing.assert_array_equal(label_column(client.ask(message)), wanted)
    assert wanted.max() == 2


def test_the_scale_is_left_to_the_barcode_while_it_runs(client: Client) -> None:
    message = sheets_message()
    assert client.set_parameters({"max_radius": "auto"})[0].successful
    assert client.get_parameter("max_radius") == "auto"
    cloud = decode(message, max_points=10**6)
    wanted = Pipeline(Params.from_mapping({"max_radius": "auto"})).run(cloud).labels
    np.testing.assert_array_equal(label_column(client.ask(message)), wanted)
    assert client.set_parameters({"max_radius": 0.02})[0].successful
    fixed = Pipeline(Params(max_radius=0.02)).run(cloud).labels
    np.testing.assert_array_equal(label_column(client.ask(message)), fixed)
    assert client.set_parameters({"max_radius": "auto"})[0].successful


def test_supervoxels_are_asked_for_while_it_runs(client: Client) -> None:
    message = sheets_message()
    assert client.set_parameters({"output": "supervoxels"})[0].successful
    wanted = Pipeline(Params(output="supervoxels")).run(decode(message, max_points=10**6)).labels
    np.testing.assert_array_equal(label_column(client.ask(message)), wanted)
    assert wanted.max() > 2


def test_labels_are_tracked_from_the_moment_that_it_is_asked_for(client: Client) -> None:
    first = label_column(client.ask(sheets_message()))
    assert client.set_parameters({"track_regions": True})[0].successful
    tracked = [label_column(client.ask(sheets_message())) for _ in range(2)]
    np.testing.assert_array_equal(tracked[0], tracked[1])
    np.testing.assert_array_equal(tracked[0] > 0, first > 0)
    # What comes back after the small one was out of sight for a frame has its label again.
    assert client.set_parameters({"crop_box": [-1.0, -1.0, 0.9, 1.0, 1.0, 1.1]})[0].successful
    client.ask(sheets_message())
    assert client.set_parameters({"crop_box": []})[0].successful
    np.testing.assert_array_equal(label_column(client.ask(sheets_message())), tracked[0])


def test_parameters_are_described(client: Client) -> None:
    radius = client.describe("max_radius")
    assert "Vietoris-Rips" in radius.description and "[m]" in radius.description
    (bounds,) = radius.floating_point_range
    assert (bounds.from_value, bounds.to_value, bounds.step) == (1e-6, 10.0, 0.0)
    assert client.describe("filtration_steps").integer_range[0].from_value == 1
    assert client.describe("features").additional_constraints == "one of: color+normals, color, normals"
    assert client.describe("autostart").read_only


def test_a_mistyped_parameter_at_start_is_named(node: NodeProcess, client: Client) -> None:
    assert "unknown parameter 'max_radus' ignored; did you mean 'max_radius'?" in node.log


def test_the_newest_of_a_burst_wins_and_drops_are_counted(client: Client) -> None:
    client.ask(sheets_message())
    dropped = int(client.figures()["clouds dropped"])
    big = sheets_message(160)
    stamps = []
    for _ in range(15):
        stamps.append(client.publish(big))
        time.sleep(0.01)
    last = until(lambda: client.labels_of(stamps[-1]), "an answer to the newest cloud")
    assert client.labeled[-1] is last, "nothing older follows"
    assert sum(client.labels_of(stamp) is not None for stamp in stamps) < len(stamps)

    def all_counted() -> bool:
        """Whether each cloud is in one count; an answer is heard shortly before it is counted."""
        figures = client.figures()
        answered = sum(int(figures[f"clouds {name}"]) for name in ("processed", "rejected", "dropped"))
        return int(figures["clouds dropped"]) > dropped and answered == int(figures["clouds received"])

    until(all_counted, "drops in the diagnostics, and sums that match")


def test_best_effort_publishers_are_heard_beside_reliable_ones(client: Client) -> None:
    client.ask(sheets_message())
    quiet = client.node.create_publisher(PointCloud2, "points", qos_profile_sensor_data)
    try:
        until(quiet.get_subscription_count, "the node to change to best effort")
        msg = sheets_message()
        msg.header.frame_id = "quiet"

        def heard() -> bool:
            quiet.publish(msg)
            return client.labeled[-1].header.frame_id == "quiet"

        until(heard, "labels of the best-effort cloud")
        assert client.ask(sheets_message()).header.frame_id != "quiet"
    finally:
        client.node.destroy_publisher(quiet)


def test_diagnostics_tell_rates_times_and_counts(client: Client) -> None:
    client.ask(sheets_message())
    seen = len(client.diagnostics)
    until(lambda: len(client.diagnostics) > seen + 2, "more reports")
    report = client.diagnostics[-1].status[0]
    assert report.name == "region_segmentation: segmentation"
    # Drops of the test before are remembered for ten seconds.
    until(lambda: client.ask(sheets_message()) and client.diagnostics[-1].status[0].level == b"\x00", "a report of OK")
    figures = client.figures()
    assert figures["state"] == "active"
    assert float(figures["output rate (Hz)"]) > 0
    assert float(figures["stage filtration, median (ms)"]) > 0
    assert float(figures["stage filtration, median CPU time (ms)"]) > 0
    assert float(figures["latency, median (ms)"]) > 0
    assert figures["regions"] == "2"
