# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs/PointCloud2 <-> :class:`~topo_region_seg.data.Cloud`, the same code for rclpy's and rosbags' messages.

Nothing in a message is trusted: fields are found by name, every claim is checked by
:mod:`topo_region_seg.cloud.layout` first, and values are copied through strided views of the buffer.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.buffers import bytes_of
from topo_region_seg.cloud.color_values import as_bytes
from topo_region_seg.cloud.layout import (
    FLOAT32,
    FLOAT64,
    UINT8,
    CloudFormatError,
    Layout,
    Warn,
    check,
    check_field,
    ignore,
)
from topo_region_seg.cloud.records import read_records
from topo_region_seg.data import Cloud

__all__ = ["CloudFormatError", "byte_buffer", "cloud_message", "decode", "encode", "field_of"]
DATATYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
"""PointField datatype of each NumPy type."""
KINDS = {number: kind for kind, number in DATATYPES.items()}


def decode(msg: Any, *, max_points: int, warn: Warn | None = None, needs_color: bool = True) -> Cloud:
    """Read a cloud from a message, which is not modified.

    Parameters
    ----------
    msg : sensor_msgs/PointCloud2
        Of rclpy or rosbags; its data may be an ``array.array``, ``bytes`` or a ``ndarray``.
    max_points : int
        Clouds with more points are refused.
    warn : callable, optional
        Called with (code, text) for input that is readable but odd.
    needs_color : bool
        Whether a cloud whose color cannot be read is refused, or read without.

    Returns
    -------
    Cloud
        Every point of the message, invalid ones included; `xyz` (N, 3) float32, metres; `rgb` (N, 3) uint8 or None.

    Raises
    ------
    CloudFormatError
        The message contradicts itself, lacks x, y or z, or is too large.
    """
    buffer = bytes_of(msg.data)
    layout = check(msg, buffer.nbytes, max_points=max_points, warn=warn or ignore, needs_color=needs_color)
    if layout.height * layout.width == 0:
        empty = np.empty((0, 3), np.float32), np.empty((0, 3), np.uint8)
        return Cloud(*empty, layout.height, layout.width)
    if _is_plain(layout):
        xyz, rgb = _read_at_once(buffer, layout)
    else:
        xyz, rgb = _coordinates(buffer, layout), _colors(buffer, layout)
    return Cloud(xyz, rgb, layout.height, layout.width)


def field_of(msg: Any, name: str) -> npt.NDArray[Any]:
    """Return one field of every point of a message that :func:`decode` has read, (N,) or (N, count), little-endian.

    Raises
    ------
    CloudFormatError
        The field is not there, or not where the message says.
    """
    if not hasattr(msg, "fields"):
        raise CloudFormatError("field_missing", f"no field {name}: images have none")
    buffer, size = bytes_of(msg.data), int(msg.height) * int(msg.width)
    field, row_step = check_field(msg, buffer.nbytes, name, max_points=size, warn=ignore)
    kind = np.dtype((">" if msg.is_bigendian else "<") + KINDS[int(field.datatype)])
    count = int(field.count)
    shape, strides = (int(msg.height), int(msg.width), count), (row_step, int(msg.point_step), kind.itemsize)
    if size == 0:
        buffer, strides = np.empty(kind.itemsize * count, np.uint8), (0, 0, kind.itemsize)
    values: npt.NDArray[Any] = np.ndarray(shape, kind, buffer, int(field.offset) if size else 0, strides)
    values = values.astype(kind.newbyteorder("<")).reshape(size, count)
    return values[:, 0] if count == 1 else values


def encode(
    types: Any,
    header: Any,
    columns: Mapping[str, npt.NDArray[Any]],
    *,
    height: int = 1,
    width: int | None = None,
    is_dense: bool,
) -> Any:
    """Make a message of named columns, packed without gaps, little-endian.

    Parameters
    ----------
    types : namespace
        Has the classes `PointCloud2` and `PointField`, of rclpy or rosbags.
    header : std_msgs/Header
        Of the same kind; used as it is.
    columns : mapping of str to (N,) ndarray
        The fields in order; integers to 32 bits, float32 or float64.
    height, width : int
        Organization; `width` defaults to N / `height`.
    is_dense : bool
        Whether every value is finite.

    Returns
    -------
    sensor_msgs/PointCloud2

    Raises
    ------
    ValueError
        The columns differ in length, or `height` * `width` is not their length.
    """
    sizes = {len(column) for column in columns.values()}
    if len(sizes) != 1:
        raise ValueError(f"columns of different lengths: {sorted(sizes)}")
    n = sizes.pop()
    if width is None:
        width = n // height if height else 0
    if height * width != n:
        raise ValueError(f"{n} points cannot be organized as {width} x {height}")
    record = np.dtype([(name, column.dtype.newbyteorder("<")) for name, column in columns.items()])
    buffer = byte_buffer(types.PointCloud2, n * record.itemsize)
    table = np.frombuffer(buffer, record)
    for name, column in columns.items():
        table[name] = column
    return cloud_message(types, header, record, buffer, height, width, is_dense)


