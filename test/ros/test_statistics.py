# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What the node counts adds up, whatever happens in which order; rates and ages are those of a clock of the test's."""

from __future__ import annotations

from collections import Counter
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from topo_region_seg.ros import statistics as module
from topo_region_seg.ros.statistics import RATE_SECONDS, WINDOW, Statistics


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """The time of the module, which stands still unless the test moves it."""
    now = SimpleNamespace(value=1000.0)
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: now.value))
    return now


def answered(statistics: Statistics, ms: float = 1.0, age: float = 2.0) -> None:
    statistics.processed({"filtration": ms}, ms, age, points=7, regions=3, stamp="5.000000000", cpu_ms={"crop": 2 * ms})


def test_before_the_first_cloud_everything_is_nothing(clock: SimpleNamespace) -> None:
    now = Statistics().snapshot()
    assert (now.received, now.processed, now.dropped, now.lost, now.incompatible) == (0, 0, 0, 0, 0)
    assert (now.points, now.regions, now.stamp, now.stamp_age_ms, now.idle) == (0, 0, "", None, 0.0)
    assert (now.rejected, now.notices, now.notice_texts, now.stages_ms, now.latencies_ms) == ({}, {}, {}, {}, {})
    assert (now.input_hz, now.output_hz) == (0.0, 0.0)


EVENTS = st.one_of(
    st.tuples(st.just("received"), st.booleans(), st.integers(0, 3)),
    st.tuples(st.just("lost"), st.integers(1, 4)),
    st.tuples(st.just("rejected"), st.sampled_from(["a", "b"])),
    st.tuples(st.just("noticed"), st.sampled_from(["c", "d"]), st.text(max_size=3)),
    st.tuples(st.just("incompatible"), st.integers(1, 2)),
    st.tuples(st.just("passed_over"), st.sampled_from(["e", "f"])),
    st.tuples(st.just("dropped")),
    st.tuples(st.just("processed")),
)


@given(st.lists(EVENTS, max_size=40))
def test_counts_add_up(events: list[tuple]) -> None:
    statistics = Statistics()
    for name, *arguments in events:
        if name == "processed":
            answered(statistics)
        else:
            getattr(statistics, name)(*arguments)
    of: dict[str, list[tuple]] = {name: [e for e in events if e[0] == name] for name in {e[0] for e in events}}
    skipped, lost = sum(e[2] for e in of.get("received", [])), sum(e[1] for e in of.get("lost", []))
    replaced = max(0, skipped - lost)  # what was skipped and not lost on the way gave way to a newer one
    now = statistics.snapshot()
    assert now.received == len(of.get("received", [])) + replaced
    assert now.dropped == sum(e[1] for e in of.get("received", [])) + len(of.get("dropped", [])) + replaced
    assert (now.lost, now.processed) == (lost, len(of.get("processed", [])))
    assert now.incompatible == sum(e[1] for e in of.get("incompatible", []))
    assert now.rejected == Counter(e[1] for e in of.get("rejected", []))
    assert now.passed_over == Counter(e[1] for e in of.get("passed_over", []))
    assert now.notices == Counter(e[1] for e in of.get("noticed", []))
    assert now.notice_texts == {e[1]: e[2] for e in of.get("noticed", [])}


def test_rates_are_those_of_the_last_seconds(clock: SimpleNamespace) -> None:
    statistics = Statistics()
    for tick in range(1, 101):
        clock.value = 1000.0 + 0.1 * tick
        statistics.received(displaced=False, skipped=0)
        if tick % 2 == 0:
            answered(statistics)
        if tick == 20:
            assert statistics.snapshot().input_hz == pytest.approx(10.0), "over what there is"
    now = statistics.snapshot()
    assert now.input_hz == pytest.approx(10.0, abs=1.01 / RATE_SECONDS)
    assert now.output_hz == pytest.approx(5.0, abs=1.01 / RATE_SECONDS)
    clock.value += 0.5 * RATE_SECONDS
    assert statistics.snapshot().input_hz == pytest.approx(5.0, abs=1.01 / RATE_SECONDS)
    clock.value += RATE_SECONDS
    now = statistics.snapshot()
    assert (now.input_hz, now.output_hz) == (0.0, 0.0)
    assert now.idle == pytest.approx(1.5 * RATE_SECONDS)


def test_a_new_stretch_forgets_times_and_keeps_counts(clock: SimpleNamespace) -> None:
    statistics = Statistics()
    statistics.received(displaced=True, skipped=0)
    answered(statistics)
    clock.value += 3.0
    statistics.restart()
    clock.value += 1.0
    now = statistics.snapshot()
    assert (now.received, now.processed, now.dropped, now.regions) == (1, 1, 1, 3)
    assert (now.idle, now.stretch, now.input_hz, now.output_hz, now.stamp_age_ms) == (1.0, 1.0, 0.0, 0.0, None)
    assert (now.stages_ms, now.stages_cpu_ms, now.latencies_ms) == ({}, {}, {})


def test_medians_are_those_of_the_last_frames() -> None:
    statistics = Statistics()
    for number in range(3 * WINDOW):
        answered(statistics, ms=float(number), age=-float(number))
    now = statistics.snapshot()
    last = range(2 * WINDOW, 3 * WINDOW)
    middle = (last[WINDOW // 2 - 1] + last[WINDOW // 2]) / 2
    assert (now.stages_ms, now.stages_cpu_ms) == ({"filtration": middle}, {"crop": 2 * middle})
    assert now.stamp_age_ms == -middle
    assert now.latencies_ms["max"] == last[-1] and now.latencies_ms["median"] == last[WINDOW // 2 - 1]
