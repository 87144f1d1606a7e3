# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""PointCloud2 messages out of arbitrary choices, and what must hold when they are decoded; for every fuzzer."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from topo_region_seg.cloud.pointcloud2 import CloudFormatError, decode

NAMES = ("x", "y", "z", "rgb", "rgba", "r", "g", "b", "intensity", "", "label", "xyz")
EDGES = (0, 1, 2, 3, 4, 7, 8, 12, 16, 20, 32, 255, 65535, 2**31 - 1, 2**31, 2**32 - 4, 2**32 - 1)
"""Numbers at which sizes and offsets go wrong."""
MAX_POINTS = 5_000
SECONDS = 0.5
"""Far more than any of these messages needs; an honest one takes less than a millisecond."""
BYTES_PER_POINT = 15
"""x, y, z as float32 and three bytes of color."""

Number = Callable[[int, int], int]
"""Chooses a whole number between two bounds, both included."""


def make_message(number: Number, data: Callable[[int], bytes]) -> Any:
    """Return a message whose every claim is chosen; half of them begin as an honest one."""
    honest = number(0, 1) == 1
    height, width = (number(0, 6), number(0, 40)) if honest or number(0, 3) else (_size(number), _size(number))
    fields, step = _honest_fields(number) if honest else _wild_fields(number)
    row_step = width * step
    size = height * row_step
    if number(0, 2) == 0:
        row_step = _size(number)
    if number(0, 2) == 0:
        size += number(-64, 64)
    if number(0, 4) == 0:
        step = _size(number)
    if fields and number(0, 2) == 0:
        damaged = fields[number(0, len(fields) - 1)]
        attribute = ("name", "offset", "datatype", "count")[number(0, 3)]
        setattr(damaged, attribute, NAMES[number(0, len(NAMES) - 1)] if attribute == "name" else _size(number))
    return SimpleNamespace(
        header=SimpleNamespace(
            stamp=SimpleNamespace(sec=number(-(2**31), 2**31 - 1), nanosec=number(0, 2 * 10**9)), frame_id=""
        ),
        height=height,
        width=width,
        fields=fields,
        is_bigendian=bool(number(0, 1)),
        point_step=step,
        row_step=row_step,
        data=data(min(max(size, 0), 20_000)),
        is_dense=bool(number(0, 1)),
    )


def decode_keeps_its_promise(msg: Any) -> bool:
    """Decode `msg`; return whether it was accepted. Fails if anything but a cloud or the one error comes out."""
    before = repr(msg)
    started = time.process_time()
    try:
        cloud = decode(msg, max_points=MAX_POINTS, warn=_check_warning)
    except CloudFormatError as error:
        if not error.reason.isidentifier() or "\n" in str(error):
            raise AssertionError(f"a reason that is no code, or several lines: {error!r}") from error
        accepted = False
    else:
        accepted = True
        n = int(msg.height) * int(msg.width)
        if cloud.xyz.shape != (n, 3) or cloud.xyz.dtype != np.float32:
            raise AssertionError(f"{n} points became {cloud.xyz.dtype} {cloud.xyz.shape}")
        if cloud.rgb is not None and (cloud.rgb.shape != (n, 3) or cloud.rgb.dtype != np.uint8):
            raise AssertionError(f"{n} colors became {cloud.rgb.dtype} {cloud.rgb.shape}")
        held = cloud.xyz.nbytes + (0 if cloud.rgb is None else cloud.rgb.nbytes)
        if held > BYTES_PER_POINT * MAX_POINTS:
            raise AssertionError(f"{held} bytes")
    if (took := time.process_time() - started) > SECONDS:
        raise AssertionError(f"{took:.2f} s of processor time for {msg.width} x {msg.height} points")
    if repr(msg) != before:
        raise AssertionError("the message was modified")
    return accepted


def _check_warning(code: str, text: str) -> None:
    if not code.isidentifier() or "\n" in text:
        raise AssertionError(f"a warning that is no code, or several lines: {code!r}: {text!r}")


def _size(number: Number) -> int:
    return EDGES[number(0, len(EDGES) - 1)] if number(0, 1) else number(0, 64)


def _field(name: str, offset: int, datatype: int, count: int = 1) -> SimpleNamespace:
    return SimpleNamespace(name=name, offset=offset, datatype=datatype, count=count)


def _honest_fields(number: Number) -> tuple[list[SimpleNamespace], int]:
    datatype, size = ((7, 4), (8, 8))[number(0, 1)]
    names: Sequence[str] = ("x", "y", "z")
    fields = [_field(name, i * size, datatype) for i, name in enumerate(names)]
    end = 3 * size
    color = number(0, 3)
    if color in (1, 2):
        fields.append(_field(("rgb", "rgba")[color - 1], end, number(5, 7)))
        end += 4
    elif color == 3:
        fields += [_field(name, end + i, 2) for i, name in enumerate("rgb")]
        end += 3
    return fields, end + number(0, 12)


def _wild_fields(number: Number) -> tuple[list[SimpleNamespace], int]:
    fields = [
        _field(NAMES[number(0, len(NAMES) - 1)], _size(number), number(0, 10), number(0, 2))
        for _ in range(number(0, 8))
    ]
    if number(0, 40) == 0:
        fields *= 2_000
    return fields, _size(number)
