# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What the node counts, tells and survives, without a running node."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from builtin_interfaces.msg import Time
from clouds import message, scene

from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.ros.diagnostics import Condition, diagnostics
from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.frame import Frame
from topo_region_seg.ros.log import ReasonLog
from topo_region_seg.ros.node_params import NodeParams
from topo_region_seg.ros.processor import FrameProcessor
from topo_region_seg.ros.statistics import Snapshot, Statistics
from topo_region_seg.steps.view.model import SensorModel
from topo_region_seg.steps.view.table import DepthTable

OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"


class Logger:
    def __init__(self) -> None:
        self.lines: list[str] = []

    def warning(self, text: str) -> None:
        self.lines.append(text)

    info = debug = warning


class FailingPipeline(Pipeline):
    def run(self, cloud: Any, warn: Any = None) -> Any:
        raise ZeroDivisionError("a defect")


def processor(logger: Logger, statistics: Statistics) -> tuple[FrameProcessor, list[Any]]:
    published: list[Any] = []
    node = SimpleNamespace(
        context=SimpleNamespace(ok=lambda: True),
        get_clock=lambda: SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=3 * 10**9)),
        get_logger=lambda: logger,
    )
    outputs = SimpleNamespace(publish=lambda msg, cloud, seg: published.append(seg) or ["labeled_points"])
    demand = SimpleNamespace(declined=lambda arrived: None)
    requests = SimpleNamespace(finish=lambda arrived, success, text: None)
    log = ReasonLog(logger, lambda: 60.0)  # type: ignore[arg-type]
    return FrameProcessor(
        Feed(node, log, statistics=statistics), Pipeline(Params()), outputs, demand, requests
    ), published


def frame() -> Frame:
    return Frame(message(*scene(), height=48))


def test_an_exception_in_a_frame_is_counted_and_the_next_one_answered() -> None:
    logger, statistics = Logger(), Statistics()
    process, published = processor(logger, statistics)
    sound = process.pipeline
    process.pipeline = FailingPipeline(Params())
    for _ in range(3):
        process.process(frame())
    process.pipeline = sound
    process.process(frame())
    now = statistics.snapshot()
    assert (now.processed, now.rejected, len(published)) == (1, {"internal_error": 3}, 1)
    warnings = [line for line in logger.lines if line.startswith("[internal_error]")]
    assert len(warnings) == 1, "throttled"
    assert "ZeroDivisionError: a defect" in warnings[0] and ".py:" in warnings[0]
    assert sum(line.startswith("Traceback") for line in logger.lines) == 3, "for who debugs"


def test_the_first_answer_is_told_and_no_other() -> None:
    logger, statistics = Logger(), Statistics()
    process, published = processor(logger, statistics)
    for _ in range(3):
        process.process(frame())
    (line,) = [line for line in logger.lines if line.startswith("first cloud answered")]
    assert f"64x48 points in frame 'camera', {len(published[0].regions)} regions" in line
    now = statistics.snapshot()
    assert (now.points, now.regions, now.stamp) == (64 * 48, len(published[0].regions), "1.000000002")


@pytest.mark.parametrize(("age", "told"), [(59_999.0, True), (60_000.0, False), (-59_999.0, True), (None, False)])
def test_the_age_of_stamps_is_told_while_they_are_those_of_a_running_camera(age: float | None, told: bool) -> None:
    statistics = Statistics()
    if age is not None:
        statistics.processed({}, 1.0, age, points=1, regions=1, stamp="")
    report = diagnostics(Time(), "/n", Condition("active", NodeParams()), statistics.snapshot(), after()).status[0]
    values = {item.key: item.value for item in report.values}
    assert values.get("stamp age, median (ms)") == (f"{age:.1f}" if told else None)


class TellingPipeline(Pipeline):
    """Tells something of every cloud."""

    def run(self, cloud: Any, warn: Any = None) -> Any:
        warn("thinned", "as was asked for")
        warn("out_of_range", "all points lie beyond max_range")
        return super().run(cloud, warn)


def test_what_is_to_be_known_of_an_answer_is_counted_and_logged_once_in_a_period() -> None:
    logger, statistics = Logger(), Statistics()
    process, published = processor(logger, statistics)
    process.pipeline = TellingPipeline(Params())
    for _ in range(3):
        process.process(frame())
    now = statistics.snapshot()
    assert (now.processed, len(published)) == (3, 3)
    assert now.notices == {"out_of_range": 3}, "and what a parameter asks for is no trouble"
    assert now.notice_texts == {"out_of_range": "all points lie beyond max_range"}
    assert [line for line in logger.lines if line.startswith("[")] == [
        "[thinned] as was asked for",
        "[out_of_range] all points lie beyond max_range",
    ]
    report = diagnostics(Time(), "/n", Condition("active", NodeParams()), now, after()).status[0]
    assert {item.key: item.value for item in report.values}["notice: out_of_range"] == "3"


