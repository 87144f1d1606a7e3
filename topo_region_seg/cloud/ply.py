# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The points of a PLY file as a table, and a table as a PLY file; ASCII and binary."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.text_table import CutShortError, bytes_left, claim, read_text

MAX_HEADER_LINES = 1_000
MAX_LINE = 1_000
NAMES = {
    "i1": "char",
    "u1": "uchar",
    "i2": "short",
    "u2": "ushort",
    "i4": "int",
    "u4": "uint",
    "f4": "float",
    "f8": "double",
}
SIZED = {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"}
TYPES = {**{name: kind for kind, name in NAMES.items()}, **SIZED, "float32": "f4", "float64": "f8"}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


class PlyError(ValueError):
    """The file is no PLY file, is damaged, or holds what is not read here."""


@dataclass
class _Element:
    """An element; a property is a name and a type, or a name and the types of the length and items of a list."""

    name: str
    count: int
    properties: list[tuple[str, ...]] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        return any(len(kinds) > 1 for _, *kinds in self.properties)


def read_vertices(path: Path, check_points: Callable[[int], None]) -> npt.NDArray[Any]:
    """Return the element "vertex" as a structured array, native byte order.

    `check_points` is called with the number of points before they are read.

    Raises
    ------
    PlyError
        With the reason.
    """
    with path.open("rb") as file:
        form, elements = _header(file)
        before: list[_Element] = []
        for element in elements:
            if element.name == "vertex":
                break
            before.append(element)
        else:
            raise PlyError("it has no element 'vertex'")
        if element.has_lists:
            raise PlyError("its vertices hold lists")
        if len({name for name, *_ in element.properties}) != len(element.properties):
            raise PlyError("a property of its vertices is there twice")
        if form == "ascii":
            claim(file, element.count, 1, check_points)
            return read_text(file, np.dtype(element.properties), element.count, sum(other.count for other in before))
        for other in before:
            _skip(file, other, ORDERS[form])
        return _binary(file, element, ORDERS[form], check_points)


def write_vertices(path: Path, table: npt.NDArray[Any]) -> None:
    """Write a structured array as the element "vertex", binary, little-endian."""
    kinds = table.dtype
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(table)}"]
    lines += [f"property {NAMES[kinds[name].str[1:]]} {name}" for name in kinds.names or ()]
    packed = np.dtype([(name, "<" + kinds[name].str[1:]) for name in kinds.names or ()])
    with path.open("wb") as file:
        file.write("\n".join([*lines, "end_header", ""]).encode("ascii"))
        file.write(table.astype(packed).tobytes())


def _header(file: BinaryIO) -> tuple[str, list[_Element]]:
    if file.readline(MAX_LINE).strip() != b"ply":
        raise PlyError("it does not begin with 'ply'")
    form = ""
    elements: list[_Element] = []
    for _ in range(MAX_HEADER_LINES):
        line = file.readline(MAX_LINE)
        words = line.decode("ascii", "replace").split()
        if line and not words:
            continue
        if words == ["end_header"]:
            if form not in ORDERS:
                raise PlyError(f"its format '{form}' is not known")
            return form, elements
        if not words:
            raise PlyError("its header ends early")
        keyword, rest = words[0], words[1:]
        if keyword in ("comment", "obj_info"):
            while line and not line.endswith(b"\n"):
                line = file.readline(MAX_LINE)
        elif keyword == "format" and rest:
            form = rest[0]
        elif keyword == "element" and len(rest) == 2 and rest[1].isdecimal():
            elements.append(_Element(rest[0], int(rest[1])))
        elif (
            keyword == "property" and elements and len(rest) == 4 and rest[0] == "list" and set(rest[1:3]) <= set(TYPES)
        ):
            elements[-1].properties.append((rest[3], TYPES[rest[1]], TYPES[rest[2]]))
        elif keyword == "property" and elements and len(rest) == 2 and rest[0] in TYPES:
            elements[-1].properties.append((rest[1], TYPES[rest[0]]))
        else:
            raise PlyError(f"its header line '{' '.join(words)[:60]}' is not understood")
    raise PlyError("its header is too long")


def _skip(file: BinaryIO, element: _Element, order: str) -> None:
    """Pass over an element of a binary file; one with lists has to be walked."""
    if not element.has_lists:
        size = sum(np.dtype(kind).itemsize for _, kind in element.properties)
        file.seek(element.count * size, os.SEEK_CUR)
        return
    steps = [[np.dtype(order + kind) for kind in kinds] for _, *kinds in element.properties]
    for _ in range(element.count):
        for first, *items in steps:
            data = file.read(first.itemsize)
            if len(data) < first.itemsize:
                raise CutShortError
            if items:
                length = int(np.frombuffer(data, first)[0])
                if not 0 <= length * items[0].itemsize <= bytes_left(file):
                    raise CutShortError
                file.seek(length * items[0].itemsize, os.SEEK_CUR)


def _binary(file: BinaryIO, element: _Element, order: str, check_points: Callable[[int], None]) -> npt.NDArray[Any]:
    stored = np.dtype([(name, order + kind) for name, kind in element.properties])
    claim(file, element.count, stored.itemsize, check_points)
    data = file.read(element.count * stored.itemsize)
    return np.frombuffer(data, stored).astype(np.dtype(element.properties))
