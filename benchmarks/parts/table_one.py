# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Table I of the paper: clouds of the sizes, distances and features printed there, our time beside the paper's."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

from benchmarks import checks, peers
from benchmarks.points import Points
from benchmarks.recordings import cut, object_points, source
from benchmarks.results import Result, Setting, Table
from benchmarks.timing import timed
from topo_region_seg.params import Params

TITLE = "The paper's Table I"


class Row(NamedTuple):
    """A row as printed: points, distance (m), features and time (s)."""

    name: str
    points: int
    distance: float
    features: str
    seconds: float


PAPER = (
    Row("plant", 12_729, 0.03, "color+normals", 1.508),
    Row("water heater", 10_395, 0.035, "color+normals", 3.314),
    Row("paper roll", 7_178, 0.03, "color+normals", 1.884),
    Row("robot", 25_790, 0.02, "color+normals", 6.620),
    Row("box", 10_511, 0.03, "color", 5.432),
    Row("shoe", 9_268, 0.03, "color", 3.594),
    Row("shuttle", 12_524, 0.02, "color", 1.404),
    Row("coffee can", 8_376, 0.028, "color", 1.541),
)


def measure(setting: Setting) -> Result:
    """Time the core on as many points of our frames' objects as the paper's objects had."""
    result = Result()
    rows = []
    for number, row in enumerate(PAPER):
        points = _object(number, row.points)
        params = Params(max_radius=row.distance, features=row.features)
        time, ours = timed(partial(points.components, params), setting.choose(20, 5))
        edges = peers.all_edges(points, params)
        checks.same_partition("SciPy", edges.partition(row.distance), ours.root)
        faster = row.seconds * 1e3 / time.median
        rows.append(
            [
                f"{number + 1} ({row.name})",
                f"{row.points:,}",
                f"{row.distance:g}",
                row.features,
                f"{row.seconds * 1e3:,.0f}",
                f"{time.median:,.1f}",
                f"{faster:,.0f}",
            ]
        )
        result.data[row.name] = {**time.as_dict(), "paper_ms": row.seconds * 1e3}
    columns = ["object of the paper", "points", "distance (m)", "features", "paper (ms)", "here (ms)", "times faster"]
    result.tables.append(Table(f"Clouds of the same size, cut from {source()} frames", columns, rows))
    result.notes.append(
        "The paper's clouds are not public; ours have as many points and nothing else in common with them. The paper's "
        "machine and language are those of 2016: the last column shows how far things have come since, not which "
        "algorithm is better. The time is that of computing topological persistence, as in the paper."
    )
    return result


def _object(number: int, n: int) -> Points:
    large_enough = [points for points in object_points() if len(points) >= n]
    return cut(large_enough[number % len(large_enough)], n)