def test_colors_that_cannot_be_read_stop_only_those_who_compare_them() -> None:
    logger, statistics = Logger(), Statistics()
    process, published = processor(logger, statistics)
    odd = frame()
    next(field for field in odd.msg.fields if field.name == "rgb").datatype = 8
    process.process(odd)
    assert statistics.snapshot().rejected == {"color_type": 1}
    process.pipeline = Pipeline(Params(features="normals"))
    process.process(odd)
    process.process(frame())
    assert statistics.snapshot().processed == len(published) == 2
    assert (published[0].labels == published[1].labels).all()
    assert [line for line in logger.lines if line.startswith("[color_unreadable]")], "and it is said"


def test_warnings_come_once_in_a_period_for_each_reason() -> None:
    logger, period = Logger(), [60.0]
    log = ReasonLog(logger, lambda: period[0])  # type: ignore[arg-type]
    for _ in range(5):
        log.throttled("one", "first")
        log.throttled("two", "second")
        log.once("three", "third")
    assert logger.lines == ["[one] first", "[two] second", "[three] third"]
    period[0] = 0.0
    log.throttled("one", "first")
    assert logger.lines[-1] == "[one] first (and 4 more since the last warning)"


def after(*events: str) -> Snapshot:
    statistics = Statistics()
    for event in events:
        if event.startswith("notice "):
            statistics.noticed(event.split()[1], f"text of {event.split()[1]}")
            continue
        statistics.received(displaced=event == "dropped", skipped=0)
        if event == "processed":
            statistics.processed({"filtration": 1.0}, 2.0, 3.0, points=5, regions=4, stamp="7.000000000")
        elif event != "dropped":
            statistics.rejected(event)
    return statistics.snapshot()


def level(
    now: Snapshot,
    *,
    state: str = "active",
    before: Snapshot | None = None,
    earlier: Snapshot | None = None,
    timeout: float = 5.0,
    params: dict[str, Any] | None = None,
    **more: Any,
) -> tuple[bytes, str]:
    condition = Condition(state, NodeParams(input_timeout=timeout, **(params or {})), **more)
    report = diagnostics(Time(), "/robot/region_segmentation", condition, now, before or after(), earlier)
    status = report.status[0]
    assert status.name == "robot/region_segmentation: segmentation"
    return status.level, status.message


def test_levels_of_the_diagnostics() -> None:
    assert level(after()) == (OK, "waiting for the first cloud")
    assert level(after("processed"))[0] == OK
    assert level(after("processed", "dropped"))[0] == OK, "one drop is no trouble"
    assert level(after("processed", "dropped", "dropped")) == (
        WARN,
        "1 clouds processed, 2 of 3 dropped for newer ones",
    )
    both = level(after("processed", "data_too_short", "bad_stamp", "dropped", "dropped"))
    assert both == (
        WARN,
        "1 clouds processed, 2 clouds rejected (bad_stamp, data_too_short), 2 of 5 dropped for newer ones",
    )
    earlier = after("processed", "data_too_short", "dropped", "dropped")
    assert level(earlier, before=earlier)[0] == OK, "what was told before is not told again"
    assert level(after(), timeout=1e-9)[0] == ERROR
    assert level(after(), timeout=0.0)[0] == OK
    assert level(after("bad_stamp"), state="inactive") == (OK, "inactive")
    for state in ("unconfigured", "active"):
        assert level(after("processed"), state=state, failure="configure failed: why") == (
            ERROR,
            "configure failed: why",
        )
    said = after("processed", "notice far", "notice far", "notice empty")
    assert level(said) == (WARN, "1 clouds processed, empty: text of empty, far: text of far")
    assert level(said, before=said)[0] == OK


def test_drops_are_a_trouble_from_a_share_on() -> None:
    start = after()
    some = after(*["processed"] * 90, *["dropped"] * 10)
    assert level(some, before=some, earlier=start)[0] == OK, "10 % is the limit"
    more = after(*["processed"] * 89, *["dropped"] * 11)
    # Since when they are counted does not depend on the last report.
    assert level(more, before=more, earlier=start) == (WARN, "0 clouds processed, 11 of 100 dropped for newer ones")
    assert level(more, earlier=start, params={"max_dropped": 100.0})[0] == OK
    assert level(some, earlier=start, params={"max_dropped": 0.0})[0] == WARN


def test_latency_and_rate_are_troubles_where_they_are_asked_for() -> None:
    now = after("processed")
    assert level(now, params={"max_latency": 2.0})[0] == OK
    slow = level(now, params={"max_latency": 1.9})
    assert slow == (WARN, "1 clouds processed, latency 2 ms, above 1.9")
    seldom = replace(now, input_hz=4.9, stretch=5.0)
    assert level(seldom, params={"min_input_rate": 4.9})[0] == OK
    few = level(seldom, params={"min_input_rate": 5.0})
    assert few == (WARN, "1 clouds processed, 4.9 clouds a second, below 5")
    assert level(seldom, params={"min_input_rate": 5.0}, latched=True)[0] == OK
    assert level(replace(seldom, stretch=4.9), params={"min_input_rate": 5.0})[0] == OK, "it is not known yet"


