# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Fields of every type that a format knows, beside the coordinates: of the size that the format says, to the byte."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from clouds import NUMPY, TYPES, header

from topo_region_seg.cloud.files import CloudFileError, read_cloud
from topo_region_seg.cloud.layout import CloudFormatError, check_field
from topo_region_seg.cloud.pointcloud2 import decode

N = 6
XYZ = np.random.default_rng(0).normal(size=(N, 3)).astype(np.float32)
PCD_TYPES = [("F", 4), ("F", 8), *((kind, size) for kind in "IU" for size in (1, 2, 4, 8))]
PLY_TYPES = {
    "i1": ("char", "int8"), "u1": ("uchar", "uint8"), "i2": ("short", "int16"), "u2": ("ushort", "uint16"),
    "i4": ("int", "int32"), "u4": ("uint", "uint32"), "f4": ("float", "float32"), "f8": ("double", "float64"),
}  # fmt: skip


def _pcd(kind: str, size: int, count: int) -> bytes:
    record = np.dtype([("x", "<f4"), ("other", f"<{kind.lower()}{size}", (count,)), ("y", "<f4"), ("z", "<f4")])
    head = (
        f"VERSION .7\nFIELDS x other y z\nSIZE 4 {size} 4 4\nTYPE F {kind} F F\nCOUNT 1 {count} 1 1\n"
        f"WIDTH {N}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {N}\nDATA binary\n"
    )
    return head.encode() + _filled(record).tobytes()


def _filled(record: np.dtype[Any]) -> np.ndarray:
    table = np.zeros(N, record)
    for axis, name in enumerate("xyz"):
        table[name] = XYZ[:, axis]
    table["other"] = 77
    return table


@pytest.mark.parametrize(("kind", "size"), PCD_TYPES)
@pytest.mark.parametrize("count", [1, 3])
def test_pcd(kind: str, size: int, count: int, tmp_path: Path) -> None:
    path = tmp_path / "a.pcd"
    path.write_bytes(_pcd(kind, size, count))
    np.testing.assert_array_equal(read_cloud(path, max_points=N).xyz, XYZ)


@pytest.mark.parametrize(("kind", "size"), [("F", 2), ("F", 1), ("I", 3), ("U", 16), ("I", 0), ("B", 1)])
def test_pcd_has_no_other_types(kind: str, size: int, tmp_path: Path) -> None:
    path = tmp_path / "a.pcd"
    path.write_bytes(
        _pcd("U", 1, 1).replace(b"SIZE 4 1", b"SIZE 4 %d" % size).replace(b"F U F", b"F %s F" % kind.encode())
    )
    with pytest.raises(CloudFileError, match=f"field other of TYPE {kind}, SIZE {size}, COUNT 1"):
        read_cloud(path, max_points=N)


@pytest.mark.parametrize("code", PLY_TYPES)
@pytest.mark.parametrize("form", ["binary_little_endian", "binary_big_endian", "ascii"])
@pytest.mark.parametrize("spelling", [0, 1])
def test_ply(code: str, form: str, spelling: int, tmp_path: Path) -> None:
    order = ">" if form == "binary_big_endian" else "<"
    table = _filled(np.dtype([("x", f"{order}f4"), ("other", order + code), ("y", f"{order}f4"), ("z", f"{order}f4")]))
    head = (
        f"ply\nformat {form} 1.0\nelement vertex {N}\nproperty float x\nproperty {PLY_TYPES[code][spelling]} other\n"
        "property float y\nproperty float z\nend_header\n"
    )
    text = "".join(" ".join(f"{value:.9g}" for value in row) + "\n" for row in table.tolist())
    path = tmp_path / "a.ply"
    path.write_bytes(head.encode() + (text.encode() if form == "ascii" else table.tobytes()))
    np.testing.assert_array_equal(read_cloud(path, max_points=N).xyz, XYZ)


def _message(fields: list[tuple[str, int, int, int]], point_step: int, height: int = 2) -> Any:
    """Fields are (name, offset, datatype, count)."""
    width = N // height
    data = np.arange(N * point_step, dtype=np.int64).astype(np.uint8)
    return TYPES.PointCloud2(
        header=header(),
        height=height,
        width=width,
        fields=[TYPES.PointField(name=n, offset=o, datatype=k, count=c) for n, o, k, c in fields],
        is_bigendian=False,
        point_step=point_step,
        row_step=width * point_step,
        data=data,
        is_dense=True,
    )


def _checked(msg: Any) -> tuple[Any, int]:
    return check_field(msg, msg.data.nbytes, "label", max_points=N, warn=lambda code, text: pytest.fail(text))


@pytest.mark.parametrize("datatype", NUMPY)
@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("height", [1, 2, 3])
def test_a_field_of_a_message_ends_where_its_type_says(datatype: int, count: int, height: int) -> None:
    offset = 5
    end = offset + count * np.dtype(NUMPY[datatype]).itemsize
    field, row_step = _checked(_message([("label", offset, datatype, count)], end, height))
    assert (int(field.offset), int(field.datatype), row_step) == (offset, datatype, N // height * end)
    with pytest.raises(CloudFormatError, match=f"'label' ends at byte {end}, but point_step is {end - 1}"):
        _checked(_message([("label", offset, datatype, count)], end - 1, height))


@pytest.mark.parametrize("datatype", [0, 9, 255])
def test_a_message_has_no_other_types(datatype: int) -> None:
    with pytest.raises(CloudFormatError, match="field_type"):
        _checked(_message([("label", 0, datatype, 1)], 32))


@pytest.mark.parametrize("color", ["rgb", "rgba"])
def test_fields_may_touch_but_not_overlap(color: str) -> None:
    for coordinate, size in ((7, 4), (8, 8)):
        places = [("x", 0, coordinate, 1), ("y", size, coordinate, 1), ("z", 2 * size, coordinate, 1)]
        decode(_message([*places, (color, 3 * size, 6, 1)], 3 * size + 4), max_points=N)
        with pytest.raises(CloudFormatError, match=f"'z' and '{color}' overlap"):
            decode(_message([*places, (color, 3 * size - 1, 6, 1)], 3 * size + 4), max_points=N)
        with pytest.raises(CloudFormatError, match=f"'{color}' and 'x' overlap"):
            late = [(name, offset + 4, kind, count) for name, offset, kind, count in places]
            decode(_message([(color, 1, 6, 1), *late], 3 * size + 5), max_points=N)
