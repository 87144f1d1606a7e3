# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest
from clouds import random_points
from places import SHARED
from plyfile import PlyData, PlyElement
from pypcd4 import Encoding, PointCloud

from topo_region_seg.cloud.files import CloudFileError, check_output, read_cloud, write_labeled_cloud
from topo_region_seg.data import Cloud

CLOUDS = SHARED / "clouds"
LIMIT = 10**6


@pytest.mark.parametrize("suffix", [".pcd", ".ply", ".PCD"])
@pytest.mark.parametrize("color", [True, False])
@pytest.mark.parametrize("n", [0, 1, 60])
def test_labeled_clouds_are_read_again(suffix, color, n, tmp_path):
    xyz, rgb = random_points(n)
    xyz[: n // 10] = np.nan
    height = 6 if n == 60 else 1
    labels = np.arange(n, dtype=np.uint32) + 2**31
    path = tmp_path / f"out{suffix}"
    write_labeled_cloud(path, Cloud(xyz, rgb if color else None, height, n // height), labels)
    cloud = read_cloud(path, max_points=LIMIT)
    np.testing.assert_array_equal(cloud.xyz, xyz)
    assert cloud.xyz.dtype == np.float32 and cloud.xyz.flags.c_contiguous
    assert (cloud.rgb is not None) == color
    if color:
        np.testing.assert_array_equal(cloud.rgb, rgb)
    if suffix != ".ply":
        assert (cloud.height, cloud.width) == (height, n // height)
        written = PointCloud.from_path(path).pc_data
    else:
        written = PlyData.read(str(path))["vertex"].data
    np.testing.assert_array_equal(np.atleast_1d(written["label"]), labels)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("encoding", [Encoding.ASCII, Encoding.BINARY, Encoding.BINARY_COMPRESSED])
@pytest.mark.parametrize(("name", "kind"), [("rgb", np.float32), ("rgb", np.uint32), ("rgba", np.uint32)])
def test_encodings_and_colors_of_pcd(encoding, name, kind, tmp_path):
    xyz, rgb = random_points(20)
    packed = (rgb[:, 0].astype("<u4") << 16) | (rgb[:, 1].astype("<u4") << 8) | rgb[:, 2]
    if name == "rgba":
        packed |= np.uint32(0xFF000000)
    pcd = PointCloud.from_points([*xyz.T, packed.view(kind)], ["x", "y", "z", name], [np.float32] * 3 + [kind])
    pcd.save(tmp_path / "a.pcd", encoding=encoding)
    cloud = read_cloud(tmp_path / "a.pcd", max_points=LIMIT)
    np.testing.assert_allclose(cloud.xyz, xyz, rtol=1e-5)
    if encoding is not Encoding.ASCII or kind is np.uint32:  # decimals do not carry every bit of a float
        np.testing.assert_array_equal(cloud.rgb, rgb)


def test_float64_ply_without_color(tmp_path):
    table = np.array([(1.0, 2.0, 1e300)], [("x", "f8"), ("y", "f8"), ("z", "f8")])
    PlyData([PlyElement.describe(table, "vertex")], text=True).write(str(tmp_path / "a.ply"))
    cloud = read_cloud(tmp_path / "a.ply", max_points=LIMIT)
    np.testing.assert_array_equal(cloud.xyz, [[1.0, 2.0, 1e300]])
    assert cloud.rgb is None


@pytest.mark.parametrize(("text", "byte_order"), [(True, "="), (False, "<"), (False, ">")])
def test_ply_of_another_writer_with_other_elements_around(text, byte_order, tmp_path):
    xyz, rgb = random_points(20)
    vertices = np.empty(20, [("x", "f4"), ("y", "f8"), ("z", "f4"), ("red", "u1"), ("green", "u1"), ("blue", "u1")])
    for name, column in zip(vertices.dtype.names, [*xyz.T, *rgb.T], strict=True):
        vertices[name] = column
    cameras = PlyElement.describe(np.array([(1, 2.0), (3, 4.0)], [("id", "i2"), ("focal", "f4")]), "camera")
    faces = np.empty(1, [("vertex_indices", "O")])
    faces["vertex_indices"][0] = np.array([0, 1, 2], "i4")
    elements = [cameras, PlyElement.describe(vertices, "vertex"), PlyElement.describe(faces, "face")]
    PlyData(elements, text=text, byte_order=byte_order, comments=["made here"]).write(str(tmp_path / "a.ply"))
    cloud = read_cloud(tmp_path / "a.ply", max_points=LIMIT)
    np.testing.assert_allclose(cloud.xyz, xyz, rtol=1e-6)
    np.testing.assert_array_equal(cloud.rgb, rgb)


PLY = "ply\nformat {form} 1.0\nelement vertex {n}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"


PCD = (
    "VERSION .7\nFIELDS {fields}\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
    "WIDTH {width}\nHEIGHT 1\nPOINTS {points}\nDATA ascii\n"
)


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("a.pcd", None, "no such file"),
        ("a.xyz", "", "neither .pcd nor .ply"),
        ("a.pcd", "", "the file is empty"),
        ("a.ply", "", "the file is empty"),
        ("a.pcd", "hello\n", "its header is damaged"),
        ("a.ply", "hello\n", "cannot be read as PLY"),
        ("a.ply", "ply\nformat ascii 1.0\nelement face 0\nend_header\n", "cannot be read as PLY"),
        ("a.ply", PLY.format(form="ascii", n=2) + "1 2 3\n", "it is cut short"),
        ("a.ply", PLY.format(form="ascii", n=10**15) + "1 2 3\n", "it is cut short"),
        ("a.ply", PLY.format(form="binary_little_endian", n=10**15) + "abcd" * 3, "it is cut short"),
        ("a.ply", PLY.format(form="binary_middle_endian", n=1), "is not known"),
        ("a.ply", PLY.format(form="ascii", n=1).replace("float z", "float y") + "1 2 3\n", "is there twice"),
        ("a.ply", PLY.format(form="ascii", n=1).replace("float z", "list uchar int z") + "1 2 0\n", "hold lists"),
        ("a.ply", PLY.format(form="ascii", n=1).replace("float z", "quad z") + "1 2 3\n", "is not understood"),
        ("a.ply", PLY.format(form="ascii", n=1)[:40], "cannot be read as PLY"),
        ("a.pcd", PCD.format(fields="x y w", width=1, points=1) + "1 2 3\n", "has no z"),
        ("a.pcd", PCD.format(fields="x y z", width=3, points=2) + "1 2 3\n4 5 6\n", "claims 3 x 1"),
        ("a.pcd", PCD.format(fields="x y z", width=2, points=2).replace("ascii", "binary") + "abc", "cannot be read"),
        ("a.pcd", PCD.format(fields="x y z", width=3, points=3) + "1 2 3\n" * 3, "max_points allows (2); raise it"),
    ],
)
def test_errors_name_the_file_and_the_reason(name, content, why, tmp_path):
    path = tmp_path / name
    if content is not None:
        path.write_text(content)
    with pytest.raises(CloudFileError) as caught:
        read_cloud(path, max_points=2)
    text = str(caught.value)
    assert text.startswith(str(path)) and why in text and "\n" not in text


def test_outputs_are_checked_before_the_work(tmp_path):
    check_output(tmp_path / "a.ply")
    for path in (tmp_path / "a.xyz", tmp_path / "missing" / "a.pcd"):
        with pytest.raises(CloudFileError):
            check_output(path)
    with pytest.raises(CloudFileError, match="cannot be written"):
        write_labeled_cloud(tmp_path / "missing" / "a.pcd", Cloud(*random_points(1), 1, 1), np.zeros(1, np.uint32))


@pytest.mark.skipif(not CLOUDS.is_dir(), reason="the clouds of ../shared/data are not here")
@pytest.mark.parametrize(
    ("name", "height", "width"),
    [
        ("milk_color.pcd", 1, 13_704),
        ("region_growing_rgb_tutorial.pcd", 480, 640),
        ("milk_cartoon_all_small_clorox.pcd", 480, 640),
    ],
)
def test_real_clouds(name, height, width):
    cloud = read_cloud(CLOUDS / name, max_points=LIMIT)
    assert (cloud.height, cloud.width) == (height, width)
    valid = np.isfinite(cloud.xyz).all(axis=1)
    assert 0.2 < valid.mean() <= 1.0
    assert cloud.rgb[valid].std() > 10.0
