# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth images become the clouds that depth_image_proc makes of them, to the last bit, and nothing else."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from clouds import DRIVERS, message
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from images import (
    CHANNELS,
    camera_info,
    cloud_of_depth_image_proc,
    color_image,
    compressed,
    depth_image,
    image,
    packed_depth,
)

from topo_region_seg.cloud.camera_info import camera_of, info_size, is_rectified
from topo_region_seg.cloud.depth_image import decode_depth
from topo_region_seg.cloud.layout import CloudFormatError
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.data import Cloud
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

SIZES = st.tuples(st.integers(1, 9), st.integers(1, 9))
MANY = 10_000
MILLIMETRES = st.integers(0, 65535)
METRES = st.floats(width=32, allow_nan=True, allow_infinity=True)


def refused(*args: Any, **kwargs: Any) -> CloudFormatError:
    with pytest.raises(CloudFormatError) as caught:
        decode_depth(*args, **{"max_points": MANY, **kwargs})
    assert "\n" not in str(caught.value)
    return caught.value


def same_bits(ours: np.ndarray, theirs: np.ndarray) -> None:
    assert ours.dtype == theirs.dtype == np.float32 and ours.shape == theirs.shape
    nan = np.isnan(theirs)
    np.testing.assert_array_equal(np.isnan(ours), nan)
    np.testing.assert_array_equal(ours[~nan].view(np.uint32), theirs[~nan].view(np.uint32))


@given(data=st.data(), size=SIZES, encoding=st.sampled_from(["16UC1", "mono16", "32FC1"]))
@settings(max_examples=300, deadline=None)
def test_points_are_those_of_depth_image_proc(data: st.DataObject, size: tuple[int, int], encoding: str) -> None:
    floats = encoding == "32FC1"
    kind = np.float32 if floats else np.uint16
    depth = data.draw(hnp.arrays(kind, size, elements=METRES if floats else MILLIMETRES))
    binning = data.draw(st.tuples(st.integers(0, 3), st.integers(0, 3)))
    offset = data.draw(st.tuples(st.integers(0, 50), st.integers(0, 50)))
    across, down = max(1, binning[0]), max(1, binning[1])
    roi = (*offset, size[1] * across, size[0] * down)
    number = st.floats(1.0, 2000.0)
    info = camera_info(
        480, 640, fx=data.draw(number), fy=data.draw(number), cx=data.draw(number), cy=data.draw(number),
        binning=binning, roi=roi,
    )  # fmt: skip
    msg = depth_image(depth, encoding, big_endian=data.draw(st.booleans()), padding=data.draw(st.integers(0, 7)))
    before = repr(msg)
    with np.errstate(all="ignore"):
        expected = cloud_of_depth_image_proc(depth, info)
    cloud = decode_depth(msg, info, max_points=MANY)
    assert (cloud.height, cloud.width) == size and cloud.rgb is None
    same_bits(cloud.xyz, expected)
    assert repr(msg) == before, "the message was modified"


def test_a_point_computed_by_hand() -> None:
    depth = np.zeros((2, 3), np.uint16)
    depth[1, 2] = 2000
    info = camera_info(2, 3, fx=500.0, fy=250.0, cx=1.0, cy=0.5)
    xyz = decode_depth(depth_image(depth), info, max_points=6).xyz
    np.testing.assert_allclose(xyz[5], [1.0 / 500.0 * 2.0, 0.5 / 250.0 * 2.0, 2.0], rtol=1e-6)
    assert np.isnan(xyz[:5]).all()


@pytest.mark.parametrize("value", [0.0, -0.0, -1.0, np.nan, np.inf, -np.inf])
def test_what_is_no_depth_becomes_an_invalid_point(value: float) -> None:
    depth = np.full((2, 2), 1.0, np.float32)
    depth[0, 1] = value
    xyz = decode_depth(depth_image(depth, "32FC1"), camera_info(2, 2), max_points=4).xyz
    assert np.isnan(xyz[1]).all() and np.isfinite(xyz[[0, 2, 3]]).all()


