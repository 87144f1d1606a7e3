# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The figures as tables: for the terminal frame by frame, for the document by group of frames and program."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, median
from typing import Any

from benchmarks.objects.frame import WHOLE
from benchmarks.objects.programs import OURS
from benchmarks.report import table

Frame = Mapping[str, Any]
Found = Mapping[str, Mapping[str, Mapping[str, Frame]]]
"""Figures by data set, frame and program."""

SHOWN = {
    "WOv": "wov",
    "Fos": "fos",
    "Fus": "fus",
    "Ovl P": "overlap_precision",
    "Ovl R": "overlap_recall",
    "Ovl F": "overlap_f",
    "F>.75": "f75",
    "P@.5": "precision_50",
    "R@.5": "recall_50",
    "bnd F": "boundary_f",
    "false": "false_objects",
    "rep.": "reported",
    "true": "true",
    "CPU ms": "cpu_ms",
}
LOW = 0.6
"""Weighted overlap below which a frame is listed."""


@dataclass(frozen=True)
class Group:
    """Frames whose figures are averaged.

    Parameters
    ----------
    title : str
        For the document.
    data_set : str
        Where they are from.
    takes : callable
        Whether the figures of a frame belong to the group.
    whole : bool
        By whole objects rather than parts.
    """

    title: str
    data_set: str
    takes: Callable[[Frame], bool]
    whole: bool = False

    def frames(self, found: Found, program: str) -> dict[str, Frame]:
        """Return the frames of a program, with the measures by their plain names."""
        chosen = {}
        for name, programs in found.get(self.data_set, {}).items():
            if program in programs and self.takes(programs[program]):
                frame = programs[program]
                by_whole = {key: frame[f"{WHOLE}{key}"] for key in SHOWN.values() if f"{WHOLE}{key}" in frame}
                chosen[name] = {**frame, **by_whole} if self.whole else frame
        return chosen


def hard(frame: Frame) -> bool:
    """Whether a scene is a room or holds transparent things."""
    return "room" in frame["kind"] or "transparent" in frame["kind"]


def complete(frame: Frame) -> bool:
    """Whether all objects of a frame have truth."""
    return frame["false_objects"] is not None


def groups(found: Found) -> list[Group]:
    """Return the groups of the data sets that were measured."""
    every: list[Group] = [
        Group("Recorded tabletops, truth by parts", "tabletop", any_frame),
        Group("Recorded tabletops, whole objects", "tabletop", any_frame, whole=True),
        Group("Other cameras and scenes, all frames (development frames)", "scenes", any_frame),
        Group("The same, without rooms and transparent things", "scenes", not_hard),
        Group("The same, frames where all objects have truth", "scenes", complete),
    ]
    kinds = {frame[OURS]["kind"]: None for frame in found.get("simulated", {}).values()}
    for place in (0, 1):
        for name in dict.fromkeys(kind.split(", ")[place] for kind in kinds):
            every.append(Group(f"Simulated, {name}", "simulated", OfKind(name)))
    return [group for group in every if group.data_set in found]


def any_frame(frame: Frame) -> bool:
    """Take every frame."""
    return True


def not_hard(frame: Frame) -> bool:
    """Take frames that are neither rooms nor of transparent things."""
    return not hard(frame)


@dataclass(frozen=True)
class OfKind:
    """Takes frames of a kind of scene or camera."""

    name: str

    def __call__(self, frame: Frame) -> bool:
        """Whether the frame is of the kind."""
        return self.name in frame["kind"].split(", ")


def terminal(title: str, frames: Mapping[str, Frame]) -> str:
    """Return a row for each frame and one of the means."""
    lines = [title, f"{'':34}" + "".join(f"{head:>8}" for head in SHOWN)]
    for name, one in frames.items():
        kind = "" if one["kind"] in name else f", {one['kind']}"
        lines.append(f"{name + kind:34.34}" + "".join(f"{_cell(one[key]):>8}" for key in SHOWN.values()))
    lines.append(f"{'mean':34}" + "".join(f"{_cell(mean(frames.values(), key)):>8}" for key in SHOWN.values()))
    return "\n".join(lines)


def means(found: Found, programs: Sequence[str]) -> str:
    """Return a row for each group and program."""
    lines = [f"{'':60}" + "".join(f"{head:>8}" for head in SHOWN)]
    for group in groups(found):
        for program in programs:
            frames = group.frames(found, program)
            if frames:
                name = group.title if program == OURS else f"  {program}"
                cells = [_cell(mean(frames.values(), key)) for key in SHOWN.values()]
                lines.append(f"{name:60.60}" + "".join(f"{cell:>8}" for cell in cells))
    return "\n".join(lines)


def markdown(found: Found, programs: Sequence[str]) -> str:
    """Return the tables of the document: a table for each group, the time, and the frames that are low."""
    usual = usual_ms(found)
    blocks = []
    for group in groups(found):
        rows = []
        for program in programs:
            frames = group.frames(found, program)
            if frames:
                name = f"**{program}**" if program == OURS else program
                figures = [_cell(mean(frames.values(), key)) for key in list(SHOWN.values())[:-1]]
                rows.append([name, *figures, _ratio(median(one["cpu_ms"] for one in frames.values()), usual)])
        if rows:
            count = len(group.frames(found, OURS))
            head = ["", *list(SHOWN)[:-1], "CPU"]
            blocks += [f"{group.title}: {count} frames.", table(head, rows)]
    slow = [
        (one["cpu_ms"], f"{name} ({data_set})")
        for data_set, frames in found.items()
        for name, programs_of in frames.items()
        for one in (programs_of[OURS],)
    ]
    if usual and slow:
        ms, name = max(slow)
        blocks.append(
            f"CPU is the median over the frames of the processor's time, all threads together, in that of the median "
            f"recorded tabletop ({usual:.0f} ms here). The slowest frame is {name}: {_ratio(ms, usual)} times."
        )
    return "\n\n".join([*blocks, *_low(found)])


def usual_ms(found: Found) -> float | None:
    """Return the median time of a tabletop frame, ms."""
    times = [programs[OURS]["cpu_ms"] for programs in found.get("tabletop", {}).values()]
    return median(times) if times else None


def _low(found: Found) -> list[str]:
    rows = [
        [name, data_set, one["kind"], *(_cell(one[key]) for key in list(SHOWN.values())[:-1])]
        for data_set, frames in found.items()
        for name, programs in frames.items()
        for one in (programs[OURS],)
        if one["wov"] is not None and one["wov"] < LOW
    ]
    if not rows:
        return [f"No frame is below a weighted overlap of {LOW}."]
    head = ["frame", "data set", "what", *list(SHOWN)[:-1]]
    return [f"Frames below a weighted overlap of {LOW}:", table(head, rows)]


def mean(frames: Iterable[Frame], key: str) -> float | None:
    """Return the mean over the frames that define a measure."""
    known = [frame[key] for frame in frames if frame.get(key) is not None]
    return fmean(known) if known else None


def _ratio(ms: float, usual: float | None) -> str:
    return "n/a" if usual is None else f"{ms / usual:.1f}"


def _cell(value: float | None) -> str:
    if value is None:
        return "n/a"
    return str(value) if isinstance(value, int) else f"{value:.3f}" if value < 10 else f"{value:.1f}"
