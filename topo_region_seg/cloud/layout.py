# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What a sensor_msgs/PointCloud2 claims about itself, checked in Python integers before anything is allocated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

FLOAT32, FLOAT64 = 7, 8
UINT8 = 2
BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 8: 8}
"""Size of each PointField datatype, bytes."""
PACKED_COLOR = (5, 6, 7)
"""Datatypes that carry the four bytes of a packed color: INT32, UINT32, FLOAT32."""
MAX_FIELDS = 256
MAX_ELEMENTS = 65_536
COORDINATES = ("x", "y", "z")
CHANNELS = ("r", "g", "b")
Warn = Callable[[str, str], None]


class CloudFormatError(ValueError):
    """A cloud cannot be read.

    Attributes
    ----------
    reason : str
        Stable snake_case code, for counters and logs.
    detail : str
        One line of text with the offending values.
    """

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(f"{detail} ({reason})")
        self.reason = reason
        self.detail = detail


@dataclass(frozen=True)
class Layout:
    """Where the needed values lie in the buffer of a message that passed all checks.

    Parameters
    ----------
    height, width : int
        Organization.
    point_step, row_step : int
        Strides, bytes; `row_step` is the one to use, whatever the message says.
    coordinates : tuple of (offset, datatype)
        x, y, z.
    color : tuple of int, or None
        Offsets of the bytes red, green, blue.
    big_endian : bool
        Byte order of the coordinates.
    """

    height: int
    width: int
    point_step: int
    row_step: int
    coordinates: tuple[tuple[int, int], ...]
    color: tuple[int, int, int] | None
    big_endian: bool


def check(msg: Any, size: int, *, max_points: int, warn: Warn) -> Layout:
    """Check what `msg` with `size` bytes of data claims; raise :class:`CloudFormatError` at the first false claim."""
    height, width = int(msg.height), int(msg.width)
    point_step, row_step = int(msg.point_step), int(msg.row_step)
    points = height * width
    _check_field_count(msg.fields)
    big_endian = bool(msg.is_bigendian)
    if points == 0:
        _check_stamp(msg)
        return Layout(height, width, 0, 0, (), None, big_endian)

    wanted = (*COORDINATES, *_color_names(msg.fields))
    needed: dict[str, Any] = {}
    for f in msg.fields:
        if f.name not in wanted:
            continue
        if int(f.datatype) not in BYTES:
            raise CloudFormatError("field_type", f"field '{f.name}' has datatype {f.datatype}, not 1 to 8")
        if int(f.count) < 1:
            raise CloudFormatError("field_count", f"field '{f.name}' has count {f.count}")
        if f.name in needed:
            raise CloudFormatError("field_duplicate", f"field '{f.name}' is there twice")
        needed[f.name] = f
    missing = [name for name in COORDINATES if name not in needed]
    if missing:
        have = ", ".join(repr(str(f.name)) for f in msg.fields[:16]) or "none"
        raise CloudFormatError("field_missing", f"no field {', '.join(missing)}; fields: {have}")
    _check_types(needed)
    _check_places(needed, point_step)

    if points > max_points:
        raise CloudFormatError("too_many_points", f"{width} x {height} points are more than max_points: {max_points}")
    row_step = _row_step(height, width, point_step, row_step, size, warn)
    _check_stamp(msg)
    return Layout(
        height,
        width,
        point_step,
        row_step,
        tuple((int(needed[name].offset), int(needed[name].datatype)) for name in COORDINATES),
        _color_offsets(needed, big_endian),
        big_endian,
    )


def check_field(msg: Any, size: int, name: str, *, max_points: int, warn: Warn) -> tuple[Any, int]:
    """Check what `msg` claims of one field, whatever its others are; return the field and the row stride in bytes.

    Raises
    ------
    CloudFormatError
        At the first false claim, or if the field is not there.
    """
    height, width = int(msg.height), int(msg.width)
    _check_field_count(msg.fields)
    found = [f for f in msg.fields if f.name == name]
    if not found:
        raise CloudFormatError("field_missing", f"no field {name}")
    if len(found) > 1:
        raise CloudFormatError("field_duplicate", f"field '{name}' is there twice")
    if int(found[0].datatype) not in BYTES:
        raise CloudFormatError("field_type", f"field '{name}' has datatype {found[0].datatype}, not 1 to 8")
    if int(found[0].count) < 1:
        raise CloudFormatError("field_count", f"field '{name}' has count {found[0].count}")
    _check_places({name: found[0]}, int(msg.point_step))
    if height * width > max_points:
        raise CloudFormatError("too_many_points", f"{width} x {height} points are more than max_points: {max_points}")
    row_step = _row_step(height, width, int(msg.point_step), int(msg.row_step), size, warn) if height * width else 0
    _check_stamp(msg)
    return found[0], row_step