def test_rows_of_a_wide_image_are_shared_by_threads_without_a_gap() -> None:
    depth = np.random.default_rng(1).integers(0, 5000, (61, 173)).astype(np.uint16)
    info = camera_info(61, 173)
    same_bits(
        decode_depth(depth_image(depth, padding=6), info, max_points=10**6).xyz, cloud_of_depth_image_proc(depth, info)
    )


@pytest.fixture(scope="module")
def scene() -> tuple[np.ndarray, np.ndarray, Any]:
    """Depth in millimetres, colors and camera_info of a simulated tabletop."""
    camera = Camera.kinect(160, 120)
    frame = simulate(tabletop(seed=3), camera, seed=3)
    depth = np.nan_to_num(frame.cloud.xyz[:, 2] * 1000.0).round().astype(np.uint16).reshape(120, 160)
    assert frame.cloud.rgb is not None
    info = camera_info(120, 160, fx=camera.fx, fy=camera.fy, cx=camera.cx, cy=camera.cy)
    return depth, frame.cloud.rgb.reshape(120, 160, 3), info


@pytest.mark.parametrize(
    "params",
    [Params(), Params(output="objects"), Params(output="supervoxels"), Params(max_radius="auto")],
    ids=lambda params: f"{params.output} {params.max_radius}",
)
@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
def test_labels_are_those_of_the_cloud_of_depth_image_proc(scene: Any, params: Params, encoding: str) -> None:
    depth, rgb, info = scene
    given = depth if encoding == "16UC1" else (depth * np.float32(0.001)).astype(np.float32)
    xyz = cloud_of_depth_image_proc(given, info)
    cloud = message(xyz, rgb.reshape(-1, 3), driver=DRIVERS["depth_image_proc"], height=120)
    theirs = Pipeline(params).run(decode(cloud, max_points=10**6), lambda *_: None)
    ours = decode_depth(depth_image(given, encoding), info, color_image(rgb, "bgr8"), max_points=10**6)
    mine = Pipeline(params).run(ours, lambda *_: None)
    assert theirs.labels.any()
    np.testing.assert_array_equal(mine.labels, theirs.labels)


@pytest.mark.parametrize("encoding", list(CHANNELS))
@pytest.mark.parametrize("padding", [0, 5])
def test_colors_of_every_order(encoding: str, padding: int) -> None:
    rgb = np.random.default_rng(0).integers(0, 256, (4, 5, 3)).astype(np.uint8)
    color = color_image(rgb, encoding, padding=padding)
    cloud = decode_depth(depth_image(np.ones((4, 5))), camera_info(4, 5), color, max_points=20)
    assert cloud.rgb is not None
    expected = rgb if encoding != "mono8" else np.repeat(rgb[..., :1], 3, axis=2)
    np.testing.assert_array_equal(cloud.rgb, expected.reshape(-1, 3))


@pytest.mark.parametrize("big_endian", [False, True])
@pytest.mark.parametrize(("encoding", "channels"), [("rgb16", 3), ("bgra16", 4), ("mono16", 1)])
def test_colors_of_16_bits_give_their_upper_byte(encoding: str, channels: int, big_endian: bool) -> None:
    wide = np.random.default_rng(0).integers(0, 65536, (3, 4, channels)).astype(np.uint16)
    color = image(wide, encoding, big_endian=big_endian)
    cloud = decode_depth(depth_image(np.ones((3, 4))), camera_info(3, 4), color, max_points=20)
    order = {"rgb16": (0, 1, 2), "bgra16": (2, 1, 0), "mono16": (0, 0, 0)}[encoding]
    assert cloud.rgb is not None
    np.testing.assert_array_equal(cloud.rgb, (wide >> 8)[..., order].reshape(-1, 3))


