# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""PCD and PLY files as other programs write them: the same points, colors and order, whatever the spelling."""

from __future__ import annotations

import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
from cloud_file_maker import PcdKind, PlyKind, make_pcd, make_ply, pcd_kinds, ply_kinds
from clouds import scene
from plyfile import PlyData
from pypcd4 import PointCloud

from topo_region_seg.cloud.files import CloudFileError, read_cloud, write_labeled_cloud
from topo_region_seg.data import Cloud

HEIGHT = 6
XYZ, RGB = scene(8, HEIGHT)
XYZ = XYZ + np.float32(1 / 3)  # digits that text has to carry
XYZ[5] = np.nan
RGB = np.random.default_rng(0).integers(0, 256, RGB.shape, dtype=np.uint8)


def read(path: Path, content: bytes, **options: object) -> tuple[Cloud, list[str]]:
    path.write_bytes(content)
    said: list[str] = []
    return read_cloud(path, max_points=10**6, warn=lambda code, text: said.append(f"{code}: {text}"), **options), said


def check(cloud: Cloud, said: list[str], coordinates: str, color: str) -> None:
    assert said == []
    assert cloud.xyz.dtype == np.dtype(coordinates) and cloud.xyz.flags.c_contiguous
    np.testing.assert_array_equal(cloud.xyz, XYZ)
    if color == "none":
        assert cloud.rgb is None
    else:
        np.testing.assert_array_equal(cloud.rgb, RGB)


@pytest.mark.parametrize("kind", pcd_kinds(), ids=lambda kind: kind.name)
def test_pcd_files(kind: PcdKind, tmp_path: Path) -> None:
    cloud, said = read(tmp_path / "a.pcd", make_pcd(XYZ, RGB, HEIGHT, kind))
    check(cloud, said, kind.coordinates, kind.color)
    assert (cloud.height, cloud.width) == ((HEIGHT, 8) if kind.organized else (1, 48))
    assert cloud.sensor_pose is None


@pytest.mark.parametrize("kind", ply_kinds(), ids=lambda kind: kind.name)
def test_ply_files(kind: PlyKind, tmp_path: Path) -> None:
    cloud, said = read(tmp_path / "a.ply", make_ply(XYZ, RGB, kind))
    check(cloud, said, kind.coordinates, kind.color)
    assert (cloud.height, cloud.width, cloud.sensor_pose) == (1, 48, None)


def test_the_files_are_what_other_readers_take_for_valid(tmp_path: Path) -> None:
    """What they refuse is spelled in a way that only some read."""
    taken = 0
    for kind in pcd_kinds():
        path = tmp_path / "a.pcd"
        path.write_bytes(make_pcd(XYZ, RGB, HEIGHT, kind))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                data = PointCloud.from_path(path).pc_data
        except Exception:  # of many kinds
            continue
        names = "XYZ" if kind.spelling == "upper case" else "xyz"
        np.testing.assert_array_equal(np.column_stack([data[name] for name in names]), XYZ)
        taken += 1
    assert taken > len(pcd_kinds()) // 3
    for ply_kind in ply_kinds():
        if ply_kind.spelling == "blank line":
            continue
        path = tmp_path / "a.ply"
        path.write_bytes(make_ply(XYZ, RGB, ply_kind))
        vertices = PlyData.read(str(path))["vertex"].data
        np.testing.assert_array_equal(np.column_stack([vertices[name] for name in "xyz"]), XYZ)


@pytest.mark.parametrize("suffix", [".pcd", ".ply"])
def test_doubles_stay_doubles(suffix: str, tmp_path: Path) -> None:
    xyz = XYZ.astype(np.float64) + [452_013.123456, 5_411_876.654321, 0.0]
    pose = (1.5, 0.0, 2.0, 0.5, 0.5, -0.5, 0.5)
    labels = np.arange(48, dtype=np.uint32)
    path = tmp_path / f"a{suffix}"
    write_labeled_cloud(path, Cloud(xyz, RGB, 1, 48, pose), labels)
    cloud = read_cloud(path, max_points=48)
    assert cloud.xyz.dtype == np.float64
    np.testing.assert_array_equal(cloud.xyz, xyz)
    if suffix == ".pcd":
        assert cloud.sensor_pose == pose
        found = PointCloud.from_path(path)
        assert found.metadata.viewpoint == pose
        data = found.pc_data
    else:
        data = PlyData.read(str(path))["vertex"].data
    np.testing.assert_array_equal(np.column_stack([data[name] for name in "xyz"]), xyz)
    np.testing.assert_array_equal(data["label"], labels)