def _check_field_count(fields: Any) -> None:
    if len(fields) > MAX_FIELDS:
        raise CloudFormatError("too_many_fields", f"{len(fields)} fields are more than {MAX_FIELDS}")
    elements = sum(int(f.count) for f in fields)
    if elements > MAX_ELEMENTS:
        raise CloudFormatError("too_many_fields", f"fields of {elements} elements a point are more than {MAX_ELEMENTS}")


def _color_names(fields: Any) -> tuple[str, ...]:
    """Names of the fields to take the color from; rgb before rgba before r, g, b; none for a cloud without color."""
    names = {f.name for f in fields}
    for packed in ("rgb", "rgba"):
        if packed in names:
            return (packed,)
    return CHANNELS if names.issuperset(CHANNELS) else ()


def _check_types(needed: dict[str, Any]) -> None:
    for name, f in needed.items():
        if name in COORDINATES:
            if int(f.datatype) not in (FLOAT32, FLOAT64):
                raise CloudFormatError(
                    "coordinate_type", f"field '{name}' has datatype {f.datatype}; only FLOAT32 and FLOAT64 are metres"
                )
        elif int(f.datatype) not in ((UINT8,) if name in CHANNELS else PACKED_COLOR):
            wanted = "UINT8" if name in CHANNELS else "FLOAT32 or UINT32"
            raise CloudFormatError("color_type", f"field '{name}' has datatype {f.datatype}, not {wanted}")


def _check_places(needed: dict[str, Any], point_step: int) -> None:
    spans = []
    for name, f in needed.items():
        start = int(f.offset)
        end = start + BYTES[int(f.datatype)] * int(f.count)
        if start < 0 or end > point_step:
            raise CloudFormatError(
                "field_outside_point", f"field '{name}' ends at byte {end}, but point_step is {point_step} bytes"
            )
        spans.append((start, end, name))
    spans.sort()
    for (_, end, name), (start, _, other) in pairwise(spans):
        if start < end:
            raise CloudFormatError("field_overlap", f"fields '{name}' and '{other}' overlap")


def _row_step(height: int, width: int, point_step: int, row_step: int, size: int, warn: Warn) -> int:
    """Return the row stride to use: the message's own, or the packed one where only that fits the data exactly."""
    packed = width * point_step
    needed = (height - 1) * row_step + packed
    if row_step != packed and size == height * packed and (row_step < packed or size < needed):
        warn("stale_row_step", f"row_step is {row_step}, but rows are packed in {packed} bytes; read as packed")
        return packed
    if row_step < packed:
        raise CloudFormatError(
            "row_step_too_small", f"row_step {row_step} is less than {width} points of {point_step} bytes"
        )
    if size < needed:
        raise CloudFormatError("data_too_short", f"{size} bytes of data, {needed} needed for {width} x {height} points")
    if size > max(needed, height * row_step):
        warn("data_too_long", f"{size} bytes of data, {needed} needed; the rest is ignored")
    return row_step


def _check_stamp(msg: Any) -> None:
    nanosec = int(msg.header.stamp.nanosec)
    if not 0 <= nanosec < 1_000_000_000:
        raise CloudFormatError("bad_stamp", f"header.stamp.nanosec = {nanosec} is not less than 1e9")


def _color_offsets(needed: dict[str, Any], big_endian: bool) -> tuple[int, int, int] | None:
    """Offsets of red, green, blue; a packed color 0xAARRGGBB lies as B, G, R, A in a little-endian buffer."""
    for packed in ("rgb", "rgba"):
        if packed in needed:
            start = int(needed[packed].offset)
            return (start + 1, start + 2, start + 3) if big_endian else (start + 2, start + 1, start)
    if "r" not in needed:
        return None
    return int(needed["r"].offset), int(needed["g"].offset), int(needed["b"].offset)