def test_a_color_image_of_another_size_is_refused_with_what_to_do() -> None:
    given = depth_image(np.ones((4, 5))), camera_info(4, 5), color_image(np.zeros((4, 6, 3)))
    error = refused(*given)
    assert error.reason == "color_size" and "registered (aligned)" in error.detail
    notes: list[str] = []
    cloud = decode_depth(*given, max_points=20, needs_color=False, warn=lambda code, _: notes.append(code))
    assert cloud.rgb is None and notes == ["color_unreadable"]


def test_color_of_another_frame_is_taken_and_said() -> None:
    depth, color = depth_image(np.ones((4, 5))), color_image(np.full((4, 5, 3), 7))
    notes: list[tuple[str, str]] = []
    for frame_id in ("/camera", "eye"):
        color.header = replace(color.header, frame_id=frame_id)
        cloud = decode_depth(depth, camera_info(4, 5), color, max_points=20, warn=lambda *note: notes.append(note))
        assert cloud.rgb is not None and (cloud.rgb == 7).all()
    ((code, text),) = notes
    assert code == "color_frame" and "'camera', color images in 'eye'" in text


def test_what_contradicts_itself_is_refused() -> None:
    good, info = depth_image(np.ones((4, 5))), camera_info(4, 5)
    for changes, reason in (
        ({"encoding": "rgb8"}, "depth_encoding"),
        ({"encoding": "64FC1"}, "depth_encoding"),
        ({"step": 9, "data": np.zeros(41, np.uint8)}, "step_too_small"),
        ({"data": good.data[:-1]}, "data_too_short"),
        ({"height": 5}, "data_too_short"),
        ({"height": 2**31, "width": 2**31}, "too_many_points"),
        ({"data": object()}, "bad_data"),
    ):
        msg = depth_image(np.ones((4, 5)))
        for name, value in changes.items():
            setattr(msg, name, value)
        assert refused(msg, info).reason == reason, changes
    bad_time = depth_image(np.ones((4, 5)), nanosec=10**9)
    assert refused(bad_time, info).reason == "bad_stamp"
    assert refused(good, info, color_image(np.ones((4, 5, 3)), nanosec=10**9)).reason == "bad_stamp"
    yuv = color_image(np.ones((4, 5, 3)))
    yuv.encoding = "yuv422_yuy2"
    assert refused(good, info, yuv).reason == "color_encoding"


def test_odd_but_readable_images_are_read_and_said() -> None:
    notes: list[str] = []
    depth = np.arange(20).reshape(4, 5)
    expected = decode_depth(depth_image(depth), camera_info(4, 5), max_points=20).xyz
    stale = depth_image(depth)
    stale.step = 0
    longer = depth_image(depth)
    longer.data = np.append(longer.data, np.zeros(3, np.uint8))
    for msg in (stale, longer):
        cloud = decode_depth(msg, camera_info(4, 5), max_points=20, warn=lambda code, _: notes.append(code))
        same_bits(cloud.xyz, expected)
    assert notes == ["stale_step", "data_too_long"]


@pytest.mark.parametrize("size", [(0, 5), (4, 0), (0, 0)])
def test_an_image_without_pixels_is_an_empty_cloud(size: tuple[int, int]) -> None:
    cloud = decode_depth(depth_image(np.ones(size)), camera_info(0, 0), max_points=20)
    assert len(cloud) == 0 and (cloud.height, cloud.width) == size


