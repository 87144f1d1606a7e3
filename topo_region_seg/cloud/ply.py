# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The points of a PLY file as a table, and a table as a PLY file; ASCII and binary."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

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
    name: str
    count: int
    properties: list[tuple[str, str]] = field(default_factory=list)
    has_lists: bool = False


def read_vertices(path: Path) -> npt.NDArray[Any]:
    """Return the element "vertex" as a structured array, native byte order.

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
        if len({name for name, _ in element.properties}) != len(element.properties):
            raise PlyError("a property of its vertices is there twice")
        if form == "ascii":
            return _ascii(file, element, skip=sum(other.count for other in before))
        return _binary(file, element, before, ORDERS[form])


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
        words = file.readline(MAX_LINE).decode("ascii", "replace").split()
        if words == ["end_header"]:
            if form not in ORDERS:
                raise PlyError(f"its format '{form}' is not known")
            return form, elements
        if not words:
            raise PlyError("its header ends early")
        keyword, rest = words[0], words[1:]
        if keyword == "format" and rest:
            form = rest[0]
        elif keyword == "element" and len(rest) == 2 and rest[1].isdecimal():
            elements.append(_Element(rest[0], int(rest[1])))
        elif keyword == "property" and elements and len(rest) == 4 and rest[0] == "list":
            elements[-1].has_lists = True
        elif keyword == "property" and elements and len(rest) == 2 and rest[0] in TYPES:
            elements[-1].properties.append((rest[1], TYPES[rest[0]]))
        elif keyword not in ("comment", "obj_info"):
            raise PlyError(f"its header line '{' '.join(words)[:60]}' is not understood")
    raise PlyError("its header is too long")


def _ascii(file: BinaryIO, element: _Element, skip: int) -> npt.NDArray[Any]:
    if element.count > _left(file):  # a point takes two bytes at least
        raise PlyError("it is cut short")
    kind = np.dtype(element.properties)
    if element.count == 0:
        return np.empty(0, kind)
    table: npt.NDArray[Any] = np.loadtxt(file, kind, skiprows=skip, max_rows=element.count, ndmin=1)
    if len(table) != element.count:
        raise PlyError("it is cut short")
    return table


def _binary(file: BinaryIO, element: _Element, before: list[_Element], order: str) -> npt.NDArray[Any]:
    for other in before:
        if other.has_lists:
            raise PlyError(f"its element '{other.name}' with lists comes before the vertices")
        file.seek(other.count * np.dtype(other.properties).itemsize, os.SEEK_CUR)
    stored = np.dtype([(name, order + kind) for name, kind in element.properties])
    if element.count * stored.itemsize > _left(file):
        raise PlyError("it is cut short")
    data = file.read(element.count * stored.itemsize)
    return np.frombuffer(data, stored).astype(np.dtype(element.properties))


def _left(file: BinaryIO) -> int:
    return os.fstat(file.fileno()).st_size - file.tell()
