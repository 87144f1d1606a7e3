# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `sweep`: the grid, what it finds, and that it goes on where it was killed."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from topo_region_seg import Params
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.evaluation import MEASURES
from topo_region_seg.offline.evaluation import version as program
from topo_region_seg.offline.evaluation.finding import content_id
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.recording import write_recording

COARSE = ["--set", "normal_radius=0.04", "--set", "min_region_size=8"]
GRID = ["--set", "max_radius=0.04,0.06", "--set", "angle_threshold=5,15", "--set", "color_threshold=10,30"]


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("bags")
    for number in range(3):
        found = [simulate(tabletop(number), Camera.kinect(80, 60), seed) for seed in range(3)]
        write_recording(folder / f"{number}.mcap", [(frame.cloud, frame.labels) for frame in found])
    return [str(path) for path in sorted(folder.iterdir())]


def sweep(bags, cache, *arguments, status=0):
    out = cache.parent / "out.json"
    out.unlink(missing_ok=True)
    assert main(["sweep", *bags, "--cache", str(cache), "--json", str(out), *COARSE, *map(str, arguments)]) == status
    return json.loads(out.read_text())


def without_ms(found):
    rows = [(c["varied"], c["mean"], c["frames"], [b["mean"] for b in c["bags"]]) for c in found["combinations"]]
    return sorted(rows, key=lambda row: sorted(row[0].items()))


def test_every_combination_is_tried_and_the_best_comes_first(bags, tmp_path, capsys) -> None:
    found = sweep(bags, tmp_path / "cache", *GRID, "-o", tmp_path / "out", "--csv", tmp_path / "a.csv")
    shown = capsys.readouterr()
    assert "8 combinations x 3 recordings: 24 runs, 0 of them in the cache" in shown.err
    assert shown.out.count("★ 1") == 1 and "best: max_radius" in shown.out
    assert (found["cached"], found["computed"]) == (0, 24)
    every = {tuple(c["varied"].values()) for c in found["combinations"]}
    assert every == {(r, a, c) for r in (0.04, 0.06) for a in (5.0, 15.0) for c in (10.0, 30.0)}
    overlaps = [c["mean"]["wov"] for c in found["combinations"]]
    assert overlaps == sorted(overlaps, reverse=True)
    assert len(set(overlaps)) > 1
    assert found["best"] == found["combinations"][0]["varied"]
    assert all(c["frames"] == 9 and set(c["mean"]) == set(MEASURES) for c in found["combinations"])
    assert (tmp_path / "out" / "sweep.png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((tmp_path / "a.csv").open()))
    assert [float(row["wov"]) for row in rows] == overlaps
    assert not (tmp_path / "out" / "sweep.csv").exists()  # --csv names another place


def test_a_combination_has_the_figures_of_evaluate(bags, tmp_path) -> None:
    found = sweep(bags, tmp_path / "cache", "--set", "max_radius=0.06")
    out = tmp_path / "evaluated.json"
    assert main(["evaluate", *bags, "--json", str(out), *COARSE, "--set", "max_radius=0.06"]) == 0
    evaluated = json.loads(out.read_text())
    (only,) = found["combinations"]
    assert only["mean"] == evaluated["mean"]
    assert (
        only["params"]
        == evaluated["params"]
        == Params(normal_radius=0.04, min_region_size=8, max_radius=0.06).as_dict()
    )


def test_a_sweep_that_is_killed_at_half_computes_only_the_rest(bags, tmp_path, warm_kernels) -> None:
    cache = tmp_path / "cache"
    command = [sys.executable, "-m", "topo_region_seg", "sweep", *bags, "--cache", str(cache), *COARSE, *GRID]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while len(list(cache.glob("*.json"))) < 12 and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.002)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    kept = {path: path.stat().st_mtime_ns for path in cache.glob("*.json")}
    assert 12 <= len(kept) < 24
    for path in kept:
        json.loads(path.read_text())  # whole
    found = sweep(bags, cache, *GRID)
    assert (found["cached"], found["computed"]) == (len(kept), 24 - len(kept))
    assert len(list(cache.glob("*.json"))) == 24
    assert all(path.stat().st_mtime_ns == time_ for path, time_ in kept.items())
    assert without_ms(found) == without_ms(sweep(bags, tmp_path / "fresh", *GRID))


def test_what_a_result_depends_on_is_in_its_key(bags, tmp_path, monkeypatch) -> None:
    cache = tmp_path / "cache"
    one = bags[:1]
    assert sweep(one, cache)["computed"] == 1
    assert sweep(one, cache)["computed"] == 0
    assert sweep(one, cache, "--set", "max_radius=0.05")["computed"] == 1
    moved = tmp_path / "moved.mcap"
    moved.write_bytes(Path(one[0]).read_bytes())
    found = sweep([str(moved)], cache)
    assert found["computed"] == 0 and found["combinations"][0]["bags"][0]["bag"] == str(moved)
    assert sweep([bags[1]], cache)["computed"] == 1
    assert sweep(one, cache, "--truth-bag", bags[1])["computed"] == 1
    monkeypatch.setattr("topo_region_seg.offline.evaluation.sweep.program_version", lambda: "0.0.0+other")
    assert sweep(one, cache)["computed"] == 1