def test_camera_info_that_does_not_fit_is_refused() -> None:
    depth = depth_image(np.ones((4, 5)))
    for info, reason in (
        (camera_info(8, 10), "camera_info_size"),
        (camera_info(8, 10, binning=(2, 1)), "camera_info_size"),
        (camera_info(4, 5, fx=0.0), "camera_info_uncalibrated"),
        (camera_info(4, 5, fx=np.nan), "camera_info_uncalibrated"),
        (camera_info(4, 5, cx=np.inf), "camera_info_uncalibrated"),
        (camera_info(4, 5, fy=-500.0), "camera_info_uncalibrated"),
        (camera_info(4, 5, p=(1.0,)), "camera_info_uncalibrated"),
        (camera_info(4, 5, d=(0.1,) * 4, model="equidistant"), "camera_info_distortion"),
        (camera_info(4, 5, d=(0.1,) * 9, model="rational_polynomial"), "camera_info_distortion"),
        (camera_info(4, 5, d=(np.nan,) * 5), "camera_info_distortion"),
    ):
        assert refused(depth, info).reason == reason
    assert decode_depth(depth, camera_info(8, 10, binning=(2, 2)), max_points=20).height == 4
    assert decode_depth(depth, camera_info(0, 0), max_points=20).height == 4, "a size of 0 says nothing"
    fisheye = camera_info(4, 5, d=(0.1,) * 4, model="equidistant")
    assert decode_depth(depth, fisheye, rectified=True, max_points=20).height == 4


def test_k_stands_in_where_there_is_no_projection_matrix() -> None:
    depth = depth_image(np.ones((4, 5)))
    given = camera_info(4, 5, p=(0.0,) * 12)
    same_bits(decode_depth(depth, given, max_points=20).xyz, decode_depth(depth, camera_info(4, 5), max_points=20).xyz)


def test_p_is_used_where_it_is_not_k() -> None:
    """As for a rectified image of a camera that has a distortion."""
    p = (400.0, 0.0, 2.5, 0.0, 0.0, 410.0, 1.5, 0.0, 0.0, 0.0, 1.0, 0.0)
    info = camera_info(4, 5, d=(0.1, 0.0, 0.0, 0.0, 0.0), p=p)
    depth = np.full((4, 5), 1000, np.uint16)
    cloud = decode_depth(depth_image(depth), info, rectified=True, max_points=20)
    same_bits(cloud.xyz, cloud_of_depth_image_proc(depth, info))


@pytest.mark.parametrize(
    ("topic", "rectified"),
    [
        ("/camera/depth/image_rect_raw", True),
        ("/camera/depth/image_rect", True),
        ("/depth/image_rectified", True),
        ("/camera/aligned_depth_to_color/image_raw", False),
        ("/direct/depth/image", False),
        ("/depth/image", False),
    ],
)
def test_the_name_of_a_topic_says_whether_its_images_are_rectified(topic: str, rectified: bool) -> None:
    assert is_rectified(topic) == rectified


def imaged_by_opencv(x: np.ndarray, y: np.ndarray, d: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """OpenCV's documentation, written down term by term."""
    k1, k2, p1, p2, k3, k4, k5, k6 = [*d, *[0.0] * 8][:8]
    r2 = x**2 + y**2
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    return (
        x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2),
        y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y,
    )


LENSES = {
    "none to speak of": ("plumb_bob", (1e-6, 0.0, 0.0, 0.0, 0.0)),
    "color camera of a realsense D455": ("plumb_bob", (-0.0558, 0.0674, 0.0003, 0.0005, -0.0217)),
    "a wide webcam": ("plumb_bob", (-0.31, 0.11, 0.001, -0.0007, -0.018)),
    "Azure Kinect depth": (
        "rational_polynomial",
        (5.2, 3.4, -1e-5, -9e-5, 0.17, 5.5, 5.1, 0.92),
    ),
}


@pytest.mark.parametrize("name", LENSES)
def test_rays_of_an_image_that_is_not_rectified_lead_back_to_their_pixels(name: str) -> None:
    model, d = LENSES[name]
    fx = fy = 120.0
    info = camera_info(96, 128, fx=fx, fy=fy, cx=63.0, cy=47.5, d=d, model=model)
    depth = np.full((96, 128), 2.0, np.float32)
    notes: list[str] = []
    cloud = decode_depth(
        depth_image(depth, "32FC1"), info, max_points=MANY * 2, warn=lambda code, _: notes.append(code)
    )
    assert notes == ["depth_not_rectified"]
    x, y, z = cloud.xyz.astype(np.float64).T
    np.testing.assert_array_equal(z, 2.0)
    image_x, image_y = imaged_by_opencv(x / z, y / z, d)
    v, u = np.mgrid[:96, :128].reshape(2, -1)
    np.testing.assert_allclose(fx * image_x + 63.0, u, atol=1e-3)
    np.testing.assert_allclose(fy * image_y + 47.5, v, atol=1e-3)