def test_who_sleeps_is_well_and_who_should_be_active_is_not() -> None:
    silent = replace(after(), idle=60.0)
    assert level(silent)[0] == ERROR
    assert level(silent, asleep="nobody subscribes") == (OK, "nobody subscribes")
    assert level(silent, latched=True)[0] == OK
    text = "unconfigured for 130 s: activate the node, or set inactive_timeout to 0"
    assert level(silent, state="unconfigured", overdue=130.4) == (ERROR, text)


def test_the_device_has_a_name() -> None:
    statistics = Statistics()
    statistics.processed({}, 1.0, 1.0, points=1, regions=1, stamp="", frame_id="camera")
    for params, name in ((NodeParams(), "camera"), (NodeParams(hardware_id="D435 0815"), "D435 0815")):
        condition = Condition("active", params)
        assert diagnostics(Time(), "/n", condition, statistics.snapshot(), after()).status[0].hardware_id == name


def test_the_camera_of_the_last_cloud_is_told_where_it_is_known() -> None:
    def told(sensor: SensorModel | None) -> dict[str, str]:
        statistics = Statistics()
        statistics.processed({}, 1.0, 1.0, points=1, regions=1, stamp="", sensor=sensor)
        status = diagnostics(Time(), "/n", Condition("active", NodeParams()), statistics.snapshot(), after()).status[0]
        return {value.key: value.value for value in status.values if value.key.startswith("camera: ")}

    assert told(None) == {}
    depth = np.linspace(0.5, 1.5, 10_000)
    model = SensorModel(math.radians(0.1), DepthTable(0.5, 63.0, np.full(64, 0.0012)), 1.0, 0.875, depth.astype("f4"))
    plain = told(model)
    assert plain.pop("camera: step of that depth (mm)") == "none that can be told"
    assert plain == {
        "camera: angle between pixels (deg)": "0.1000",
        "camera: valid pixels (%)": "87.5",
        "camera: median depth (m)": "1.000",
        "camera: noise of that depth (mm)": "1.20",
    }
    stepped = told(replace(model, image=(np.round(depth / 0.002) * 0.002).astype("f4")))
    assert stepped == plain | {"camera: step of that depth (mm)": "2.00"}


@pytest.mark.parametrize("running", [True, False])
def test_whether_anybody_subscribes_may_fail_while_the_node_ends(running: bool) -> None:
    """A signal makes the context invalid while a frame waits: then nothing is said, and nothing is raised ever."""

    def declined(arrived: float) -> str | None:
        raise RuntimeError("publisher's context is invalid")

    logger, statistics = Logger(), Statistics()
    process, published = processor(logger, statistics)
    process._demand.declined = declined  # type: ignore[method-assign]
    process._context = SimpleNamespace(ok=lambda: running)  # type: ignore[assignment]
    process.process(frame())
    assert (statistics.snapshot().rejected, published) == ({"internal_error": 1} if running else {}, [])
    assert bool(logger.lines) == running


def test_what_nobody_wants_is_counted_and_not_processed() -> None:
    logger, statistics = Logger(), Statistics()
    process, published = processor(logger, statistics)
    process._demand.declined = lambda arrived: "nobody subscribes"  # type: ignore[method-assign]
    process.process(frame())
    now = statistics.snapshot()
    assert (now.passed_over, now.processed, now.dropped, published) == ({"nobody subscribes": 1}, 0, 0, [])
    assert logger.lines == ["cloud 1.000000002 passed over: nobody subscribes"]
    report = diagnostics(Time(), "/n", Condition("active", NodeParams()), now, after()).status[0]
    values = {item.key: item.value for item in report.values}
    assert (values["clouds passed over"], values["passed over: nobody subscribes"]) == ("1", "1")


def test_each_frame_is_told_to_who_debugs_and_to_who_asked_for_it() -> None:
    logger, statistics = Logger(), Statistics()
    process, published = processor(logger, statistics)
    answers: list[tuple[bool, str]] = []
    process._requests.finish = lambda arrived, success, text: answers.append((success, text))  # type: ignore
    process.process(frame())
    torn = frame()
    torn.msg.data = torn.msg.data[:-1]
    process.process(torn)
    told = f"cloud 1.000000002: 64x48 points, {len(published[0].regions)} regions, "
    (line,) = [line for line in logger.lines if line.startswith("cloud 1.")]
    assert line.startswith(told) and "filtration" in line and line.endswith("published labeled_points")
    assert [success for success, _ in answers] == [True, False]
    assert answers[0][1].startswith(told) and answers[1][1].endswith("(data_too_short)")


def test_percentiles_of_the_latency() -> None:
    statistics = Statistics()
    for ms in range(1, 101):
        statistics.processed({}, float(ms), 0.0, points=1, regions=1, stamp="")
    assert statistics.snapshot().latencies_ms == {"median": 50.0, "95 %": 95.0, "99 %": 99.0, "max": 100.0}
