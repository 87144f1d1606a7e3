# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""When the node says that no clouds come, what it advises then, and when it says that they come again."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from builtin_interfaces.msg import Time

from topo_region_seg.ros import reporter as module
from topo_region_seg.ros.advice import CLOUD_TYPE, advice
from topo_region_seg.ros.diagnostics import Condition
from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.log import ReasonLog
from topo_region_seg.ros.missing_images import NAMED
from topo_region_seg.ros.node_params import NodeParams
from topo_region_seg.ros.reporter import DROPS_OVER, Reporter
from topo_region_seg.ros.statistics import Statistics

OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"


class Scene:
    """A reporter whose node, clock and advice are the test's."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.lines: list[str] = []
        self.reports: list[Any] = []
        self.text, self.now = ": advice", 0.0
        self.asleep: str | None = None
        time = SimpleNamespace(monotonic=lambda: self.now)
        monkeypatch.setattr("topo_region_seg.ros.statistics.time", time)
        monkeypatch.setattr(module, "advice", lambda node, source, heard: f"{self.text}, heard {heard}")
        self.statistics = Statistics()
        self.source = SimpleNamespace(topic="/points", what="clouds", hears_the_past=False)
        logger = SimpleNamespace(warning=self.lines.append, info=self.lines.append)
        feed = Feed(self._node(), ReasonLog(logger, lambda: 0.0), statistics=self.statistics)
        self.reporter = Reporter(feed, SimpleNamespace(publish=self.reports.append))

    def _node(self) -> Any:
        return SimpleNamespace(
            get_clock=lambda: SimpleNamespace(now=lambda: SimpleNamespace(to_msg=Time)),
            get_fully_qualified_name=lambda: "/node",
        )

    def report(self, seconds: float = 1.0, state: str = "active", timeout: float = 5.0) -> tuple[bytes, list[str]]:
        """Let time pass and report; return the level and what was logged."""
        self.now += seconds
        self.lines.clear()
        condition = Condition(state, NodeParams(input_timeout=timeout), asleep=self.asleep)
        self.reporter.report(condition, self.source if state == "active" else None)  # type: ignore[arg-type]
        return self.reports[-1].status[0].level, list(self.lines)

    def cloud(self) -> None:
        self.statistics.received(displaced=False, skipped=0)


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Scene:
    return Scene(monkeypatch)


def test_silence_is_said_once_with_its_advice_and_its_end_once(scene: Scene) -> None:
    assert scene.report(4.9) == (OK, [])
    assert scene.report(0.1) == (ERROR, ["no clouds on /points for 5 s: advice, heard False"])
    assert scene.report() == (ERROR, [])
    scene.text = ": other advice"
    assert scene.report() == (ERROR, ["no clouds on /points for 7 s: other advice, heard False"])
    scene.cloud()
    assert scene.report() == (OK, ["clouds are coming in"])
    assert scene.report() == (OK, [])
    assert scene.report(5.0) == (ERROR, ["no clouds on /points for 7 s: other advice, heard True"])


def test_who_is_not_active_waits_for_nothing(scene: Scene) -> None:
    assert scene.report(60.0, state="inactive") == (OK, [])
    scene.report(60.0)
    assert scene.report(60.0, state="inactive") == (OK, []), "nor do any come in"
    assert scene.report(0.0)[1] == ["no clouds on /points for 180 s: advice, heard False"], "anew"


def test_without_a_timeout_and_after_a_latched_cloud_silence_is_no_matter(scene: Scene) -> None:
    assert scene.report(60.0, timeout=0.0) == (OK, [])
    scene.source.hears_the_past = True
    assert scene.report(60.0)[0] == ERROR, "nothing was latched"
    scene.cloud()
    scene.report(0.0)
    assert scene.report(60.0) == (OK, [])


def test_who_takes_no_clouds_misses_none(scene: Scene) -> None:
    scene.asleep = "nobody subscribes"
    assert scene.report(60.0) == (OK, [])
    assert scene.reports[-1].status[0].message == "nobody subscribes"
    scene.asleep = None
    assert scene.report(0.0)[0] == ERROR
    scene.asleep = "nobody subscribes"
    assert scene.report() == (OK, []), "nor are any coming in"


def test_drops_are_told_for_some_reports_and_then_forgotten(scene: Scene) -> None:
    for _ in range(2):
        scene.statistics.received(displaced=True, skipped=0)
    levels = []
    for _ in range(DROPS_OVER + 1):
        scene.cloud()
        levels.append(scene.report()[0])
    assert levels == [WARN] * DROPS_OVER + [OK]


@pytest.mark.parametrize("cameras", range(7))
def test_cameras_are_named_as_far_as_a_line_goes(cameras: int) -> None:
    names = [f"/camera_{number}/points" for number in range(cameras)]
    node: Any = SimpleNamespace(
        get_publishers_info_by_topic=lambda topic: [],
        get_topic_names_and_types=lambda: [("/image", ["sensor_msgs/msg/Image"]), *((n, [CLOUD_TYPE]) for n in names)],
        get_node_names_and_namespaces=lambda: [],
        count_publishers=lambda topic: 1,
    )
    source: Any = SimpleNamespace(topic="/points", kind=CLOUD_TYPE, name="points")
    said = advice(node, source, heard=False)
    assert [name in said for name in names] == [number < 4 for number in range(cameras)] and NAMED == 4
    assert said.endswith(f" (and {cameras - 4} more)") == (cameras > 4)
    assert ("is the camera driver running?" in said) == (cameras == 0)