def cloud_message(
    types: Any, header: Any, record: np.dtype[Any], buffer: Any, height: int, width: int, is_dense: bool
) -> Any:
    """Make a message of records that lie in a buffer, as :func:`byte_buffer` makes it, one after the other."""
    fields = [
        types.PointField(
            name=name,
            offset=int(offset),
            datatype=DATATYPES[kind.base.str[1:]],
            count=int(np.prod(kind.shape, dtype=int)),
        )
        for name, (kind, offset, *_) in (record.fields or {}).items()
    ]
    return types.PointCloud2(
        header=header,
        height=int(height),
        width=int(width),
        fields=fields,
        is_bigendian=False,
        point_step=record.itemsize,
        row_step=record.itemsize * int(width),
        data=buffer,
        is_dense=bool(is_dense),
    )


def byte_buffer(message_class: Any, size: int) -> Any:
    """Return `size` writable bytes of the kind that the message class takes as it is.

    rclpy walks element by element through lists, memoryviews and ndarrays that are assigned to a byte field, but takes
    an ``array.array`` without a look; rosbags takes an ndarray.
    """
    if hasattr(message_class, "get_fields_and_field_types"):
        return array("B", b"\0") * size
    return np.empty(size, np.uint8)


def _column(buffer: npt.NDArray[np.uint8], layout: Layout, offset: int, dtype: str) -> npt.NDArray[Any]:
    """View one value of every point, shape (height, width); `offset` may be unaligned."""
    shape, strides = (layout.height, layout.width), (layout.row_step, layout.point_step)
    column: npt.NDArray[Any] = np.ndarray(shape, dtype, buffer, offset, strides)
    return column


def _is_plain(layout: Layout) -> bool:
    """Whether coordinates are little-endian float32 and colors bytes, as nearly every driver sends them."""
    floats = all(kind == FLOAT32 for _, kind in layout.coordinates)
    return floats and layout.channel == UINT8 and not layout.big_endian


def _read_at_once(
    buffer: npt.NDArray[np.uint8], layout: Layout
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint8] | None]:
    """Read coordinates and colors in one pass, which takes half as long as one for each channel."""
    n = layout.height * layout.width
    buffer = buffer.view()
    buffer.flags.writeable = False  # else the kernel would be compiled twice, for either kind
    xyz = np.empty((n, 3), np.float32)
    rgb = np.empty((0 if layout.color is None else n, 3), np.uint8)
    x, y, z = (offset for offset, _ in layout.coordinates)
    steps = layout.height, layout.width, layout.row_step, layout.point_step
    read_records(buffer, *steps, (x, y, z), layout.color or (0, 0, 0), xyz, rgb)
    return xyz, None if layout.color is None else rgb


def _coordinates(buffer: npt.NDArray[np.uint8], layout: Layout) -> npt.NDArray[np.float32]:
    xyz = np.empty((layout.height, layout.width, 3), np.float32)
    order = ">" if layout.big_endian else "<"
    with np.errstate(over="ignore", invalid="ignore"):  # float64 beyond float32 becomes inf: an invalid point
        for axis, (offset, datatype) in enumerate(layout.coordinates):
            xyz[..., axis] = _column(buffer, layout, offset, order + ("f8" if datatype == FLOAT64 else "f4"))
    return xyz.reshape(-1, 3)


def _colors(buffer: npt.NDArray[np.uint8], layout: Layout) -> npt.NDArray[np.uint8] | None:
    # Bytes, never floats: a packed color with alpha 255 is a NaN when it is read as a float.
    if layout.color is None:
        return None
    kind = (">" if layout.big_endian else "<") + KINDS[layout.channel]
    rgb = np.empty((layout.height, layout.width, 3), kind)
    for channel, offset in enumerate(layout.color):
        rgb[..., channel] = _column(buffer, layout, offset, kind)
    return as_bytes(rgb.reshape(-1, 3))
