# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""PCD and PLY files of the kinds that others write, byte by byte, independently of the code under test."""

from __future__ import annotations

import itertools
import struct
from dataclasses import dataclass
from typing import Any

import lzf
import numpy as np
import numpy.typing as npt

Table = npt.NDArray[Any]
RGB = npt.NDArray[np.uint8]

CHANNEL_COLORS = {
    "bytes": ("u1", 1.0),
    "shorts": ("u2", 257.0),
    "ints": ("i4", 1.0),
    "shares": ("f4", 1 / 255),
    "double shares": ("f8", 1 / 255),
    "floats to 255": ("f4", 1.0),
}
"""Type and factor of colors of one number a channel."""
PCD_LETTERS = {"f": "F", "u": "U", "i": "I"}
PLY_NAMES = {"f4": "float", "f8": "double", "u1": "uchar", "u2": "ushort", "i4": "int", "i2": "short"}
SIZED_NAMES = {"f4": "float32", "f8": "float64", "u1": "uint8", "u2": "uint16", "i4": "int32", "i2": "int16"}


@dataclass(frozen=True)
class PcdKind:
    """What a writer of PCD files does."""

    data: str = "binary"
    color: str = "rgb float"
    coordinates: str = "f4"
    organized: bool = False
    spelling: str = "plain"

    @property
    def name(self) -> str:
        return "-".join(str(value).replace(" ", "_") for value in vars(self).values())


@dataclass(frozen=True)
class PlyKind:
    """What a writer of PLY files does."""

    form: str = "binary_little_endian"
    color: str = "bytes"
    coordinates: str = "f4"
    spelling: str = "plain"

    @property
    def name(self) -> str:
        return "-".join(str(value).replace(" ", "_") for value in vars(self).values())


PACKED_COLORS = ("rgb float", "rgb unsigned", "rgba unsigned", "rgb double", "rgb bytes")
PCD_SPELLINGS = (
    "plain",
    "two spaces",
    "tabs",
    "leading space",
    "trailing space",
    "crlf",
    "no COUNT",
    "no POINTS",
    "no VIEWPOINT",
    "COLUMNS",
    "version .5",
    "comments",
    "padding",
    "normals",
    "upper case",
)
PLY_SPELLINGS = (
    "plain",
    "blank line",
    "long comment",
    "crlf",
    "obj_info",
    "camera before",
    "faces after",
    "faces before",
    "normals",
    "sized types",
    "other names",
    "diffuse",
)


def pcd_kinds() -> list[PcdKind]:
    """Return every kind of data, color and coordinates, in turn with every spelling."""
    colors = ("none", *PACKED_COLORS, *CHANNEL_COLORS)
    core = itertools.product(("ascii", "binary", "binary_compressed"), colors, ("f4", "f8"), (False, True))
    turns = itertools.cycle(PCD_SPELLINGS)
    found = [PcdKind(*values, next(turns)) for values in core]
    return [*found, *(PcdKind("ascii", spelling=spelling) for spelling in PCD_SPELLINGS)]


def ply_kinds() -> list[PlyKind]:
    """Return every form, color and type of coordinates, in turn with every spelling, and each spelling by itself."""
    core = itertools.product(
        ("ascii", "binary_little_endian", "binary_big_endian"), ("none", *CHANNEL_COLORS), ("f4", "f8")
    )
    turns = itertools.cycle(PLY_SPELLINGS)
    found = [PlyKind(*values, next(turns)) for values in core]
    forms = ("ascii", "binary_little_endian")
    more = [PlyKind(form, spelling=spelling) for form in forms for spelling in PLY_SPELLINGS]
    return [*found, *(kind for kind in more if kind not in found)]


def make_pcd(xyz: npt.NDArray[np.float32], rgb: RGB, height: int, kind: PcdKind) -> bytes:
    """Return a PCD file of the points; packed colors have alpha 0, as text would lose others."""
    columns: list[tuple[str, Table]] = [
        (name, xyz[:, axis].astype(kind.coordinates)) for axis, name in enumerate("xyz")
    ]
    if kind.spelling == "padding":
        columns.insert(1, ("_", np.zeros((len(xyz), 3), np.uint8)))
        columns.append(("_", np.zeros((len(xyz), 1), np.uint8)))
    if kind.spelling == "normals":
        columns += [(f"normal_{name}", np.full(len(xyz), np.nan, np.float32)) for name in "xyz"]
    columns += _pcd_colors(rgb, kind.color)
    if kind.spelling == "upper case":
        columns = [(name.upper(), column) for name, column in columns]
    counts = [1 if column.ndim == 1 else column.shape[1] for _, column in columns]
    lines = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        f"FIELDS {' '.join(name for name, _ in columns)}",
        f"SIZE {' '.join(str(column.dtype.itemsize) for _, column in columns)}",
        f"TYPE {' '.join(PCD_LETTERS[column.dtype.kind] for _, column in columns)}",
        f"COUNT {' '.join(map(str, counts))}",
        f"WIDTH {len(xyz) // (height if kind.organized else 1)}",
        f"HEIGHT {height if kind.organized else 1}",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {len(xyz)}",
        f"DATA {kind.data}",
    ]
    return _spelled_header(lines, kind.spelling, counts) + _pcd_data(columns, kind)


def _pcd_colors(rgb: RGB, color: str) -> list[tuple[str, Table]]:
    if color == "none":
        return []
    if color in CHANNEL_COLORS:
        type_, factor = CHANNEL_COLORS[color]
        return [(name, (rgb[:, i] * factor).astype(type_)) for i, name in enumerate("rgb")]
    if color == "rgb bytes":
        return [("rgb", rgb)]
    red, green, blue = rgb.T.astype(np.uint32)
    packed = red << 16 | green << 8 | blue
    name, _, type_ = color.partition(" ")
    return [
        (name, packed if type_ == "unsigned" else packed.view(np.float32).astype("f8" if type_ == "double" else "f4"))
    ]


