# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What ``segment`` prints of clouds with many regions and of large clouds."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from topo_region_seg.cloud.files import write_labeled_cloud
from topo_region_seg.data import Cloud
from topo_region_seg.offline.cli import segment
from topo_region_seg.offline.cli.main import main

PATCHES = 60
SETTINGS = ["--set", "remove_floor=false", "--set", "voxel_size=0", "--set", "features=color", "--set", "max_range=100"]


@pytest.fixture(scope="module")
def patches(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Squares of 1 mm spacing far apart, each larger than the one before."""
    parts = []
    for number in range(PATCHES):
        side = 1e-3 * np.arange(9 + number // 4)
        x, y = (grid.ravel() for grid in np.meshgrid(side, side))
        parts.append(np.column_stack([x + number % 8 * 0.2, y + number // 8 * 0.2, np.ones(len(x))]))
    xyz = np.concatenate(parts).astype(np.float32)
    path = tmp_path_factory.mktemp("patches") / "in.ply"
    write_labeled_cloud(path, Cloud(xyz, np.full(xyz.shape, 99, np.uint8), 1, len(xyz)), np.zeros(len(xyz), np.uint32))
    return path


def sizes(text: str) -> list[int]:
    """Return the numbers of points in the lines of the table."""
    return [int(found[1].replace(",", "")) for found in re.finditer(r"■ \d+ +██ #\w+ +([\d,]+) ", text)]


def test_the_largest_regions_are_printed_unless_all_are_asked_for(patches, capsys):
    assert main(["segment", str(patches), *SETTINGS]) == 0
    some = capsys.readouterr().out
    assert main(["segment", str(patches), "--all", *SETTINGS]) == 0
    everything = capsys.readouterr().out
    assert len(sizes(everything)) == PATCHES and "--all" not in everything
    assert sizes(some) == sorted(sizes(everything), reverse=True)[: segment.SHOWN]
    assert f"the {segment.SHOWN} largest of {PATCHES} regions; --all prints all" in some
    assert f"{PATCHES} regions in" in some


def test_large_clouds_say_what_is_going_on(patches, tmp_path, capsys, monkeypatch):
    assert main(["segment", str(patches), *SETTINGS]) == 0
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(segment, "LARGE", 1_000)
    assert main(["segment", str(patches), "-o", str(tmp_path / "out.ply"), *SETTINGS]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert [line.split()[0] for line in lines] == ["segmenting", "writing"]
