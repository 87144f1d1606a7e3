# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Files of all kinds through the commands: the same labels, colors and order, as independent readers find them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_maker import SECOND, cloud_entries, count_entry
from cloud_file_maker import PcdKind, PlyKind, make_pcd, make_ply, pcd_kinds, ply_kinds
from clouds import scene
from mcap.reader import make_reader
from mcap_maker import kinds as mcap_kinds
from mcap_maker import make as make_mcap
from plyfile import PlyData
from pypcd4 import PointCloud
from recording_maker import ros1_kinds, sqlite_kinds, write_ros1, write_sqlite
from rosbags.typesys import Stores, get_typestore

from topo_region_seg import Cloud, Params, Pipeline
from topo_region_seg.offline.cli.main import main

PARAMETERS = {"normal_radius": 0.02, "min_region_size": 20}
OPTIONS = [text for name, value in PARAMETERS.items() for text in ("--set", f"{name}={value}")]
HEIGHT = 24
XYZ, RGB = scene(32, HEIGHT)
XYZ[40] = np.nan


def labels_of(xyz: np.ndarray, rgb: np.ndarray | None, height: int, **changed: Any) -> np.ndarray:
    params = Params(**{**PARAMETERS, **changed})
    return Pipeline(params).run(Cloud(xyz, rgb, height, len(xyz) // height)).labels


@pytest.fixture(scope="module")
def expected() -> dict[tuple[str, int], np.ndarray]:
    return {
        ("color+normals", HEIGHT): labels_of(XYZ, RGB, HEIGHT),
        ("color+normals", 1): labels_of(XYZ, RGB, 1),
        ("normals", HEIGHT): labels_of(XYZ, None, HEIGHT, features="normals"),
        ("normals", 1): labels_of(XYZ, None, 1, features="normals"),
    }


def columns_of(path: Path) -> np.ndarray:
    if path.suffix == ".pcd":
        return PointCloud.from_path(path).pc_data
    return PlyData.read(str(path))["vertex"].data


def check_segment(content: bytes, path: Path, color: str, height: int, expected: Any, capsys: Any) -> None:
    """Segment a file; the one that is written must have its points in order, with their colors and labels."""
    path.write_bytes(content)
    features = "normals" if color == "none" else "color+normals"
    written = path.with_name(f"out{path.suffix}")
    assert main(["segment", str(path), "-o", str(written), "--set", f"features={features}", *OPTIONS]) == 0
    wanted = expected[features, height]
    said = capsys.readouterr()
    assert f"{wanted.max()} region" in said.out and said.err == ""
    data = columns_of(written)
    np.testing.assert_array_equal(np.column_stack([data[name] for name in "xyz"]), XYZ)
    np.testing.assert_array_equal(data["label"], wanted)
    if color == "none":
        assert "rgb" not in data.dtype.names and "red" not in data.dtype.names
    elif path.suffix == ".pcd":
        packed = np.ascontiguousarray(data["rgb"]).view(np.uint32)
        np.testing.assert_array_equal(np.column_stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255]), RGB)
    else:
        np.testing.assert_array_equal(np.column_stack([data[name] for name in ("red", "green", "blue")]), RGB)


@pytest.mark.parametrize("kind", pcd_kinds(), ids=lambda kind: kind.name)
def test_segment_pcd(kind: PcdKind, expected: Any, tmp_path: Path, capsys: Any) -> None:
    height = HEIGHT if kind.organized else 1
    check_segment(make_pcd(XYZ, RGB, HEIGHT, kind), tmp_path / "in.pcd", kind.color, height, expected, capsys)


@pytest.mark.parametrize("kind", ply_kinds(), ids=lambda kind: kind.name)
def test_segment_ply(kind: PlyKind, expected: Any, tmp_path: Path, capsys: Any) -> None:
    check_segment(make_ply(XYZ, RGB, kind), tmp_path / "in.ply", kind.color, 1, expected, capsys)


ENTRIES = [*cloud_entries(4), count_entry(2 * SECOND + 1)]


@pytest.fixture(scope="module")
def wanted_frames() -> list[tuple[int, np.ndarray]]:
    """Log times and labels of the recorded clouds, whose first point tells their number."""
    xyz, rgb = scene(32, HEIGHT)
    found = []
    for number in range(1, 5):
        xyz[0] = number
        found.append((number * SECOND, labels_of(xyz, rgb, HEIGHT)))
    return found


def check_recording(path: Path, folder: Path, wanted: list[tuple[int, np.ndarray]], capsys: Any) -> None:
    """Inspect and replay a recording; what is written is read by others than the project."""
    described, written = folder / "inspected.json", folder / "out.mcap"
    assert main(["inspect", str(path), "--json", str(described), "--frames", "2"]) == 0
    topics = {topic["name"]: topic["count"] for topic in json.loads(described.read_text())["topics"]}
    assert (topics["/camera/points"], topics["/count"]) == (4, 1)
    assert main(["replay", str(path), "-o", str(written), *OPTIONS]) == 0
    assert "4 clouds segmented" in capsys.readouterr().out
    store = get_typestore(Stores.ROS2_JAZZY)
    with written.open("rb") as file:
        found = [
            (message.log_time, store.deserialize_cdr(message.data, schema.name))
            for schema, _, message in make_reader(file, validate_crcs=True).iter_messages(["/labeled_points"])
            if schema is not None
        ]
    assert [log_time for log_time, _ in found] == [log_time for log_time, _ in wanted]
    for (log_time, message), (_, labels) in zip(found, wanted, strict=True):
        words = np.asarray(message.data).reshape(-1, message.point_step)
        place = {field.name: field.offset for field in message.fields}
        at = {name: words[:, offset : offset + 4].copy() for name, offset in place.items()}
        assert at["x"].view("<f4")[0, 0] == log_time // SECOND
        np.testing.assert_array_equal(at["label"].view("<u4")[:, 0], labels)
        np.testing.assert_array_equal(at["rgb"][:, 2::-1], RGB)
        assert (message.height, message.width) == (HEIGHT, 32)


CASES: dict[str, Callable[[Path], Path]] = {
    **{
        f"mcap {number}: {kind.name}": lambda folder, kind=kind: _written(folder / "in.mcap", make_mcap(ENTRIES, kind))
        for number, kind in enumerate(mcap_kinds())
        if number % 5 == 0  # all of them are read in test_mcap_combinations
    },
    **{
        f"sqlite3 {kind.name}": lambda folder, kind=kind: write_sqlite(folder / "in", ENTRIES, kind)
        for kind in sqlite_kinds()
    },
    **{
        f"ros1 {kind.name}": lambda folder, kind=kind: write_ros1(folder / "in.bag", ENTRIES, kind)
        for kind in ros1_kinds()
    },
}


def _written(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("case", CASES)
def test_inspect_and_replay(case: str, wanted_frames: Any, tmp_path: Path, capsys: Any) -> None:
    check_recording(CASES[case](tmp_path), tmp_path, wanted_frames, capsys)


def test_there_are_enough_files() -> None:
    assert len(pcd_kinds()) + len(ply_kinds()) + len(CASES) > 300
