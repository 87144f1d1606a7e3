# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from array import array

import clouds
import numpy as np
import pytest
from clouds import DRIVERS, FLOAT32, FLOAT64, INT32, TYPES, UINT8, XYZ, Driver, header, message, random_points
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from topo_region_seg.cloud.pointcloud2 import CloudFormatError, decode, encode

LIMIT = 10_000


def reason(msg, max_points=LIMIT):
    with pytest.raises(CloudFormatError) as caught:
        decode(msg, max_points=max_points)
    assert "\n" not in str(caught.value)
    return caught.value.reason


def warnings_of(msg):
    codes = []
    cloud = decode(msg, max_points=LIMIT, warn=lambda code, text: codes.append(code))
    return cloud, codes


@pytest.mark.parametrize("name", DRIVERS)
@pytest.mark.parametrize("big_endian", [False, True])
@pytest.mark.parametrize("row_padding", [0, 13])
def test_reads_the_layouts_of_drivers(name, big_endian, row_padding):
    driver = DRIVERS[name]
    xyz, rgb = random_points(12)
    msg = message(xyz, rgb, driver=driver, height=3, big_endian=big_endian, row_padding=row_padding, alpha=255)
    before = msg.data.copy()
    cloud, codes = warnings_of(msg)
    assert codes == []
    np.testing.assert_array_equal(cloud.xyz, xyz)
    assert cloud.xyz.dtype == np.float32 and cloud.xyz.flags.c_contiguous
    assert (cloud.height, cloud.width) == (3, 4)
    if driver.color:
        np.testing.assert_array_equal(cloud.rgb, rgb)
    else:
        assert cloud.rgb is None
    np.testing.assert_array_equal(msg.data, before)


@pytest.mark.parametrize("kind", [bytes, bytearray, lambda data: array("B", data), memoryview, np.asarray])
def test_takes_every_kind_of_buffer(kind):
    xyz, rgb = random_points(5)
    msg = message(xyz, rgb)
    msg.data = kind(msg.data.tobytes()) if kind is not np.asarray else msg.data
    np.testing.assert_array_equal(decode(msg, max_points=LIMIT).xyz, xyz)


def test_data_that_is_no_buffer():
    msg = message(*random_points(5))
    msg.data = "text"
    assert reason(msg) == "bad_data"


def test_color_that_is_nan_as_a_float():
    xyz, _ = random_points(256)
    rgb = np.stack([np.full(256, 200), np.arange(256), np.arange(256)[::-1]], axis=1).astype(np.uint8)
    msg = message(xyz, rgb, alpha=255)
    assert np.isnan(msg.data.view("<f4").reshape(256, -1)[:, 4]).all()
    np.testing.assert_array_equal(decode(msg, max_points=LIMIT).rgb, rgb)


def test_rgb_goes_before_rgba():
    xyz, rgb = random_points(4)
    msg = message(xyz, rgb, driver=Driver([*XYZ, ("rgb", 12, FLOAT32)], 20))
    msg.fields.append(TYPES.PointField(name="rgba", offset=16, datatype=6, count=1))
    np.testing.assert_array_equal(decode(msg, max_points=LIMIT).rgb, rgb)


def test_float64_beyond_float32_becomes_infinite():
    xyz = np.array([[1e300, -1e300, 1.0], [np.nan, np.inf, 2.0]])
    cloud = decode(message(xyz, driver=Driver(DRIVERS["float64"].fields[:3], 24)), max_points=LIMIT)
    np.testing.assert_array_equal(cloud.xyz, np.array([[np.inf, -np.inf, 1.0], [np.nan, np.inf, 2.0]], np.float32))


def test_clouds_too_large_are_refused_at_once():
    msg = message(*random_points(4))
    for width, height in ((0xFFFFFFFF, 0xFFFFFFFF), (2**16, 2**16), (2**31, 2), (LIMIT + 1, 1)):
        msg.width, msg.height = width, height
        assert reason(msg) == "too_many_points"


@pytest.mark.parametrize("point_step", [0, 3, 11, 19])
def test_point_step_smaller_than_the_fields(point_step):
    msg = message(*random_points(4))
    msg.point_step = point_step
    assert reason(msg) == "field_outside_point"


def test_offset_near_the_end_of_32_bits():
    msg = message(*random_points(4))
    msg.fields[2].offset = 2**32 - 2
    assert reason(msg) == "field_outside_point"