def replaced(content: bytes, old: bytes, new: bytes) -> bytes:
    assert old in content
    return content.replace(old, new, 1)


def test_the_viewpoint_is_the_pose_of_the_sensor(tmp_path: Path) -> None:
    content = make_pcd(XYZ, RGB, HEIGHT, PcdKind())
    old = b"VIEWPOINT 0 0 0 1 0 0 0"
    cloud, said = read(tmp_path / "a.pcd", content)
    assert cloud.sensor_pose is None and said == [], "writers that do not know the pose put this one"
    cloud, said = read(tmp_path / "a.pcd", replaced(content, old, b"VIEWPOINT 1 -2.5 3e-1 0.5 0.5 0.5 -0.5"))
    assert cloud.sensor_pose == (1.0, -2.5, 0.3, 0.5, 0.5, 0.5, -0.5) and said == []
    for wrong in (b"0 0 0 0 0 0 0", b"1 2 3", b"0 0 nan 1 0 0 0", b"here"):
        cloud, said = read(tmp_path / "a.pcd", replaced(content, old, b"VIEWPOINT " + wrong))
        assert cloud.sensor_pose is None
        assert len(said) == 1 and said[0].startswith("odd_file") and wrong.decode() in said[0]


@pytest.mark.parametrize("spelling", [b"1.#QNAN", b"-1.#IND00", b"nan(ind)", b"-nan(ind)", b"NaN", b"-nan"])
def test_other_spellings_of_nan(spelling: bytes, tmp_path: Path) -> None:
    for name, content in (
        ("a.pcd", make_pcd(XYZ, RGB, HEIGHT, PcdKind("ascii"))),
        ("a.ply", make_ply(XYZ, RGB, PlyKind("ascii"))),
    ):
        cloud, said = read(tmp_path / name, content.replace(b"nan", spelling))
        check(cloud, said, "f4", "bytes")


def test_packed_colors_that_text_has_lost_are_told_and_not_made_up(tmp_path: Path) -> None:
    content = make_pcd(XYZ, RGB, HEIGHT, PcdKind("ascii"))
    head, _, rows = content.partition(b"DATA ascii\n")
    lines = [line.split(b" ") for line in rows.splitlines()]
    lines[3][3] = lines[7][3] = b"nan"
    cloud, said = read(tmp_path / "a.pcd", head + b"DATA ascii\n" + b"".join(b" ".join(x) + b"\n" for x in lines))
    assert cloud.rgb is None
    assert len(said) == 1 and "2 packed colors are 'nan'" in said[0]
    lines[3][3] = lines[7][3] = b"0"
    lines[5][3] = b"nan"  # a point without a position
    cloud, said = read(tmp_path / "a.pcd", head + b"DATA ascii\n" + b"".join(b" ".join(x) + b"\n" for x in lines))
    assert cloud.rgb is not None and said == []


@pytest.mark.parametrize("wrong", [-1.0, np.nan, np.inf, 70_000.0])
def test_channels_that_are_no_colors_are_told(wrong: float, tmp_path: Path) -> None:
    channels = RGB.astype(np.float32)
    channels[9, 1] = wrong
    record = [(name, "<f4") for name in ("x", "y", "z", "red", "green", "blue")]
    table = np.rec.fromarrays([*XYZ.T, *channels.T], record)
    content = make_ply(XYZ, RGB, PlyKind(color="floats to 255"))
    content = content[: content.index(b"end_header\n") + 11] + table.tobytes()
    cloud, said = read(tmp_path / "a.ply", content)
    assert cloud.rgb is None and len(said) == 1 and "red, green, blue are" in said[0] and "in 1 point;" in said[0]
    channels[9, 1], channels[5, 1] = 3.0, wrong  # only where there is no position
    table = np.rec.fromarrays([*XYZ.T, *channels.T], record)
    cloud, said = read(tmp_path / "a.ply", content[: content.index(b"end_header\n") + 11] + table.tobytes())
    assert said == [] and cloud.rgb is not None
    valid = np.arange(48) != 5
    np.testing.assert_array_equal(cloud.rgb[valid & (np.arange(48) != 9)], RGB[valid & (np.arange(48) != 9)])


def test_more_lines_than_points_are_told(tmp_path: Path) -> None:
    content = make_pcd(XYZ, RGB, HEIGHT, PcdKind("ascii"))
    cloud, said = read(tmp_path / "a.pcd", content + b"1 2 3 4\n")
    check(cloud, said[1:], "f4", "rgb float")
    assert "more lines than its 48 points" in said[0]