def test_a_lens_that_images_two_rays_at_a_pixel_or_none_gives_no_points_there() -> None:
    """Beyond where the polynomial turns back there is no ray."""
    info = camera_info(64, 64, fx=20.0, fy=20.0, cx=31.5, cy=31.5, d=(-0.5, 0.0, 0.0, 0.0, 0.0))
    cloud = decode_depth(depth_image(np.ones((64, 64)), "32FC1"), info, max_points=MANY)
    xyz = cloud.xyz.reshape(64, 64, 3)
    assert np.isnan(xyz[0, 0]).all() and np.isfinite(xyz[30:33, 30:33]).all()


def test_binning_and_region_of_interest_shift_the_distorted_image_too() -> None:
    lens = {"d": (-0.1, 0.02, 0.0, 0.0, 0.0), "fx": 60.0, "fy": 60.0, "cx": 31.0, "cy": 23.0}
    whole = decode_depth(depth_image(np.ones((48, 64)), "32FC1"), camera_info(48, 64, **lens), max_points=MANY)
    part = camera_info(48, 64, roi=(10, 4, 32, 16), **lens)
    assert info_size(part) == (16, 32)
    cut = decode_depth(depth_image(np.ones((16, 32)), "32FC1"), part, max_points=MANY)
    np.testing.assert_allclose(
        cut.xyz.reshape(16, 32, 3), whole.xyz.reshape(48, 64, 3)[4:20, 10:42], rtol=1e-6, atol=1e-7
    )
    camera = camera_of(camera_info(48, 64, binning=(2, 4), **lens), 12, 32, rectified=False)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (30.0, 15.0, 15.5, 5.75)


def test_a_compressed_depth_image_gives_the_points_of_the_raw_one() -> None:
    depth = np.random.default_rng(2).integers(0, 65536, (6, 7)).astype(np.uint16)
    info = camera_info(6, 7)
    raw = decode_depth(depth_image(depth), info, max_points=42)
    same_bits(decode_depth(packed_depth(depth), info, max_points=42).xyz, raw.xyz)


def test_quantized_depth_is_as_exact_as_its_quanta() -> None:
    depth = np.linspace(0.3, 9.0, 42).reshape(6, 7).astype(np.float32)
    depth[0, 0] = np.nan
    cloud = decode_depth(packed_depth(depth, quantum=100.0), camera_info(6, 7), max_points=42)
    z = cloud.xyz[:, 2]
    assert np.isnan(z[0])
    # A step of one of the packed number is depth^2 / (quantum (quantum + 1)).
    assert (np.abs(z[1:] - depth.ravel()[1:]) <= 1.01 * depth.ravel()[1:] ** 2 / (100.0 * 101.0)).all()


def test_compressed_color() -> None:
    import io

    from PIL import Image

    rgb = np.zeros((16, 16, 3), np.uint8)
    rgb[:, 8:] = (200, 100, 50)
    for form, name, tolerance in (("PNG", "png", 0), ("JPEG", "jpeg", 6)):
        file = io.BytesIO()
        Image.fromarray(rgb).save(file, form, **({"quality": 95} if form == "JPEG" else {}))
        color = compressed(file.getvalue(), f"rgb8; {name} compressed bgr8")
        cloud = decode_depth(depth_image(np.ones((16, 16))), camera_info(16, 16), color, max_points=256)
        assert cloud.rgb is not None
        off = np.abs(cloud.rgb.astype(int) - rgb.reshape(-1, 3).astype(int)).reshape(16, 16, 3)
        assert off[:, :7].max() <= tolerance and off[:, 9:].max() <= tolerance