def test_data_cut_short():
    msg = message(*random_points(6), height=2)
    msg.data = msg.data[:-1]
    assert reason(msg) == "data_too_short"
    msg.data = msg.data[:0]
    assert reason(msg) == "data_too_short"


def test_data_longer_than_needed():
    xyz, rgb = random_points(6)
    msg = message(xyz, rgb, height=2)
    msg.data = np.append(msg.data, np.zeros(7, np.uint8))
    cloud, codes = warnings_of(msg)
    assert codes == ["data_too_long"]
    np.testing.assert_array_equal(cloud.xyz, xyz)


@pytest.mark.parametrize("row_step", [0, 1, 10_000_000])
def test_stale_row_step_with_packed_data(row_step):
    xyz, rgb = random_points(6)
    msg = message(xyz, rgb, height=2)
    msg.row_step = row_step
    cloud, codes = warnings_of(msg)
    assert codes == ["stale_row_step"]
    np.testing.assert_array_equal(cloud.xyz, xyz)


def test_small_row_step_that_does_not_fit_the_data():
    msg = message(*random_points(6), height=2, row_padding=8)
    msg.row_step = 4
    assert reason(msg) == "row_step_too_small"


def test_last_row_without_padding():
    xyz, rgb = random_points(6)
    msg = message(xyz, rgb, height=2, row_padding=8)
    msg.data = msg.data[:-8]
    cloud, codes = warnings_of(msg)
    assert codes == []
    np.testing.assert_array_equal(cloud.xyz, xyz)


def test_missing_fields():
    msg = message(*random_points(4))
    for fields in ([], msg.fields[1:], msg.fields[3:]):
        msg.fields = fields
        assert reason(msg) == "field_missing"


@pytest.mark.parametrize(("datatype", "code"), [(0, "field_type"), (9, "field_type"), (INT32, "coordinate_type")])
def test_datatype_of_a_coordinate(datatype, code):
    msg = message(*random_points(4))
    msg.fields[1].datatype = datatype
    assert reason(msg) == code


@pytest.mark.parametrize(("datatype", "code"), [(0, "field_type"), (UINT8, "color_type"), (FLOAT64, "color_type")])
def test_datatype_of_the_color(datatype, code):
    msg = message(*random_points(4))
    msg.fields[3].datatype = datatype
    assert reason(msg) == code


def test_count_of_zero():
    msg = message(*random_points(4))
    msg.fields[0].count = 0
    assert reason(msg) == "field_count"


def test_duplicate_and_overlapping_fields():
    msg = message(*random_points(4))
    msg.fields.append(TYPES.PointField(name="x", offset=20, datatype=FLOAT32, count=1))
    assert reason(msg) == "field_duplicate"
    msg = message(*random_points(4))
    msg.fields[1].offset = 2
    assert reason(msg) == "field_overlap"
    msg = message(*random_points(4))
    msg.fields[0].count = 2
    assert reason(msg) == "field_overlap"


def test_fields_that_are_not_needed_may_be_anything():
    xyz, rgb = random_points(4)
    msg = message(xyz, rgb)
    msg.fields += [TYPES.PointField(name="odd", offset=2**32 - 1, datatype=99, count=0)] * 2
    np.testing.assert_array_equal(decode(msg, max_points=LIMIT).xyz, xyz)


class Unread(list):
    """Fields that must be refused for their number, before any is looked at."""

    def __iter__(self):
        raise AssertionError("a message of any number of fields is walked through")


def test_absurd_fields_are_refused():
    msg = message(*random_points(4))
    sound = msg.fields
    msg.fields = Unread(TYPES.PointField(name=f"f{i}", offset=0, datatype=FLOAT32, count=1) for i in range(5000))
    assert reason(msg) == "too_many_fields"
    msg.fields = [*sound, TYPES.PointField(name="big", offset=0, datatype=FLOAT32, count=10**6)]
    assert reason(msg) == "too_many_fields"


@pytest.mark.parametrize(("height", "width"), [(0, 0), (0, 1), (1, 0), (0, 0xFFFFFFFF)])
def test_empty_clouds(height, width):
    msg = message(*random_points(4))
    msg.height, msg.width, msg.data, msg.fields, msg.point_step = height, width, b"", [], 0
    cloud = decode(msg, max_points=LIMIT)
    assert cloud.xyz.shape == cloud.rgb.shape == (0, 3)
    assert (cloud.height, cloud.width) == (height, width)


