# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The script that says whether two revisions give the same results notices what differs, and only that."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from revision_comparison.comparison import Comparison, Outcome
from revision_comparison.configurations import CORE, LAYOUTS, SPECIAL, STREAMS
from revision_comparison.cpu_time import Timing
from revision_comparison.differences import differences
from revision_comparison.recording import messages
from revision_comparison.revisions import RevisionError, Worker, unpacked
from revision_comparison.worker import translated

from topo_region_seg import Params
from topo_region_seg.cloud.messages.topics import OUTPUTS
from topo_region_seg.params import ParameterError

NAN = float("nan")


def as_arrays(**values: Any) -> dict[str, np.ndarray]:
    return {name: np.asarray(value) for name, value in values.items()}


def test_same_arrays_have_no_differences() -> None:
    one = as_arrays(labels=np.arange(5, dtype=np.uint32), death=[0.1, NAN, np.inf], scale=0.02, none=np.empty((0, 3)))
    assert differences(one, {name: array.copy() for name, array in one.items()}) == []


@pytest.mark.parametrize(
    ("base", "present", "text"),
    [
        ([1.0, 2.0, 3.0], [1.0, 2.5, 3.5], "x 2 of 3"),
        ([[1, 2], [3, 4]], [[1, 2], [3, 5]], "x 1 of 4"),
        ([0.1 + 0.2], [0.3], "x 1 of 1"),
        ([0.0, NAN], [-0.0, NAN], "x 1 of 2"),
        (1.0, 2.0, "x 1 of 1"),
        ([1, 2, 3], [1, 2], "x has shape (2,), had (3,)"),
        (np.zeros((0, 3)), np.zeros((0, 2)), "x has shape (0, 2), had (0, 3)"),
        (np.zeros(2, np.int32), np.zeros(2, np.int64), "x is int64, was int32"),
    ],
)
def test_what_differs_is_named_and_counted(base: Any, present: Any, text: str) -> None:
    assert differences(as_arrays(x=base, same=1), as_arrays(x=present, same=1)) == [text]


def test_missing_and_new_arrays_differ() -> None:
    assert differences(as_arrays(a=1, b=2), as_arrays(b=2, c=3)) == ["a is missing", "c is new"]


def test_output_is_translated_for_revisions_that_do_not_know_it() -> None:
    old = {"mode", "level", "voxel_size"}
    assert translated({"output": "objects", "voxel_size": 0.0}, old) == {"level": "objects", "voxel_size": 0.0}
    assert translated({"output": "supervoxels"}, old) == {"mode": "supervoxels"}
    assert translated({"output": "regions"}, old) == {}
    assert translated({"output": "objects"}, {"output"}) == {"output": "objects"}


def test_every_configuration_is_one_of_the_present_parameters() -> None:
    known = {row.name for row in Params.table()}
    for configuration in (*CORE, *SPECIAL, *STREAMS, *LAYOUTS):
        try:
            Params.from_mapping(translated(configuration.params, known))
        except ParameterError as error:
            pytest.fail(f"{configuration.name}: {error}")


def test_names_of_configurations_are_unique() -> None:
    names = [configuration.name for configuration in (*CORE, *SPECIAL)]
    assert len(names) == len(set(names))


def test_a_line_shows_the_first_differences_and_counts_the_rest() -> None:
    assert Outcome("regions", 3, []).line() == "equal    regions (3 arrays)"
    assert Outcome("regions", 9, [f"x{i}" for i in range(8)]).line().endswith("x4; x5; 2 more")


def test_a_change_of_cpu_time_is_the_median_over_the_rounds() -> None:
    line = Timing("regions", base_ms=[10.0, 20.0, 40.0], present_ms=[11.0, 21.0, 80.0]).line()
    assert line == "regions: 20.0 ms before, 21.0 ms now, +10.0 % (single rounds +5.0 to +100.0 %)"


def test_unknown_revision_is_refused() -> None:
    if subprocess.run(["git", "rev-parse"], cwd=ROOT, capture_output=True).returncode:
        pytest.skip("not a git checkout: there are no revisions")
    with pytest.raises(RevisionError, match="git knows no such revision"):
        unpacked("no-such-revision")


@pytest.fixture(scope="module")
def worker() -> Any:
    with Worker(ROOT) as worker:
        yield worker


@pytest.fixture
def cloud(tmp_path: Path) -> Path:
    """Two walls, a step apart."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0.0, 0.1, 25), np.linspace(0.0, 0.1, 25)))
    xyz = np.concatenate([np.column_stack([x + shift, y, 1.0 + shift + 0 * x]) for shift in (0.0, 0.11)])
    path = tmp_path / "cloud.npz"
    np.savez(path, xyz=xyz, rgb=np.full(xyz.shape, 90, np.uint8))
    return path


def test_worker_gives_everything_that_is_compared(worker: Worker, cloud: Path, tmp_path: Path) -> None:
    path = tmp_path / "arrays.npz"
    params = {"output": "regions", "max_radius": 0.02, "remove_floor": False}
    answer = worker.ask({"do": "segment", "cloud": str(cloud), "params": params, "arrays": str(path)})
    assert answer.get("error") is None and answer["cpu"] > 0
    found = dict(np.load(path))
    assert len(found["labels"]) == 1250 and len(found["regions.size"]) == 2
    assert {"components.death", "barcode.label", "regions.centroid", "half: labels", "adjacency(0.02).pairs"} <= {
        *found
    }
    # Two ways to the same filtration.
    np.testing.assert_array_equal(found["persistent_components.death"], found["components.death"])


def test_worker_says_why_there_is_no_result_and_goes_on(worker: Worker, cloud: Path) -> None:
    request = {"do": "segment", "cloud": str(cloud), "params": {"max_radius": -1.0}}
    assert worker.ask(request)["error"].startswith("ParameterError: max_radius = -1.0")
    assert "error" not in worker.ask({**request, "params": {}})


def test_worker_of_other_sources_is_refused(tmp_path: Path) -> None:
    with Worker(tmp_path) as other, pytest.raises(RevisionError, match="was imported from"):
        other.ask({"do": "start"})


class Altered:
    """Stands for a revision with another threshold."""

    def __init__(self, worker: Worker) -> None:
        self._worker = worker

    def send(self, request: dict[str, Any]) -> None:
        self._worker.send({**request, "params": {**request["params"], "color_threshold": 0.5}})

    def receive(self) -> dict[str, Any]:
        return self._worker.receive()


def test_same_revision_is_equal_and_an_altered_one_differs(worker: Worker, tmp_path: Path) -> None:
    def first(present: Any) -> Outcome:
        return next(Comparison(worker, present, tmp_path).clouds(tmp_path, quick=True))

    same, altered = first(worker), first(Altered(worker))
    assert same.problems == [] and same.compared > 40
    assert any(text.startswith("labels ") for text in altered.problems)


def test_replayed_messages_are_read_back(worker: Worker, tmp_path: Path) -> None:
    out = tmp_path / "out.mcap"
    request = {"do": "replay", "bag": str(ROOT / "bags" / "tabletop_sim"), "output": str(out), "params": {}}
    assert worker.ask(request).get("error") is None
    topics = [name.partition("[")[0] for name in messages(out)]
    assert {topic: topics.count(topic) for topic in topics} == dict.fromkeys(
        (f"/{output.name}" for output in OUTPUTS), 6
    )
