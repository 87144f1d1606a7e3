# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The results of a sweep, the best combination first, as a table, CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence

from rich import box
from rich.table import Table

from topo_region_seg.offline.cli.evaluation_tables import HEADS, measure_cells
from topo_region_seg.offline.cli.parameter_grid import Combination
from topo_region_seg.offline.evaluation.measures import MEASURES, SEGMENTATION
from topo_region_seg.offline.evaluation.results import BagResult, mean_measures, median_ms
from topo_region_seg.offline.evaluation.version import program_version

MOST_ROWS = 40
SHOWN = (*SEGMENTATION, "overlap_f")
"""Measures in the table; the files have all."""


class Outcome:
    """A combination with its results on all recordings, their mean quality and median time."""

    def __init__(self, combination: Combination, results: Sequence[BagResult]) -> None:
        frames = [frame for result in results for frame in result.frames]
        self.combination = combination
        self.results = list(results)
        self.frames = len(frames)
        self.mean = mean_measures(frames)
        self.ms = median_ms(frames)

    @property
    def order(self) -> tuple[float, float, float]:
        """Sort key: higher weighted overlap first, then the faster.

        Outcomes with fewer measured frames come last, as their means leave out what failed.
        """
        overlap = self.mean["wov"]
        return -self.frames, 1.0 if overlap is None else -overlap, self.ms or 0.0


def sweep_table(outcomes: Sequence[Outcome]) -> Table:
    """Return one row per outcome, the best first and marked; if there are many, only the first ones."""
    title = f"the best {MOST_ROWS} of {len(outcomes)} combinations" if len(outcomes) > MOST_ROWS else None
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    table.add_column("", justify="right")
    names = list(outcomes[0].combination.varied)
    for name in names:
        table.add_column(name.replace("_", "_\n"), justify="right")
    for name in SHOWN:
        table.add_column(HEADS[name], justify="right")
    table.add_column("ms", justify="right")
    table.add_column("frames", justify="right")
    for place, outcome in enumerate(outcomes[:MOST_ROWS], start=1):
        values = [str(outcome.combination.varied[name]) for name in names]
        ms = "-" if outcome.ms is None else f"{outcome.ms:.0f}"
        best = place == 1
        cells = [
            f"{'★ ' if best else ''}{place}",
            *values,
            *measure_cells(outcome.mean, SHOWN),
            ms,
            str(outcome.frames),
        ]
        table.add_row(*cells, style="bold" if best else "")
    return table


def csv_text(outcomes: Sequence[Outcome]) -> str:
    """Return a header and one row per outcome."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*outcomes[0].combination.varied, *MEASURES, "ms", "frames"])
    for outcome in outcomes:
        means = [outcome.mean[name] for name in MEASURES]
        writer.writerow([*outcome.combination.varied.values(), *means, outcome.ms, outcome.frames])
    return text.getvalue()


def json_text(outcomes: Sequence[Outcome], *, cached: int, computed: int) -> str:
    """Return all outcomes, the best first, and how many runs came from the cache."""
    summary = {
        "best": outcomes[0].combination.varied,
        "combinations": [
            {
                "varied": outcome.combination.varied,
                "mean": outcome.mean,
                "ms": outcome.ms,
                "frames": outcome.frames,
                "bags": [
                    {
                        "bag": result.bag,
                        "mean": mean_measures(result.frames),
                        "ms": median_ms(result.frames),
                        "frames": len(result.frames),
                        "without_truth": result.without_truth,
                        "rejected": len(result.rejected),
                        "truncated": result.truncated,
                        "error": result.error or None,
                    }
                    for result in outcome.results
                ],
                "params": outcome.combination.params.as_dict(),
            }
            for outcome in outcomes
        ],
        "cached": cached,
        "computed": computed,
        "version": program_version(),
    }
    return json.dumps(summary, indent=1, allow_nan=False) + "\n"
