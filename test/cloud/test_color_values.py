# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Colors of other types than bytes come out as the bytes that they were made of."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import clouds
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from topo_region_seg.cloud.color_values import as_bytes
from topo_region_seg.cloud.layout import CloudFormatError
from topo_region_seg.cloud.pointcloud2 import DATATYPES, decode
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

Bytes = npt.NDArray[np.uint8]
COLORS = arrays(np.uint8, st.tuples(st.integers(0, 20), st.just(3)))
SPELLINGS: dict[str, Any] = {
    "shares of 1 as float32": lambda c: (c / 255.0).astype(np.float32),
    "shares of 1 as float64": lambda c: c / 255.0,
    "big-endian shares": lambda c: (c / 255.0).astype(">f4"),
    "16 bits, repeated": lambda c: c.astype(np.uint16) * 257,
    "16 bits, shifted": lambda c: c.astype(np.uint16) << 8,
    "bytes": lambda c: c,
    "bytes as int32": lambda c: c.astype(np.int32),
    "bytes as float32": lambda c: c.astype(np.float32),
}


@pytest.mark.parametrize("spelling", SPELLINGS)
@given(colors=COLORS)
def test_every_spelling_gives_the_bytes_back(spelling: str, colors: Bytes) -> None:
    # One bright point tells floats to 255 and 16 bits from shares and bytes, as nearly every cloud has one.
    colors = np.vstack([colors, np.full((1, 3), 255, np.uint8)])
    made = as_bytes(SPELLINGS[spelling](colors))
    assert made.dtype == np.uint8
    np.testing.assert_array_equal(made, colors)


def test_what_is_no_color_is_black_and_spoils_no_other() -> None:
    values = np.array([[0.2, np.nan, 1.0], [np.inf, -np.inf, 0.0], [-0.1, 1.003, 0.4]], np.float32)
    np.testing.assert_array_equal(as_bytes(values), [[51, 0, 255], [0, 0, 0], [0, 255, 102]])
    np.testing.assert_array_equal(as_bytes(np.array([[-5, 300 * 256, 256]], np.int32)), [[0, 255, 1]])
    assert as_bytes(np.empty((0, 3), np.float32)).shape == (0, 3)


def channel_message(kind: str, names: str = "rgb", big_endian: bool = False) -> tuple[Any, Bytes]:
    """Return the scene with one field for each channel, of a type, unaligned, and its colors as bytes."""
    xyz, rgb = clouds.scene()
    order = ">" if big_endian else "<"
    spelled = ["red", "green", "blue"] if names == "words" else list(names)
    record = np.dtype([(axis, order + "f4") for axis in "xyz"] + [("odd", "u1")] + [(n, order + kind) for n in spelled])
    table = np.zeros(len(xyz), record)
    for axis, name in enumerate("xyz"):
        table[name] = xyz[:, axis]
    scale = {"f": 1 / 255, "u": 257 if kind == "u2" else 1}[kind[0]]
    for channel, name in enumerate(spelled):
        table[name] = rgb[:, channel].astype(np.float64) * scale
    msg = clouds.message(xyz, rgb, height=48)
    msg.fields = [
        SimpleNamespace(name=name, offset=record.fields[name][1], datatype=DATATYPES[record[name].str[1:]], count=1)
        for name in record.names or ()
    ]
    msg.is_bigendian, msg.point_step = big_endian, record.itemsize
    msg.row_step, msg.data = record.itemsize * 64, np.frombuffer(table.tobytes(), np.uint8)
    return msg, rgb


@pytest.mark.parametrize("big_endian", [False, True])
@pytest.mark.parametrize("names", ["rgb", "words"])
@pytest.mark.parametrize("kind", ["u1", "u2", "f4", "f8"])
def test_clouds_with_a_field_for_each_channel(kind: str, names: str, big_endian: bool) -> None:
    msg, rgb = channel_message(kind, names, big_endian)
    cloud = decode(msg, max_points=10**6)
    assert cloud.rgb is not None
    np.testing.assert_array_equal(cloud.rgb, rgb)
    np.testing.assert_array_equal(cloud.xyz, clouds.scene()[0])


DAMAGES: dict[str, tuple[dict[str, Any], str]] = {
    "an unknown type": ({"datatype": 9}, "field_type"),
    "signed bytes": ({"datatype": 1}, "color_type"),
    "another type than the others": ({"datatype": 4}, "color_type"),
    "no size": ({"count": 0}, "field_count"),
    "outside of the point": ({"offset": 10_000}, "field_outside_point"),
    "over a coordinate": ({"offset": 2}, "field_overlap"),
    "twice": ({"name": "g"}, "field_duplicate"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_colors_that_cannot_be_read_are_no_reason_to_refuse_what_needs_none(damage: str) -> None:
    changes, reason = DAMAGES[damage]
    msg, _ = channel_message("f4")
    if damage == "twice":
        msg.fields.append(SimpleNamespace(**{**vars(msg.fields[-1]), **changes}))
    else:
        vars(msg.fields[-1]).update(changes)
    with pytest.raises(CloudFormatError) as caught:
        decode(msg, max_points=10**6)
    assert caught.value.reason == reason
    said: list[tuple[str, str]] = []
    cloud = decode(msg, max_points=10**6, warn=lambda code, text: said.append((code, text)), needs_color=False)
    assert cloud.rgb is None
    assert [code for code, _ in said] == ["color_unreadable"] and caught.value.detail in said[0][1]
    params = Params(features="normals", voxel_size=0.0)
    whole = decode(channel_message("f4")[0], max_points=10**6)
    np.testing.assert_array_equal(Pipeline(params).run(cloud).labels, Pipeline(params).run(whole).labels)


def test_damage_elsewhere_is_a_reason_for_both() -> None:
    for needs_color in (True, False):
        msg, _ = channel_message("f4")
        msg.fields[0].datatype = 3
        with pytest.raises(CloudFormatError) as caught:
            decode(msg, max_points=10**6, needs_color=needs_color)
        assert caught.value.reason == "coordinate_type"
