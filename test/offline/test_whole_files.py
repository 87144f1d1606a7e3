# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Files appear whole or not at all, also where the last step of writing them fails; and Ctrl-C has its exit status."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bag_maker import cloud_entries, write_mcap
from places import SIMULATED

from topo_region_seg.cloud.files import CloudFileError, write_labeled_cloud
from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags import BagError, BagWriter
from topo_region_seg.offline.bags.clouds import POINT_CLOUD
from topo_region_seg.offline.cli.console import write_whole
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.cli.status import ToolError

OLD = b"what was there before"


def _cloud(path: Path) -> None:
    write_labeled_cloud(path, Cloud(np.eye(3, dtype=np.float32), None, 1, 3), np.ones(3, np.uint32))


def _text(path: Path) -> None:
    write_whole(path, "new")


def _recording(path: Path) -> None:
    with BagWriter(path) as writer:
        writer.add_topic("/points", POINT_CLOUD)


WRITERS = [("a.pcd", _cloud, CloudFileError), ("a.ply", _cloud, CloudFileError), ("a.json", _text, ToolError)]
WRITERS += [("a.mcap", _recording, BagError)]


@pytest.mark.parametrize(("name", "write", "error"), WRITERS)
def test_a_file_that_cannot_take_its_name_is_one_line_and_leaves_the_old_one(
    name: str,
    write: Callable[[Path], None],
    error: type[Exception],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = tmp_path / name
    path.write_bytes(OLD)

    def refuse(*names: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(error) as caught:
        write(path)
    said = str(caught.value)
    assert said.startswith(f"{path}: cannot be written (No space left on device); ") and "\n" not in said
    assert path.read_bytes() == OLD
    assert os.listdir(tmp_path) == [name], "nothing half written stays"


def test_results_that_cannot_be_kept_are_said_once_and_the_sweep_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*names: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("topo_region_seg.offline.evaluation.cache.os.replace", refuse)
    grid = ["--set", "max_radius=0.01,0.02", "--set", "voxel_size=0.01"]
    assert main(["sweep", str(SIMULATED), "--cache", str(tmp_path / "cache"), *grid]) == 0
    err = capsys.readouterr().err
    assert err.count("results cannot be kept (No space left on device)") == 1
    assert not any((tmp_path / "cache").iterdir())


@pytest.mark.parametrize(
    ("command", "interrupted"),
    [
        (["replay"], "topo_region_seg.pipeline.Pipeline.run"),
        (["inspect"], "topo_region_seg.offline.cli.inspect.run"),
        (["evaluate", "--truth-topic", "/camera/points"], "topo_region_seg.offline.cli.evaluate.run"),
    ],
)
def test_ctrl_c_within_a_command_ends_it_with_its_status(
    command: list[str],
    interrupted: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    bag = write_mcap(tmp_path / "in.mcap", cloud_entries(2))

    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(interrupted, interrupt)
    assert main([command[0], str(bag), *command[1:]]) == 130
    assert "Traceback" not in capsys.readouterr().err
