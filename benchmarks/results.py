# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What a part of the benchmark hands back: goals with their figures, tables, and numbers for plots; all JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Setting:
    """How to measure.

    Parameters
    ----------
    quick : bool
        Fewer clouds and repetitions, for a look; the figures of record are those of a whole run.
    folder : Path
        For files that are needed in between.
    """

    quick: bool
    folder: Path

    def choose(self, whole: Any, quick: Any) -> Any:
        """Return the one or the other."""
        return quick if self.quick else whole


@dataclass(frozen=True)
class Line:
    """One goal on one cloud.

    Parameters
    ----------
    goal : str
        What is to be reached, with its limit.
    on : str
        The cloud or the circumstances.
    figure : str
        What was measured, for reading.
    reached : bool or None
        None where it could not be measured; `figure` says why.
    """

    goal: str
    on: str
    figure: str
    reached: bool | None


@dataclass(frozen=True)
class Table:
    """Rows to be printed below a heading."""

    title: str
    columns: list[str]
    rows: list[list[str]]


@dataclass
class Result:
    """The outcome of a part; `data` holds numbers by name, for the plots and for other programs."""

    lines: list[Line] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    data: dict[str, Any] = field(default_factory=dict)

    def at_most(self, goal: str, on: str, value: float, limit: float, unit: str, digits: int = 1) -> None:
        """Add a goal that is reached up to a limit."""
        self.lines.append(Line(goal, on, f"{value:,.{digits}f} {unit}".rstrip(), bool(value <= limit)))

    def at_least(self, goal: str, on: str, value: float, limit: float, unit: str, digits: int = 1) -> None:
        """Add a goal that is reached from a limit on."""
        self.lines.append(Line(goal, on, f"{value:,.{digits}f} {unit}".rstrip(), bool(value >= limit)))

    def missing(self, goal: str, on: str, why: str) -> None:
        """Add a goal that could not be measured."""
        self.lines.append(Line(goal, on, why, None))

    def as_dict(self) -> dict[str, Any]:
        """Return plain lists and dictionaries."""
        return asdict(self)
