# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which clouds are wanted, with subscribers, requests and a clock of the test's."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from topo_region_seg.ros import demand as module
from topo_region_seg.ros.demand import KEPT_OPEN, NOBODY, NOT_REQUESTED, RATE_LIMIT, SETTLING, Demand
from topo_region_seg.ros.intake import Intake
from topo_region_seg.ros.node_params import NodeParams


class Scene:
    """A demand whose subscribers, requests, parameters and time the test sets, and an intake that follows it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 1000.0
        self.subscribed, self.requested_at = False, float("inf")
        self.params = NodeParams()
        self.latched = self.broken = False
        self.opened: list[str] = []
        self.lines: list[str] = []
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: self.now))
        requests = SimpleNamespace(waiting=lambda arrived=float("inf"): self.requested_at < float("inf")
                                   and self.requested_at <= arrived)  # fmt: skip
        outputs: Any = SimpleNamespace(wanted=lambda: self.subscribed)
        self.demand = Demand(outputs, requests, lambda: self.params)  # type: ignore[arg-type]
        logger = SimpleNamespace(info=self.lines.append)
        log = SimpleNamespace(logger=logger, throttled=lambda reason, text: self.lines.append(f"[{reason}] {text}"))
        feed: Any = SimpleNamespace(log=log, statistics=SimpleNamespace(restart=lambda: None))
        self.intake = Intake(feed, self._make, self.demand)

    def _make(self) -> Any:
        if self.broken:
            raise OSError("no room")
        self.opened.append("open")
        return SimpleNamespace(
            what="clouds",
            topic="/points",
            hears_the_past=self.latched,
            close=lambda timeout: self.opened.append("closed") or True,
        )

    def declined(self, at: float | None = None) -> str | None:
        return self.demand.declined(self.now if at is None else at)


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Scene:
    return Scene(monkeypatch)


def test_who_subscribes_gets_all_and_nobody_nothing(scene: Scene) -> None:
    scene.now += 1.01 * SETTLING
    assert scene.declined() == NOBODY
    scene.subscribed = True
    assert scene.declined() is None
    scene.requested_at, scene.subscribed = 2000.0, False
    assert scene.declined(1999.0) == NOBODY, "it came before the request"
    assert scene.declined(2000.0) is None


def test_just_after_activation_all_are_processed(scene: Scene) -> None:
    assert scene.declined() is None
    assert scene.demand.missed, "but nobody gets them"


def test_on_request_clouds_are_processed_for_requests_alone(scene: Scene) -> None:
    scene.params, scene.subscribed = NodeParams(on_request=True), True
    assert (scene.declined(), scene.demand.wanted()) == (NOT_REQUESTED, False)
    scene.requested_at = scene.now
    assert (scene.declined(), scene.demand.wanted()) == (None, True)


@pytest.mark.parametrize(
    ("limit", "wanted"), [(0.0, 300), (10.0, 100), (15.0, 150), (20.0, 200), (29.0, 290), (90.0, 300)]
)
def test_the_rate_is_kept_on_average_whatever_the_camera_s(scene: Scene, limit: float, wanted: int) -> None:
    scene.params, scene.subscribed = NodeParams(rate_limit=limit), True
    taken = 0
    for number in range(300):  # ten seconds of a camera whose clouds come a little early or late
        at = scene.now + number / 30.0 + (0.004 if number % 3 else -0.004)
        reason = scene.declined(at)
        assert reason in (None, RATE_LIMIT)
        taken += reason is None
    assert 0.95 * wanted <= taken <= wanted + 1


def test_what_was_missed_is_not_made_up_for(scene: Scene) -> None:
    scene.params, scene.subscribed = NodeParams(rate_limit=1.0), True
    assert scene.declined(5000.0) is None
    assert scene.declined(5000.9) == RATE_LIMIT
    assert scene.declined(5060.0) is None
    assert [scene.declined(5060.0 + t) for t in (0.1, 0.5, 0.9)] == [RATE_LIMIT] * 3
    scene.requested_at = 5060.8
    assert scene.declined(5060.95) is None, "a request is no matter of rates"


def test_the_input_is_open_while_somebody_wants_clouds_and_shortly_after(scene: Scene) -> None:
    scene.intake.follow()
    assert scene.opened == [], "not active"
    scene.intake.start()
    assert scene.opened == ["open"] and scene.intake.asleep is None
    scene.now += 60.0
    scene.intake.follow()
    assert scene.opened == ["open"], "no clouds come, which only an open input can tell"
    assert scene.declined() == NOBODY
    scene.subscribed = True
    scene.intake.follow()
    scene.declined()
    scene.subscribed = False
    scene.now += KEPT_OPEN
    scene.intake.follow()
    assert scene.opened == ["open"]
    scene.now += 0.01
    scene.intake.follow()
    assert scene.opened == ["open", "closed"]
    assert scene.intake.asleep == NOBODY and scene.intake.input is None
    assert scene.lines == [f"{NOBODY}: not listening to /points meanwhile"]
    scene.subscribed = True
    scene.intake.follow()
    assert scene.opened == ["open", "closed", "open"] and scene.intake.asleep is None
    assert scene.lines[-1] == "clouds are wanted: listening to /points"
    scene.now += 60.0
    scene.intake.follow()
    scene.subscribed = False
    scene.declined()
    scene.intake.follow()
    assert len(scene.opened) == 3, "who comes back soon finds it open"
    assert scene.intake.close() and scene.opened[3:] == ["closed"]
    scene.subscribed = True
    scene.intake.follow()
    assert scene.intake.asleep is None and len(scene.opened) == 4, "no more"
    assert scene.intake.close()


def test_what_was_published_once_comes_again_for_who_subscribes_late(scene: Scene) -> None:
    scene.latched = True
    scene.intake.start()
    scene.declined()
    scene.subscribed = True
    scene.intake.follow()
    assert scene.opened == ["open", "closed", "open"]
    scene.intake.follow()
    assert len(scene.opened) == 3, "once"


def test_an_input_that_cannot_be_opened_is_tried_again(scene: Scene) -> None:
    scene.latched = True
    scene.intake.start()
    scene.declined()
    scene.subscribed = scene.broken = True
    scene.intake.follow()
    assert scene.lines == ["[input_not_opened] cannot listen to clouds: OSError: no room"]
    assert scene.intake.input is None
    scene.broken = False
    scene.intake.follow()
    assert scene.intake.input is not None
