# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What is printed at the end: the figures of each room, and what survived."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

ENOUGH = 0.9
"""Share of killed mutants below which the tests are not good enough."""


def share_killed(results: Iterable[dict[str, Any]]) -> float:
    """Return the share of mutants that a test or the time limit has killed; 1 where none was tried."""
    found = [result["result"] != "survived" for result in results]
    return sum(found) / len(found) if found else 1.0


def summary(rooms: list[str], results: dict[str, dict[str, Any]], equivalent: dict[str, str]) -> str:
    """Return the table of all rooms, and the survivors with the lines that differ."""
    of_room = {room: [found for found in results.values() if found["room"] == room] for room in rooms}
    lines = [f"{'room':12} {'tried':>6} {'killed':>7} {'time limit':>11} {'survived':>9} {'share':>7}"]
    lines += [_row(room, found) for room, found in of_room.items() if found]
    lines.append(_row("all", list(results.values())))
    for name, found in results.items():
        if found["result"] == "survived":
            lines += ["", f"{name} {found['file']}:{found['line']} ({found['operator']})"]
            lines += [f"  - {line}" for line in found["before"].splitlines()]
            lines += [f"  + {line}" for line in found["after"].splitlines()]
    if equivalent:
        lines += ["", f"{len(equivalent)} are not counted, as they change nothing that can be seen (equivalent.yaml)"]
    return "\n".join(lines)


def _row(name: str, found: list[dict[str, Any]]) -> str:
    of = Counter(result["result"] for result in found)
    share = f"{100 * share_killed(found):.0f} %"
    return f"{name:12} {len(found):6} {of['killed']:7} {of['timeout']:11} {of['survived']:9} {share:>7}"