def test_damaged_and_foreign_compressed_images_are_refused() -> None:
    info, depth = camera_info(40, 50), np.random.default_rng(2).integers(0, 65536, (40, 50))
    whole = packed_depth(depth)
    raw = bytes(whole.data)
    for data, form, reason in (
        (raw[:12], whole.format, "data_too_short"),
        (raw[:-400], whole.format, "undecodable_image"),
        (raw[:12] + b"no picture", whole.format, "undecodable_image"),
        (raw, "16UC1; compressedDepth rvl", "depth_encoding"),
        (raw, "bgr8; jpeg compressed bgr8", "depth_encoding"),
    ):
        assert refused(compressed(data, form), info).reason == reason
    assert refused(whole, info, max_points=1999).reason == "too_many_points"
    assert refused(depth_image(depth), info, compressed(b"", "jpeg")).reason == "undecodable_image"
    small = packed_depth(np.ones((4, 5)))
    assert refused(small, info).reason == "camera_info_size"


def test_without_pillow_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    packed = packed_depth(np.ones((4, 5)))
    monkeypatch.setitem(sys.modules, "PIL", None)
    error = refused(packed, camera_info(4, 5))
    assert error.reason == "missing_pillow" and "apt install python3-pil" in error.detail


EDGES = st.one_of(st.integers(0, 9), st.sampled_from([255, 65535, 2**31 - 1, 2**31, 2**32 - 1]))
NUMBERS = st.floats(allow_nan=True, allow_infinity=True)


@given(data=st.data())
@settings(max_examples=500, deadline=None)
def test_arbitrary_claims_give_a_cloud_or_the_one_error(data: st.DataObject) -> None:
    draw = data.draw
    depth = depth_image(np.ones((4, 5)), draw(st.sampled_from(["16UC1", "32FC1"])))
    color = color_image(np.ones((4, 5, 3)), draw(st.sampled_from(list(CHANNELS))))
    info = camera_info(4, 5)
    for msg, names in (
        (depth, ("height", "width", "step", "is_bigendian")),
        (color, ("height", "width", "step", "is_bigendian")),
        (info, ("height", "width", "binning_x", "binning_y")),
        (info.roi, ("height", "width", "x_offset", "y_offset")),
    ):
        for name in draw(st.lists(st.sampled_from(names), max_size=2)):
            setattr(msg, name, draw(EDGES))
    if draw(st.booleans()):
        depth.data = np.frombuffer(draw(st.binary(max_size=200)), np.uint8)
    if draw(st.booleans()):
        color.encoding = draw(st.text(max_size=10))
    if draw(st.booleans()):
        info.d = np.array(draw(st.lists(NUMBERS, max_size=14)))
        info.distortion_model = draw(st.sampled_from(["", "plumb_bob", "rational_polynomial", "x"]))
        info.k = np.array(draw(st.lists(NUMBERS, min_size=9, max_size=9)))
    try:
        with np.errstate(all="ignore"):
            cloud = decode_depth(depth, info, color, max_points=MANY, rectified=draw(st.booleans()))
    except CloudFormatError as error:
        assert error.reason.isidentifier() and "\n" not in str(error)
        return
    assert isinstance(cloud, Cloud)
    assert cloud.xyz.shape == (depth.height * depth.width, 3) and cloud.xyz.dtype == np.float32


@given(data=st.binary(max_size=300), form=st.sampled_from(["16UC1; compressedDepth png", "32FC1; compressedDepth"]))
@settings(max_examples=200, deadline=None)
def test_arbitrary_compressed_bytes_give_a_cloud_or_the_one_error(data: bytes, form: str) -> None:
    start = bytes(packed_depth(np.ones((4, 5))).data)
    for given_bytes in (data, start[: len(data)] + data):
        try:
            decode_depth(compressed(given_bytes, form), camera_info(0, 0), max_points=MANY)
        except CloudFormatError as error:
            assert "\n" not in str(error)
