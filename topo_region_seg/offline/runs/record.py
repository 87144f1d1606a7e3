# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The record of a run that ``replay`` attaches to its output, so that the output alone explains its results."""

from __future__ import annotations

import importlib.metadata
import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import datetime, timezone
from typing import Any

import topo_region_seg
from topo_region_seg.offline.frames import FrameResult, Rejection
from topo_region_seg.offline.sensor_figures import DepthFigures, SensorFigures

RECORD_NAME = "topo_region_seg/run"
"""Name of the MCAP attachment."""
MEDIA_TYPE = "application/json"
FORMAT = 1
"""Increased when older programs can no longer read the record."""
_PACKAGES = ("numpy", "scipy", "numba")


@dataclass(frozen=True)
class RunRecord:
    """How a run was made.

    Parameters
    ----------
    source, topic : str
        Path of the recording that was read, absolute, and the topic of its clouds.
    frames, rejected : list
        One entry per cloud, in the order in which they were written.
    truncated, interrupted : bool
        Whether the source was cut short, and whether Ctrl-C ended the run.
    problems : list of str
        One line for each damaged part of the source.
    params : dict
        Names and values of all parameters.
    versions : dict of str to str
        Versions of this package, Python and the numerical libraries.
    created : str
        Time of the run, UTC, as in ``2026-01-31T12:00:00+00:00``.
    sensor : SensorFigures or None
        What the first segmented cloud tells of its camera; None in records of versions that did not ask, too.
    """

    source: str
    topic: str
    frames: list[FrameResult]
    rejected: list[Rejection]
    truncated: bool
    interrupted: bool
    problems: list[str]
    params: dict[str, Any]
    versions: dict[str, str] = field(default_factory=lambda: versions())
    created: str = field(default_factory=lambda: datetime.now(timezone.utc).isoformat(timespec="seconds"))
    sensor: SensorFigures | None = None

    def to_json(self) -> str:
        """Return the text of the attachment."""
        return json.dumps({"format": FORMAT, **asdict(self)}, indent=1) + "\n"

    @classmethod
    def from_json(cls, text: str | bytes) -> RunRecord:
        """Read the text of an attachment.

        Raises
        ------
        ValueError
            It is not a record, or that of a newer program; the message names the part.
        """
        content = json.loads(text)
        given = _typed(content, dict, "the record")
        number = _typed(given.get("format"), int, "format")
        if number > FORMAT:
            raise ValueError(f"it has format {number}, this program reads formats up to {FORMAT}")
        return cls(
            source=_typed(given.get("source"), str, "source"),
            topic=_typed(given.get("topic"), str, "topic"),
            frames=[_frame(entry) for entry in _typed(given.get("frames"), list, "frames")],
            rejected=[_rejected(entry) for entry in _typed(given.get("rejected"), list, "rejected")],
            truncated=_typed(given.get("truncated"), bool, "truncated"),
            interrupted=_typed(given.get("interrupted"), bool, "interrupted"),
            problems=[_typed(line, str, "problems") for line in _typed(given.get("problems"), list, "problems")],
            params=_typed(given.get("params"), dict, "params"),
            versions={
                str(name): _typed(version, str, "versions")
                for name, version in _typed(given.get("versions"), dict, "versions").items()
            },
            created=_typed(given.get("created"), str, "created"),
            sensor=None if given.get("sensor") is None else _sensor(given["sensor"]),
        )


def versions() -> dict[str, str]:
    """Return the versions of this package, Python and the numerical libraries."""
    found = {"topo_region_seg": topo_region_seg.__version__, "python": platform.python_version()}
    return found | {name: importlib.metadata.version(name) for name in _PACKAGES}


def _frame(entry: Any) -> FrameResult:
    given = _typed(entry, dict, "frames")
    return FrameResult(
        stamp=_number(given, "stamp"),
        points=_typed(given.get("points"), int, "points"),
        regions=_typed(given.get("regions"), int, "regions"),
        ms=_times(given.get("ms"), "ms"),
        cpu_ms=_times(given.get("cpu_ms", {}), "cpu_ms"),
        classes={
            str(name): _typed(count, int, "classes")
            for name, count in _typed(given.get("classes", {}), dict, "classes").items()
        },
    )


def _sensor(entry: Any) -> SensorFigures:
    given, noise = _typed(entry, dict, "sensor"), []
    for at in _typed(given.get("noise"), list, "noise"):
        figures = _typed(at, dict, "noise")
        step = None if figures.get("step") is None else _number(figures, "step")
        noise.append(DepthFigures(_number(figures, "depth"), _number(figures, "noise"), step))
    return SensorFigures(_number(given, "pixel_rad"), _number(given, "valid"), noise)


def _times(entry: Any, name: str) -> dict[str, float]:
    given = _typed(entry, dict, name)
    return {str(stage): _number(given, stage) for stage in given}


def _rejected(entry: Any) -> Rejection:
    given = _typed(entry, dict, "rejected")
    texts = (_typed(given.get(name), str, name) for name in ("reason", "detail"))
    return Rejection(_number(given, "stamp"), *texts)


def _number(given: Mapping[str, Any], name: str) -> float:
    value = given.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e300:
        raise ValueError(f"{name} is {value!r}, not a number")
    return float(value)


def _typed(value: Any, kind: type, name: str) -> Any:
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise ValueError(f"{name} is {str(value)[:40]!r}, not a {kind.__name__}")
    return value
