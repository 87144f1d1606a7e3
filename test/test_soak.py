# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The soak test's verdict: figures that break a promise are found. The soak itself is run by hand: `make soak`."""

from __future__ import annotations

import copy
import sys
from typing import Any

import pytest
from places import ROOT

# Last, so that an installed copy of the package stays the one that is tested.
sys.path.append(str(ROOT))

from benchmarks.soak_report import markdown, verdict, with_part

GOOD: dict[str, Any] = {
    "machine": {"cpu": "a", "cores": 2, "python": "3", "commit": "c"},
    "minutes": 1,
    "input": "points",
    "due": 90,
    "due_and_answered": 86,
    "hz": {"wanted": 30, "reached": 30},
    "done": {"good": 98, "malformed": 2},
    "node": {
        "clouds received": "97",
        "clouds processed": "50",
        "clouds dropped": "45",
        "clouds rejected": "2",
        "clouds lost in transport": "3",
        "rejected: bad_stamp": "2",
    },
    "latency_ms": {"median": 1.0},
    "service_ms": {"95 %": 20.0, "max": 30.0},
    "labels_received": 50,
    "process": {
        "memory_mb": {"start": 100.0, "end": 102.0, "growth_percent": 2.0, "peak": 103.0},
        "threads": {"start": 10, "end": 10},
        "descriptors": {"start": 10, "end": 10},
    },
    "exit_status": 0,
    "tracebacks": 0,
    "log_lines": 5,
}


def broken(result: dict[str, Any]) -> list[str]:
    return [name for name, kept, _ in verdict(result) if not kept]


def test_each_input_has_its_part_of_the_page() -> None:
    clouds = {**GOOD, "verdict": verdict(GOOD)}
    images = {**clouds, "input": "depth", "minutes": 2}
    page = with_part(with_part("", images), clouds)
    assert page == with_part(with_part("", clouds), images)
    assert page.startswith("# Soak test\n") and page.count("\n## With depth images\n") == 1
    again = with_part(page, {**clouds, "minutes": 3})
    assert "--minutes 3`" in again and "--minutes 2 --input depth`" in again and "--minutes 1`" not in again


def test_good_figures_keep_every_promise() -> None:
    assert broken(GOOD) == []


@pytest.mark.parametrize(
    ("keys", "value", "promise"),
    [
        (("exit_status",), -9, "no crash"),
        (("tracebacks",), 1, "no crash"),
        (("node", "clouds processed"), "49", "every cloud received"),
        (("done", "good"), 99, "every cloud sent"),
        (("due_and_answered",), 85, "at least 95 %"),
        (("node", "rejected: internal_error"), "1", "no internal error"),
        (("process", "memory_mb", "growth_percent"), 3.5, "memory"),
        (("process", "threads", "end"), 11, "no thread"),
        (("process", "descriptors", "end"), 11, "no descriptor"),
        (("service_ms", "95 %"), 120.0, "parameter services"),
    ],
)
def test_a_broken_promise_is_found(keys: tuple[str, ...], value: Any, promise: str) -> None:
    result = copy.deepcopy(GOOD)
    place = result
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    (name,) = broken(result)
    assert name.startswith(promise)
    result["verdict"] = verdict(result)
    assert "| **no** |" in markdown(result)
