# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark: programs that disagree are noticed, programs that are missing are named, the parts run."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from places import ROOT

sys.path.append(str(ROOT))  # last, so that an installed copy of the package is the one that is tested

from benchmarks import __main__ as benchmark
from benchmarks import checks, hostile, pcl_peers, peers, report, synthetic
from benchmarks.parts import filtration, worst_cases
from benchmarks.results import Result, Setting
from benchmarks.timing import Timing

POINTS = synthetic.objects(1_500, 0.004)


@pytest.fixture
def no_pcl(monkeypatch) -> None:
    monkeypatch.setattr(pcl_peers, "_build", lambda: (Path(), "PCL is missing"))


@pytest.fixture(scope="module")
def found():
    ours = POINTS.components(filtration.PARAMS)
    return ours, peers.scipy_program(POINTS, filtration.PARAMS), peers.all_edges(POINTS, filtration.PARAMS)


def test_scipy_and_the_core_agree(found) -> None:
    ours, theirs, edges = found
    checks.counts_agree("SciPy", theirs.counts, ours.counts(10))
    checks.deaths_agree("SciPy", theirs.deaths, ours, 1e-12)
    checks.same_partition("SciPy", edges.partition(filtration.PARAMS.max_radius), ours.root)


def test_one_component_more_is_noticed(found) -> None:
    ours, theirs, _ = found
    counts = theirs.counts.copy()
    counts[4] += 1
    with pytest.raises(checks.DisagreementError, match="components at the scales"):
        checks.counts_agree("SciPy", counts, ours.counts(10))


@pytest.mark.parametrize("change", [lambda d: d[1:], lambda d: np.append(d[1:], d[0] * 1.000001)])
def test_one_other_death_is_noticed(found, change) -> None:
    ours, theirs, _ = found
    with pytest.raises(checks.DisagreementError, match="death"):
        checks.deaths_agree("SciPy", change(np.sort(theirs.deaths)), ours, 1e-9)


def test_one_point_in_another_group_is_noticed(found) -> None:
    ours, _, edges = found
    other = edges.partition(filtration.PARAMS.max_radius).copy()
    other[7] = other.max() + 1
    with pytest.raises(checks.DisagreementError, match="groups"):
        checks.same_partition("SciPy", other, ours.root)
    with pytest.raises(checks.DisagreementError, match="not between"):
        checks.between("PCL", other, ours.root, ours.root)


def test_a_partition_lies_between_finer_and_coarser_ones() -> None:
    fine, middle, coarse = np.array([0, 1, 2, 3]), np.array([5, 5, 2, 3]), np.array([0, 0, 0, 1])
    checks.between("it", middle, fine, coarse)
    assert not checks.refines(middle, fine)


def test_a_program_that_differs_is_not_timed(monkeypatch, tmp_path, no_pcl, found) -> None:
    wrong = dataclasses.replace(found[1], deaths=found[1].deaths * 1.001)
    monkeypatch.setattr(peers, "scipy_program", lambda points, params: wrong)
    result = Result()
    with pytest.raises(checks.DisagreementError):
        filtration._measure(POINTS, 100.0, Setting(quick=True, folder=tmp_path), result)
    assert result.lines == []


def test_programs_that_are_missing_are_named(tmp_path, no_pcl) -> None:
    result = Result()
    filtration._measure(POINTS, 1.0, Setting(quick=True, folder=tmp_path), result)
    assert [line.reached for line in result.lines][1:] == [None, None]
    assert result.lines[1].figure == "PCL is missing"
    assert ["PCL is missing" in row for row in result.tables[0].rows].count(True) == 2


@pytest.mark.parametrize("name", hostile.CLOUDS)
def test_hostile_clouds_are_of_the_size_asked_for(name) -> None:
    points = hostile.CLOUDS[name](500, 0.03)
    assert points.xyz.shape == points.lab.shape == points.normals.shape == (500, 3)
    np.testing.assert_array_equal(points.xyz, points.xyz.astype(np.float32))
    worst_cases._check(points, name)


def test_timing_quantiles() -> None:
    time = Timing(tuple(float(ms) for ms in range(1, 201)))
    assert (time.best, time.median, time.quantile(0.99)) == (1.0, 100.5, 199.0)


def test_a_part_runs_and_is_reported(tmp_path, no_pcl, capfd) -> None:
    assert benchmark.main(["--quick", "--only", "scaling", "--output", str(tmp_path)]) == 0
    parts = json.loads((tmp_path / "benchmarks.json").read_text())
    assert set(parts) == {"scaling"}
    assert parts["scaling"]["machine"]["cores"] >= 1
    text = (tmp_path / "benchmarks.md").read_text()
    assert all(line["goal"] in text and line["figure"] in text for line in parts["scaling"]["lines"])
    assert (tmp_path / "images" / "bench_scaling.png").stat().st_size > 5_000
    assert "core in at most 250 ms" in capfd.readouterr().out


def test_a_part_that_fails_is_told_and_the_others_run(monkeypatch, tmp_path, no_pcl, capfd) -> None:
    def run_part(name: str, setting: Setting) -> dict:
        if name == "memory":
            raise checks.DisagreementError("4 is not 5")
        return {"name": name}

    monkeypatch.setattr(benchmark, "run_part", run_part)
    monkeypatch.setattr(benchmark.plots, "draw", lambda parts, folder: {})
    monkeypatch.setattr(report, "markdown", lambda parts, pictures: ", ".join(parts))
    assert benchmark.main(["--output", str(tmp_path)]) == 1
    assert "memory: results differ: 4 is not 5" in capfd.readouterr().err
    told = (tmp_path / "benchmarks.md").read_text().split(", ")
    assert set(told) == {*benchmark.PARTS} - {"memory"}