def test_stamp():
    msg = message(*random_points(4))
    msg.header.stamp.nanosec = 10**9
    assert reason(msg) == "bad_stamp"
    msg.header.stamp = TYPES.Time(sec=0, nanosec=0)
    decode(msg, max_points=LIMIT)


def test_checks_run_under_optimization():
    # `python -O` removes assert statements; none of the checks may be one.
    import inspect

    from topo_region_seg.cloud import layout as cloud_layout
    from topo_region_seg.cloud import pointcloud2

    for module in (cloud_layout, pointcloud2):
        assert "assert " not in inspect.getsource(module)


# --- encoding and back ---

COLUMNS = {
    "u1": np.uint8, "i1": np.int8, "u2": np.uint16, "i2": np.int16,
    "u4": np.uint32, "i4": np.int32, "f4": np.float32, "f8": np.float64,
}  # fmt: skip


@given(
    points=hnp.arrays(np.float32, st.tuples(st.integers(0, 30), st.just(3)), elements=st.floats(width=32)),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=60, deadline=None)
def test_encode_then_decode(points, seed):
    rng = np.random.default_rng(seed)
    n = len(points)
    rgb = rng.integers(0, 256, (n, 3), dtype=np.uint8)
    bits = (rgb[:, 0].astype("<u4") << 16) | (rgb[:, 1].astype("<u4") << 8) | rgb[:, 2]
    columns = {"x": points[:, 0], "y": points[:, 1], "z": points[:, 2], "rgb": bits.view("<f4")}
    msg = encode(TYPES, header(), columns, is_dense=False)
    cloud = decode(msg, max_points=LIMIT)
    np.testing.assert_array_equal(cloud.xyz.view(np.uint32), points.view(np.uint32))
    np.testing.assert_array_equal(cloud.rgb, rgb)
    assert (msg.height, msg.width, msg.point_step, len(msg.data)) == (1, n, 16, 16 * n)


@pytest.mark.parametrize("code", COLUMNS)
def test_encode_every_type(code):
    values = np.arange(6).astype(COLUMNS[code])
    msg = encode(TYPES, header(), {"pad": np.zeros(6, np.uint8), "value": values}, height=2, is_dense=True)
    field = msg.fields[1]
    assert (field.offset, clouds.NUMPY[field.datatype], field.count) == (1, code, 1)
    assert (msg.height, msg.width, msg.row_step, msg.is_dense) == (2, 3, 3 * msg.point_step, True)
    rows = np.asarray(msg.data).reshape(6, msg.point_step)[:, 1:]
    np.testing.assert_array_equal(np.ascontiguousarray(rows).view("<" + code)[:, 0], values)


def test_encode_refuses_contradictions():
    with pytest.raises(ValueError, match="different lengths"):
        encode(TYPES, header(), {"x": np.zeros(2), "y": np.zeros(3)}, is_dense=True)
    with pytest.raises(ValueError, match="cannot be organized as 2 x 2"):
        encode(TYPES, header(), {"x": np.zeros(5)}, height=2, width=2, is_dense=True)


def test_rclpy_messages_go_both_ways(ros_domain):
    pytest.importorskip("rclpy", reason="rclpy cannot be imported")
    from rclpy.serialization import deserialize_message, serialize_message

    from topo_region_seg.ros.types import ros_types

    types = ros_types()
    xyz, rgb = random_points(640 * 480)
    bits = (rgb[:, 0].astype("<u4") << 16) | (rgb[:, 1].astype("<u4") << 8) | rgb[:, 2]
    columns = {"x": xyz[:, 0], "y": xyz[:, 1], "z": xyz[:, 2], "rgb": bits.view("<f4")}
    msg = encode(types, types.Header(), columns, height=480, is_dense=True)
    assert isinstance(msg.data, array)  # rclpy takes anything else element by element
    back = deserialize_message(serialize_message(msg), types.PointCloud2)
    cloud = decode(back, max_points=10**6)
    np.testing.assert_array_equal(cloud.xyz, xyz)
    np.testing.assert_array_equal(cloud.rgb, rgb)
    empty = encode(types, types.Header(), {"x": xyz[:0, 0]}, is_dense=True)
    assert len(empty.data) == 0
