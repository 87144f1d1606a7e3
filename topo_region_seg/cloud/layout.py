# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What a sensor_msgs/PointCloud2 claims about itself, checked in Python integers before anything is allocated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

UINT8, UINT16, FLOAT32, FLOAT64 = 2, 4, 7, 8
BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 8: 8}
"""Size of each PointField datatype, bytes."""
PACKED_COLOR = (5, 6, 7)
"""Datatypes that carry the four bytes of a packed color: INT32, UINT32, FLOAT32."""
MAX_FIELDS = 256
MAX_ELEMENTS = 65_536
COORDINATES = ("x", "y", "z")
CHANNELS = (("r", "g", "b"), ("red", "green", "blue"))
"""Names of fields that hold one channel each."""
CHANNEL_TYPES = (UINT8, UINT16, FLOAT32, FLOAT64)
Warn = Callable[[str, str], None]


def ignore(code: str, text: str) -> None:
    """Do nothing with a warning."""


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
        Offsets of red, green and blue.
    channel : int
        Datatype of each of them; UINT8 for those of a packed color, too.
    big_endian : bool
        Byte order of coordinates and channels.
    """

    height: int
    width: int
    point_step: int
    row_step: int
    coordinates: tuple[tuple[int, int], ...]
    color: tuple[int, int, int] | None
    channel: int
    big_endian: bool


def check(msg: Any, size: int, *, max_points: int, warn: Warn, needs_color: bool = True) -> Layout:
    """Check what `msg` with `size` bytes of data claims; raise :class:`CloudFormatError` at the first false claim.

    Colors that cannot be read are a reason for that only where they are needed, else for a warning.
    """
    height, width = int(msg.height), int(msg.width)
    point_step, row_step = int(msg.point_step), int(msg.row_step)
    points = height * width
    _check_field_count(msg.fields)
    big_endian = bool(msg.is_bigendian)
    if points == 0:
        check_stamp(msg)
        return Layout(height, width, 0, 0, (), None, UINT8, big_endian)

    coordinates = _fields(msg.fields, COORDINATES)
    missing = [name for name in COORDINATES if name not in coordinates]
    if missing:
        have = ", ".join(repr(str(f.name)) for f in msg.fields[:16]) or "none"
        raise CloudFormatError("field_missing", f"no field {', '.join(missing)}; fields: {have}")
    _check_coordinate_types(coordinates)
    _check_places(coordinates, point_step)
    try:
        color = _color(msg.fields, coordinates, point_step, big_endian)
    except CloudFormatError as error:
        if needs_color:
            raise
        warn("color_unreadable", f"{error.detail}; read without color")
        color = None
    offsets, channel = color or (None, UINT8)

    check_points(height, width, max_points)
    row_step = _row_step(height, width, point_step, row_step, size, warn)
    check_stamp(msg)
    return Layout(
        height,
        width,
        point_step,
        row_step,
        tuple((int(coordinates[name].offset), int(coordinates[name].datatype)) for name in COORDINATES),
        offsets,
        channel,
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
    found = _fields(msg.fields, (name,))
    if not found:
        raise CloudFormatError("field_missing", f"no field {name}")
    _check_places(found, int(msg.point_step))
    check_points(height, width, max_points)
    row_step = _row_step(height, width, int(msg.point_step), int(msg.row_step), size, warn) if height * width else 0
    check_stamp(msg)
    return found[name], row_step


def check_points(height: int, width: int, limit: int) -> None:
    """Refuse more points than a limit."""
    if height * width > limit:
        raise CloudFormatError(
            "too_many_points",
            f"{width} x {height} points, but max_points and over_max_points allow {limit}; raise max_points",
        )


def _check_field_count(fields: Any) -> None:
    if len(fields) > MAX_FIELDS:
        raise CloudFormatError("too_many_fields", f"{len(fields)} fields are more than {MAX_FIELDS}")
    elements = sum(int(f.count) for f in fields)
    if elements > MAX_ELEMENTS:
        raise CloudFormatError("too_many_fields", f"fields of {elements} elements a point are more than {MAX_ELEMENTS}")


def _fields(fields: Any, names: tuple[str, ...]) -> dict[str, Any]:
    """Return those of the named fields that are there, each of which must be there once and have a size."""
    found: dict[str, Any] = {}
    for f in fields:
        if f.name not in names:
            continue
        if int(f.datatype) not in BYTES:
            raise CloudFormatError("field_type", f"field '{f.name}' has datatype {f.datatype}, not 1 to 8")
        if int(f.count) < 1:
            raise CloudFormatError("field_count", f"field '{f.name}' has count {f.count}")
        if f.name in found:
            raise CloudFormatError("field_duplicate", f"field '{f.name}' is there twice")
        found[f.name] = f
    return found


def _check_coordinate_types(coordinates: dict[str, Any]) -> None:
    for name, f in coordinates.items():
        if int(f.datatype) not in (FLOAT32, FLOAT64):
            raise CloudFormatError(
                "coordinate_type", f"field '{name}' has datatype {f.datatype}; only FLOAT32 and FLOAT64 are metres"
            )


def _color(
    fields: Any, coordinates: dict[str, Any], point_step: int, big_endian: bool
) -> tuple[tuple[int, int, int], int] | None:
    """Return offsets and datatype of red, green, blue; from rgb before rgba before one field each; None if none."""
    present = {f.name for f in fields}
    for packed in ("rgb", "rgba"):
        if packed in present:
            field = _fields(fields, (packed,))[packed]
            if int(field.datatype) not in PACKED_COLOR:
                raise CloudFormatError(
                    "color_type", f"field '{packed}' has datatype {field.datatype}, not FLOAT32 or UINT32"
                )
            _check_places({**coordinates, packed: field}, point_step)
            # 0xAARRGGBB lies as B, G, R, A in a little-endian buffer.
            start = int(field.offset)
            return ((start + 1, start + 2, start + 3) if big_endian else (start + 2, start + 1, start)), UINT8
    for names in CHANNELS:
        if not present.issuperset(names):
            continue
        channels = _fields(fields, names)
        kinds = {int(field.datatype) for field in channels.values()}
        if len(kinds) > 1 or not kinds.issubset(CHANNEL_TYPES):
            raise CloudFormatError(
                "color_type",
                f"fields {', '.join(names)} have datatypes {', '.join(map(str, sorted(kinds)))}, not one of UINT8, "
                "UINT16, FLOAT32 and FLOAT64",
            )
        _check_places({**coordinates, **channels}, point_step)
        red, green, blue = (int(channels[name].offset) for name in names)
        return (red, green, blue), kinds.pop()
    return None


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


def check_stamp(msg: Any) -> None:
    """Refuse a time that is none."""
    nanosec = int(msg.header.stamp.nanosec)
    if not 0 <= nanosec < 1_000_000_000:
        raise CloudFormatError("bad_stamp", f"header.stamp.nanosec = {nanosec} is not less than 1e9")