def _spelled_header(lines: list[str], spelling: str, counts: list[int]) -> bytes:
    def without(word: str) -> list[str]:
        return [line for line in lines if not line.startswith(word)]

    if spelling == "no COUNT" and set(counts) == {1}:
        lines = without("COUNT")
    elif spelling in ("no POINTS", "no VIEWPOINT"):
        lines = without(spelling[3:])
    elif spelling == "COLUMNS":
        lines = [line.replace("FIELDS", "COLUMNS").replace("0.7", ".6") for line in lines]
    elif spelling == "version .5":
        lines = [line.replace("0.7", ".5") for line in without("VIEWPOINT")]
    elif spelling == "comments":
        lines = [lines[0], "#", "# by hand", lines[1], "", *lines[2:]]
    between = {"two spaces": "  ", "tabs": "\t"}.get(spelling, " ")
    lines = [between.join(line.split(" ")) if not line.startswith("#") else line for line in lines]
    lines = [line + " " if spelling == "trailing space" else line for line in lines]
    end = "\r\n" if spelling == "crlf" else "\n"
    return "".join(line + end for line in lines).encode()


def _pcd_data(columns: list[tuple[str, Table]], kind: PcdKind) -> bytes:
    if kind.data == "ascii":
        between = {"two spaces": "  ", "tabs": "\t"}.get(kind.spelling, " ")
        before = " " if kind.spelling == "leading space" else ""
        after = {"trailing space": " \n", "crlf": "\r\n"}.get(kind.spelling, "\n")
        cells = [row for _, column in columns for row in column.reshape(len(column), -1).T]
        return "".join(before + between.join(map(_number, row)) + after for row in zip(*cells, strict=True)).encode()
    if kind.data == "binary":
        record = np.dtype([(str(i), column.dtype, column.shape[1:]) for i, (_, column) in enumerate(columns)])
        table = np.empty(len(columns[0][1]), record)
        for i, (_, column) in enumerate(columns):
            table[str(i)] = column
        return table.tobytes()
    raw = b"".join(np.ascontiguousarray(column).tobytes() for _, column in columns)
    packed = lzf.compress(raw, 2 * len(raw))
    return struct.pack("<II", len(packed), len(raw)) + packed


def _number(value: Any) -> str:
    if isinstance(value, np.floating):
        return np.format_float_scientific(value) if np.isfinite(value) else "nan"
    return str(int(value))


def make_ply(xyz: npt.NDArray[np.float32], rgb: RGB, kind: PlyKind) -> bytes:
    """Return a PLY file of the points."""
    order = ">" if kind.form.endswith("big_endian") else "<"
    record = [(name, order + kind.coordinates) for name in "xyz"]
    if kind.spelling == "normals":
        record += [(f"n{name}", order + "f4") for name in "xyz"]
    names = {"other names": ("r", "g", "b"), "diffuse": ("diffuse_red", "diffuse_green", "diffuse_blue")}.get(
        kind.spelling, ("red", "green", "blue")
    )
    if kind.color != "none":
        type_, factor = CHANNEL_COLORS[kind.color]
        record += [(name, order + type_) for name in names]
    table = np.zeros(len(xyz), record)
    for axis, name in enumerate("xyz"):
        table[name] = xyz[:, axis]
    if kind.color != "none":
        for channel, name in enumerate(names):
            table[name] = rgb[:, channel] * factor
    called = SIZED_NAMES if kind.spelling == "sized types" else PLY_NAMES
    vertices = [f"element vertex {len(xyz)}"]
    vertices += [f"property {called[table.dtype[name].str[1:]]} {name}" for name in table.dtype.names]
    faces = ["element face 2", "property list uchar int vertex_indices", "property uchar flag"]
    cameras = ["element camera 1", "property float focal", "property int id"]
    body = [(vertices, _rows(table, kind))]
    triangles = [(3, (0, 1, 2), 7), (4, (0, 1, 2, 3), 8)]
    if kind.spelling == "faces before":
        body.insert(0, (faces, _faces(triangles, kind, order)))
    if kind.spelling == "faces after":
        body.append((faces, _faces(triangles, kind, order)))
    if kind.spelling == "camera before":
        body.insert(0, (cameras, _rows(np.array([(1.5, 3)], [("f", order + "f4"), ("i", order + "i4")]), kind)))
    extra = {
        "blank line": [""],
        "long comment": ["comment " + "x" * 5_000],
        "obj_info": ["obj_info num_cols 640", "comment made by hand"],
    }.get(kind.spelling, [])
    lines = ["ply", f"format {kind.form} 1.0", *extra, *(line for head, _ in body for line in head), "end_header"]
    end = "\r\n" if kind.spelling == "crlf" else "\n"
    return "".join(line + end for line in lines).encode() + b"".join(data for _, data in body)


def _rows(table: Table, kind: PlyKind) -> bytes:
    if kind.form != "ascii":
        return table.tobytes()
    end = "\r\n" if kind.spelling == "crlf" else "\n"
    return "".join(" ".join(_number(row[name]) for name in table.dtype.names) + end for row in table).encode()


def _faces(triangles: list[tuple[int, tuple[int, ...], int]], kind: PlyKind, order: str) -> bytes:
    if kind.form == "ascii":
        return "".join(f"{count} {' '.join(map(str, corners))} {flag}\n" for count, corners, flag in triangles).encode()
    return b"".join(struct.pack(f"{order}B{count}iB", count, *corners, flag) for count, corners, flag in triangles)
