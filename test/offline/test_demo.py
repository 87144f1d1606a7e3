# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The demonstration: its processes end, whatever happens, and it leaves what it promises."""

from __future__ import annotations

import json
import sys
import time

import pytest

from topo_region_seg.offline.demo.process import DemoError, Process
from topo_region_seg.offline.simulation import Camera, orbit, simulate, tabletop


def script(tmp_path, monkeypatch, text: str) -> list[str]:
    """Make a module of `text` that ``python -m`` finds; return the arguments."""
    (tmp_path / "made_for_test.py").write_text(text)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return ["made_for_test"]


def wait(condition, seconds: float = 10.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_process_that_dies_is_reported_with_the_end_of_its_log(tmp_path, monkeypatch) -> None:
    arguments = script(tmp_path, monkeypatch, "print('all was well'); raise SystemExit(3)")
    with Process("the node", arguments, tmp_path / "log", 5) as process:
        wait(lambda: not process.running)
        with pytest.raises(DemoError, match=r"the node ended with status 3; the end of .*log:\n.*all was well"):
            process.check()


def test_a_process_may_end_well_where_that_is_fine(tmp_path, monkeypatch) -> None:
    with Process("the player", script(tmp_path, monkeypatch, ""), tmp_path / "log", 5) as process:
        wait(lambda: not process.running)
        process.check(ended_is_fine=True)
        with pytest.raises(DemoError, match="status 0"):
            process.check()


def test_a_process_is_ended_with_the_block_even_if_it_will_not(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("topo_region_seg.offline.demo.process.PATIENCE", 0.3)
    text = (
        "import os, signal, time\n"
        "signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "print(os.environ['ROS_DOMAIN_ID'], flush=True)\n"
        "time.sleep(60)\n"
    )
    with pytest.raises(KeyError), Process("it", script(tmp_path, monkeypatch, text), tmp_path / "log", 7) as process:
        wait(lambda: "7" in process.tail())
        raise KeyError
    assert not process.running


def test_demo_empties_only_a_folder_that_it_made(tmp_path) -> None:
    pytest.importorskip("rclpy")
    pytest.importorskip("imgviz")
    from topo_region_seg.offline.demo.run import prepare

    foreign = tmp_path / "foreign"
    foreign.mkdir()
    (foreign / "thesis.txt").write_text("precious")
    with pytest.raises(DemoError, match="contains other files"):
        prepare(foreign)
    assert (foreign / "thesis.txt").exists()
    prepare(tmp_path / "own")
    (tmp_path / "own" / "result.png").touch()
    prepare(tmp_path / "own")
    assert not (tmp_path / "own" / "result.png").exists()


def test_demo_shows_a_sequence_over_dds_and_leaves_its_results(tmp_path, monkeypatch, capsys) -> None:
    pytest.importorskip("rclpy")
    pytest.importorskip("imgviz")
    from topo_region_seg.offline.bags import open_bag
    from topo_region_seg.offline.demo import run
    from topo_region_seg.offline.demo.recordings import DemoRecording

    def made():
        for seed, camera in enumerate(orbit(Camera.kinect(160, 120), 3)):
            frame = simulate(tabletop(1), camera, seed)
            yield frame.cloud, frame.labels

    monkeypatch.setattr(
        run, "RECORDINGS", (DemoRecording("small", "a small one", made, hz=4.0, params={"angle_threshold": 6.0}),)
    )
    output = tmp_path / "out"
    assert run.run(output)

    entry = json.loads((output / "summary.json").read_text())["recordings"][0]
    assert entry["frames_sent"] == 3
    assert 1 <= entry["frames_labeled"] <= 3
    assert entry["points"] == 160 * 120
    assert entry["regions"] > 3
    assert entry["same_offline"] is True
    assert entry["params"] == {"angle_threshold": 6.0}
    assert entry["ms_median"] > 0
    for name in entry["files"].values():
        assert (output / name).stat().st_size > 1000
    with open_bag(output / entry["files"]["labeled"]) as reader:
        assert reader.count("/labeled_points") == entry["frames_labeled"]
    said = capsys.readouterr().out
    assert str(output / "summary.json") in said
    assert f"{entry['frames_labeled']} of 3 frames labeled" in said


def test_demo_says_what_to_install_where_packages_are_missing(tmp_path, monkeypatch, capsys) -> None:
    from topo_region_seg.offline.demo.__main__ import main

    for name in ("topo_region_seg.offline.demo.run", "imgviz"):
        monkeypatch.setitem(sys.modules, name, None)
    assert main(["--output", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    assert "pip install '.[ros,demo]'" in error