def test_whole_numbers_that_a_float_cannot_hold_stay_exact(tmp_path: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\nend_header\n"
    cloud, _ = read(tmp_path / "a.ply", f"{head}16777217 2 -3\n".encode())
    assert cloud.xyz.tolist() == [[16_777_217.0, 2.0, -3.0]]


DAMAGED_PCD = {
    "no line FIELDS": (b"FIELDS", b"FELDS"),
    "differ in length": (b"SIZE 4 4 4 4", b"SIZE 4 4 4"),
    "TYPE X": (b"TYPE F F F F", b"TYPE X F F F"),
    "SIZE 3": (b"SIZE 4 4 4 4", b"SIZE 3 4 4 4"),
    "COUNT 0": (b"COUNT 1 1 1 1", b"COUNT 0 1 1 1"),
    "POINTS many": (b"POINTS 48", b"POINTS many"),
    "WIDTH -48": (b"WIDTH 48", b"WIDTH -48"),
    "there twice": (b"FIELDS x y z rgb", b"FIELDS x y z x"),
    "not ascii, binary or binary_compressed": (b"DATA binary", b"DATA braille"),
    "no line DATA": (b"DATA binary", b"DETA binary"),
    "it is cut short": (b"POINTS 48", b"POINTS 49"),
    "claims 47 x 1": (b"WIDTH 48", b"WIDTH 47"),
}


@pytest.mark.parametrize("why", DAMAGED_PCD)
def test_damaged_pcd_headers_are_one_clear_error(why: str, tmp_path: Path) -> None:
    content = replaced(make_pcd(XYZ, RGB, HEIGHT, PcdKind()), *DAMAGED_PCD[why])
    with pytest.raises(CloudFileError) as caught:
        read(tmp_path / "a.pcd", content)
    assert why in str(caught.value) and "\n" not in str(caught.value)


def test_damaged_compressed_data_is_one_clear_error(tmp_path: Path) -> None:
    content = make_pcd(XYZ, RGB, HEIGHT, PcdKind("binary_compressed"))
    place = content.index(b"DATA binary_compressed\n") + 23
    huge = bytearray(content)
    huge[place + 4 : place + 8] = b"\xff\xff\xff\x7f"
    noise = content[: place + 8] + bytes(byte ^ 0x5A for byte in content[place + 8 :])
    for damaged, why in (
        (content[: place + 4], "cut short"),
        (content[:-9], "cut short"),
        (bytes(huge), "2147483647 bytes"),
        (noise, "cannot be read as PCD"),
    ):
        with pytest.raises(CloudFileError, match=why) as caught:
            read(tmp_path / "a.pcd", damaged)
        assert "\n" not in str(caught.value)


def test_faces_before_the_points_of_a_damaged_file_end_the_reading(tmp_path: Path) -> None:
    content = make_ply(XYZ, RGB, PlyKind(spelling="faces before"))
    place = content.index(b"end_header\n") + 11
    for count in (b"\xff", b"\x80"):
        with pytest.raises(CloudFileError):
            read(tmp_path / "a.ply", content[:place] + count + content[place + 1 :])
    with pytest.raises(CloudFileError, match="cut short"):
        read(tmp_path / "a.ply", replaced(content, b"face 2", b"face 999999999"))


@pytest.mark.parametrize("count", [-1, 2**31 - 1])
def test_lists_of_impossible_length_end_the_reading(count: int, tmp_path: Path) -> None:
    head = "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list int int i\nelement vertex 1\n"
    head += "".join(f"property float {name}\n" for name in "xyz") + "end_header\n"
    content = head.encode() + struct.pack("<i3f", count, 1.0, 2.0, 3.0)
    with pytest.raises(CloudFileError, match="cut short"):
        read(tmp_path / "a.ply", content)
    cloud, _ = read(tmp_path / "a.ply", head.encode() + struct.pack("<ii3f", 1, 7, 1.0, 2.0, 3.0))
    assert cloud.xyz.tolist() == [[1.0, 2.0, 3.0]]


@pytest.mark.parametrize("form", ["ascii", "binary", "binary_compressed"])
def test_too_many_points_are_refused_before_they_are_read(form: str, tmp_path: Path) -> None:
    path = tmp_path / "a.pcd"
    path.write_bytes(make_pcd(XYZ, RGB, HEIGHT, PcdKind(form)))
    with pytest.raises(CloudFileError, match=r"48 points are more than max_points allows \(47\); buy more memory"):
        read_cloud(path, max_points=47, advice="buy more memory")
