# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""PCD files of versions .5 to .7, in text, binary and binary compressed, as PCL and others write them.

Optional lines may be missing, COLUMNS may stand for FIELDS, and white space is free, as PCL's own reader has it.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.text_table import CutShortError, bytes_left, claim, read_text

MAX_HEADER_LINES = 1_000
MAX_LINE = 65_536
KINDS = {"F": (4, 8), "I": (1, 2, 4, 8), "U": (1, 2, 4, 8)}
"""Sizes in bytes by type."""
UNTOLD = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""VIEWPOINT of writers that do not know it."""
_PADDING = "_"


class PcdError(ValueError):
    """The file is no PCD file or is damaged."""


@dataclass(frozen=True)
class PcdCloud:
    """The columns of a PCD file by name, (N,) or (N, count), and what its header says of them."""

    columns: dict[str, npt.NDArray[Any]]
    height: int
    width: int
    viewpoint: tuple[float, ...] | None
    """Translation, metres, and quaternion, w first; None where the file does not tell it."""
    is_text: bool
    oddities: tuple[str, ...] = ()
    """What is readable, but should be said; one line each."""


@dataclass(frozen=True)
class _Header:
    record: np.dtype[Any]
    points: int
    height: int
    width: int
    viewpoint: tuple[float, ...] | None
    data: str
    oddities: tuple[str, ...]


def read_pcd(path: Path, check_points: Callable[[int], None]) -> PcdCloud:
    """Read a PCD file; `check_points` is called with the number of points before they are read.

    Raises
    ------
    PcdError, ValueError
        With the reason.
    """
    with path.open("rb") as file:
        header = _read_header(file)
        oddities = header.oddities
        if header.data == "ascii":
            claim(file, header.points, 1, check_points)
            table = read_text(file, header.record, header.points)
            columns = {name: table[name] for name in header.record.names or ()}
            if any(line.strip() for line in file):
                oddities += (f"holds more lines than its {header.points} points; the others are left out",)
        elif header.data == "binary":
            columns = _binary(file, header, check_points)
        else:
            columns = _compressed(file, header, check_points)
    shown = {name: column for name, column in columns.items() if not name.startswith(_PADDING)}
    return PcdCloud(shown, header.height, header.width, header.viewpoint, header.data == "ascii", oddities)


def _read_header(file: BinaryIO) -> _Header:
    lines: dict[str, list[str]] = {}
    for _ in range(MAX_HEADER_LINES):
        line = file.readline(MAX_LINE)
        if not line:
            break
        keyword, *values = line.decode("ascii", "replace").partition("#")[0].split() or [""]
        lines.setdefault(keyword.upper(), values)
        if keyword.upper() == "DATA":
            return _parsed(lines)
    raise PcdError("its header is damaged: there is no line DATA")


def _parsed(lines: dict[str, list[str]]) -> _Header:
    names = lines.get("FIELDS") or lines.get("COLUMNS")
    data = (lines["DATA"] or [""])[0].lower()
    if not names:
        raise PcdError("its header is damaged: there is no line FIELDS")
    if data not in ("ascii", "binary", "binary_compressed"):
        raise PcdError(f"its data is '{data}', not ascii, binary or binary_compressed")
    sizes = _numbers(lines, "SIZE", [4] * len(names))
    counts = _numbers(lines, "COUNT", [1] * len(names))
    kinds = lines.get("TYPE") or ["F"] * len(names)
    if not len(names) == len(sizes) == len(counts) == len(kinds):
        raise PcdError("its header is damaged: FIELDS, SIZE, TYPE and COUNT differ in length")
    places: list[Any] = []
    for number, (name, kind, size, count) in enumerate(zip(names, kinds, sizes, counts, strict=True)):
        if size not in KINDS.get(kind.upper(), ()) or not 1 <= count <= MAX_LINE:
            raise PcdError(f"its header is damaged: field {name} of TYPE {kind}, SIZE {size}, COUNT {count}")
        code = f"<{kind.lower()}{size}"
        unique = f"{_PADDING}{number}" if name == _PADDING else name
        places.append((unique, code) if count == 1 else (unique, code, (count,)))
    if len({place[0] for place in places}) != len(places):
        raise PcdError("a field is there twice")
    (width,) = _numbers(lines, "WIDTH", _numbers(lines, "POINTS", [0]))[:1]
    (height,) = _numbers(lines, "HEIGHT", [1])[:1]
    (points,) = _numbers(lines, "POINTS", [width * height])[:1]
    viewpoint = _viewpoint(lines.get("VIEWPOINT", []))
    odd = "VIEWPOINT" in lines and viewpoint is None
    viewpoint = None if viewpoint == UNTOLD else viewpoint
    oddities = (f"VIEWPOINT {' '.join(lines['VIEWPOINT'])[:80]} is no pose; it is not used",) if odd else ()
    return _Header(np.dtype(places), points, height, width, viewpoint, data, oddities)


def _numbers(lines: dict[str, list[str]], keyword: str, default: list[int]) -> list[int]:
    values = lines.get(keyword)
    if not values:
        return default
    if not all(value.isdecimal() for value in values):
        raise PcdError(f"its header is damaged: {keyword} {' '.join(values)[:40]}")
    return [int(value) for value in values]


def _viewpoint(values: list[str]) -> tuple[float, ...] | None:
    """Return translation and quaternion (w first); None if they are not such."""
    try:
        pose = tuple(float(value) for value in values)
    except ValueError:
        return None
    if len(pose) != 7 or not all(map(math.isfinite, pose)) or not any(pose[3:]):
        return None
    return pose


def _binary(file: BinaryIO, header: _Header, check_points: Callable[[int], None]) -> dict[str, npt.NDArray[Any]]:
    claim(file, header.points, header.record.itemsize, check_points)
    table = np.frombuffer(file.read(header.points * header.record.itemsize), header.record)
    return {name: table[name] for name in header.record.names or ()}


def _compressed(file: BinaryIO, header: _Header, check_points: Callable[[int], None]) -> dict[str, npt.NDArray[Any]]:
    """Decompress the columns, which lie one after the other."""
    size = header.points * header.record.itemsize
    if header.points == 0:
        return {name: np.empty(0, header.record)[name] for name in header.record.names or ()}
    head = file.read(8)
    packed_size, claimed = struct.unpack("<II", head) if len(head) == 8 else (0, 0)
    if len(head) < 8 or packed_size > bytes_left(file):
        raise CutShortError
    if claimed != size:
        raise PcdError(f"it holds {claimed} bytes, but {header.points} points have {size}")
    check_points(header.points)
    import lzf

    data = lzf.decompress(file.read(packed_size), size)
    if data is None or len(data) != size:
        raise PcdError("its data does not decompress")
    columns: dict[str, npt.NDArray[Any]] = {}
    start = 0
    for name in header.record.names or ():
        kind = header.record[name]
        end = start + header.points * kind.itemsize
        base, shape = kind.subdtype or (kind, ())
        columns[name] = np.frombuffer(data[start:end], base).reshape(header.points, *shape)
        start = end
    return columns