def test_a_recording_that_was_replaced_by_one_of_equal_size_and_time_is_computed_again(bags, tmp_path) -> None:
    cache, bag = tmp_path / "cache", tmp_path / "a.mcap"
    data = bytearray(Path(bags[0]).read_bytes())
    bag.write_bytes(data)
    before = bag.stat()
    assert sweep([str(bag)], cache)["computed"] == 1
    data[-60] ^= 1  # in the footer, whose checksum then tells nobody but careful readers
    bag.write_bytes(data)
    os.utime(bag, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert bag.stat().st_size == before.st_size
    assert content_id(bag) != content_id(Path(bags[0]))
    status = main(["sweep", str(bag), "--cache", str(cache), "--json", str(tmp_path / "again.json"), *COARSE])
    assert json.loads((tmp_path / "again.json").read_text())["cached"] == 0, status


def test_entries_that_are_damaged_are_computed_anew(bags, tmp_path) -> None:
    cache = tmp_path / "cache"
    wanted = sweep(bags, cache)
    first, second, third = sorted(cache.glob("*.json"))
    first.write_text(first.read_text()[:-20])
    second.write_text("[]")
    third.write_text(third.read_text().replace('"key": {', '"key": {"more": 1, '))
    found = sweep(bags, cache)
    assert (found["cached"], found["computed"]) == (0, 3)
    assert without_ms(found) == without_ms(wanted)


def test_the_version_of_the_program_tells_its_code(monkeypatch, tmp_path) -> None:
    program.program_version.cache_clear()
    ours = program.program_version()
    (tmp_path / "params.py").write_text("")
    monkeypatch.setattr(program, "_PACKAGE", tmp_path)
    monkeypatch.setattr(program, "_CODE", ("params.py",))
    program.program_version.cache_clear()
    assert program.program_version() != ours
    program.program_version.cache_clear()


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["--set", "max_radius=0.01,-1", "--set", "angle_threshold=5,400"], "3 of 4 combinations are invalid"),
        (["--set", "min_range=1,3", "--set", "max_range=2"], "[min_range=3, max_range=2] min_range (3.0) is greater"),
        (["--set", "max_radus=1"], "did you mean max_radius?"),
        (["--set", "max_radius="], "no value"),
        (["--set", "max_radius"], "no '='"),
        (["--plot", "a.txt"], "must end in .png"),
        (["--json", "missing/a.json"], "missing or not writable"),
    ],
)
def test_wrong_usage_is_said_before_the_work(arguments, why, bags, tmp_path, capsys) -> None:
    assert main(["sweep", *bags, "--cache", str(tmp_path / "cache"), *arguments]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and why in err
    assert not (tmp_path / "cache").exists()


def test_lists_take_semicolons_and_equal_values_count_once(bags, tmp_path, capsys) -> None:
    boxes = "crop_box=;-1,-1,0,1,1,5"
    found = sweep(bags[:1], tmp_path / "cache", "--set", boxes, "--set", "max_radius=0.04,4e-2")
    assert "2 combinations x 1 recording: 2 runs" in capsys.readouterr().err
    assert [c["params"]["crop_box"] for c in found["combinations"]].count([]) == 1


def test_a_recording_that_fails_is_named_and_the_rest_is_done(bags, tmp_path, capsys) -> None:
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(b"no recording")
    found = sweep([*bags[:1], str(broken)], tmp_path / "cache", "--set", "max_radius=0.04,0.06", status=1)
    assert [c["frames"] for c in found["combinations"]] == [3, 3]
    err = capsys.readouterr().err
    assert err.count(f"failed: {broken}") == 1  # not once per combination
    assert len(list((tmp_path / "cache").glob("*.json"))) == 2


@pytest.mark.parametrize(("command", "shown"), [("sweep", 3), ("evaluate", 10)])
def test_many_rejected_clouds_are_named_in_part_and_counted(command, shown, tmp_path, capsys) -> None:
    frame = simulate(tabletop(0), Camera.kinect(16, 12), 0)
    bag = tmp_path / "a.mcap"
    write_recording(bag, [(frame.cloud, frame.labels)] * 14)
    cache = ["--cache", str(tmp_path / "cache")] if command == "sweep" else []
    assert main([command, str(bag), *cache, "--set", "max_points=10"]) == 1
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("rejected: ")]
    total = len(lines) - 1 + int(lines[-1].split()[-2])
    assert len(lines) == shown + 1 and lines[-1].endswith(" more") and total in (14, 28), "clouds, and perhaps truths"
    assert all("too_many_points" in line for line in lines[:-1])
