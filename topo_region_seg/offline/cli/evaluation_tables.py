# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables of quality for the terminal: per frame, per recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from rich import box
from rich.table import Table

from topo_region_seg.offline.evaluation.identity import IDENTITY, Identity, summed
from topo_region_seg.offline.evaluation.measures import Measures
from topo_region_seg.offline.evaluation.results import BagResult, mean_measures, median_ms

HEADS = {
    "wov": "WOv",
    "fos": "Fos",
    "fus": "Fus",
    "ari": "ARI",
    "boundary_recall": "bound.\nrecall",
    "boundary_precision": "bound.\nprecis.",
    "asa": "ASA",
    "labelled": "label-\nled",
    "overlap_precision": "overl.\nP",
    "overlap_recall": "overl.\nR",
    "overlap_f": "overl.\nF",
    "f75": "F >\n0.75",
    "precision_50": "P at\n0.5",
    "recall_50": "R at\n0.5",
    "precision_75": "P at\n0.75",
    "recall_75": "R at\n0.75",
    "false_objects": "false",
    "boundary_f": "bound.\nF",
    "achievable": "achiev-\nable",
    "spill": "spill",
    "pieces": "pieces",
    "idf1": "IDF1",
    "id_precision": "ID\nP",
    "id_recall": "ID\nR",
    "switches": "label\nswitches",
    "hits": "of\nhits",
    "flicker": "flicker\n(%)",
}
"""Names of the measures in tables; docs/evaluation.md defines them."""

MOST_FRAMES = 40
WORST_FRAMES = 10


def frame_table(results: Sequence[BagResult], measures: Sequence[str]) -> Table:
    """Return one row per frame with some measures; if there are many, only those with the lowest weighted overlap."""
    rows = [(result.bag, frame) for result in results for frame in result.frames]
    title = None
    if len(rows) > MOST_FRAMES:
        title = f"the {WORST_FRAMES} of {len(rows)} frames with the lowest WOv (--csv writes all)"
        rows.sort(key=lambda row: -1.0 if row[1].measures["wov"] is None else row[1].measures["wov"])
        rows = rows[:WORST_FRAMES]
    names = short_names([result.bag for result in results])
    several = len(results) > 1
    table = _table(title)
    if several:
        table.add_column("recording", overflow="fold")
    table.add_column("stamp (s)", justify="right")
    table.add_column("regions", justify="right")
    _add_measures(table, measures)
    for bag, frame in rows:
        cells = [
            f"{frame.stamp:.3f}",
            str(frame.regions),
            *measure_cells(frame.measures, measures),
            _ms(frame.ms["total"]),
        ]
        table.add_row(*([names[bag]] if several else []), *cells)
    return table


def bag_table(results: Sequence[BagResult], measures: Sequence[str]) -> Table:
    """Return one row per recording, and the means over all frames, with the numbers of clouds left out."""
    table = _table(None)
    table.add_column("recording", overflow="fold")
    table.add_column("frames", justify="right")
    table.add_column("no\ntruth", justify="right")
    table.add_column("re-\njected", justify="right")
    _add_measures(table, measures)
    names = short_names([result.bag for result in results])
    for result in results:
        if result.error and not result.frames:
            table.add_row(names[result.bag], "failed", str(result.without_truth), *[""] * (len(measures) + 2))
        else:
            table.add_row(names[result.bag], *_summary([result], measures))
    table.add_section()
    table.add_row("mean over frames", *_summary(results, measures), style="bold")
    return table


def identity_table(results: Sequence[BagResult]) -> Table:
    """Return one row per recording, and one of all, with how well regions kept their labels."""
    table = _table(None)
    table.add_column("recording", overflow="fold")
    table.add_column("frames", justify="right")
    for name in IDENTITY:
        table.add_column(HEADS[name], justify="right")
    names = short_names([result.bag for result in results])
    for result in results:
        if result.identity is not None:
            table.add_row(names[result.bag], str(len(result.frames)), *_identity_cells(result.identity))
    known = [result for result in results if result.identity is not None]
    total = summed(result.identity for result in known)
    if total is not None and len(known) > 1:
        table.add_section()
        frames = sum(len(result.frames) for result in known)
        table.add_row("all recordings", str(frames), *_identity_cells(total), style="bold")
    return table


def measure_cells(found: Measures, measures: Sequence[str]) -> list[str]:
    """Return the cells of some measures; "n/a" where one is undefined."""
    return ["n/a" if (value := found[name]) is None else f"{value:.3f}" for name in measures]


def short_names(bags: Sequence[str]) -> dict[str, str]:
    """Return the last part of the path of each recording, or the whole path where two end alike."""
    last = {bag: Path(bag).name for bag in bags}
    counts = Counter(last.values())
    return {bag: name if counts[name] == 1 else bag for bag, name in last.items()}


def _summary(results: Sequence[BagResult], measures: Sequence[str]) -> list[str]:
    frames = [frame for result in results for frame in result.frames]
    counts = (len(frames), sum(r.without_truth for r in results), sum(len(r.rejected) for r in results))
    return [*map(str, counts), *measure_cells(mean_measures(frames), measures), _ms(median_ms(frames))]


def _identity_cells(found: Identity) -> list[str]:
    values = found.measures()
    flicker = values["flicker"]
    share = "n/a" if flicker is None else f"{100.0 * flicker:.2f}"
    return [*measure_cells(values, IDENTITY[:3]), str(found.switches), str(found.hits), share]


def _table(title: str | None) -> Table:
    return Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True)


def _add_measures(table: Table, measures: Sequence[str]) -> None:
    for name in measures:
        table.add_column(HEADS[name], justify="right")
    table.add_column("ms", justify="right")


def _ms(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}"
