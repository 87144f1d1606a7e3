# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameter files for kinds of scenes: every value known, in range, of ROS's type, and of use."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import permutations
from typing import Any

import pytest
import yaml
from places import ROOT

from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.ros.node_params import NodeParams

FOLDER = ROOT / "config"
SCENES = sorted(path.name for path in FOLDER.glob("*.yaml") if path.name != "region_segmentation.yaml")


def values_of(name: str) -> dict[str, Any]:
    content = yaml.safe_load((FOLDER / name).read_text(encoding="utf-8"))
    assert list(content) == ["/**"] and list(content["/**"]) == ["ros__parameters"]
    return dict(content["/**"]["ros__parameters"])


def params_of(name: str) -> Params:
    known = {row.name for row in Params.table()}
    return Params.from_mapping({key: value for key, value in values_of(name).items() if key in known})


def test_there_is_a_file_for_each_kind_of_scene() -> None:
    assert SCENES == ["large_objects.yaml", "room.yaml", "tabletop.yaml"]


@pytest.mark.parametrize("name", SCENES)
def test_every_value_is_known_in_range_and_of_the_type_that_ros_wants(name: str) -> None:
    rows = {row.name: row for row in (*Params.table(), *NodeParams.table())}
    values = values_of(name)
    assert set(values) <= set(rows)
    numbers = {key: value for key, value in values.items() if value not in rows[key].spec.words}
    assert {key: type(value) for key, value in numbers.items()} == {key: rows[key].type for key in numbers}
    params = params_of(name)
    # Normals and graph need several points within their radii.
    assert params.normal_radius >= 2 * params.voxel_size
    assert params.max_radius == "auto" or params.max_radius >= 3 * params.voxel_size


def test_each_file_names_all_that_any_other_does() -> None:
    names = {name: list(values_of(name)) for name in SCENES}
    assert all(given == names[SCENES[0]] for given in names.values()), "in the same order"


@pytest.mark.parametrize("order", [list, sorted, reversed], ids=["as written", "sorted", "reversed"])
@pytest.mark.parametrize(("first", "second"), list(permutations(SCENES, 2)))
def test_one_loaded_after_another_leaves_no_trace_of_it(
    first: str, second: str, order: Callable[[Iterable[str]], Iterable[str]]
) -> None:
    params = params_of(first)
    values = values_of(second)
    for name in order(values):  # one by one, as `ros2 param load` sets them: each step must be valid
        params = params.replace(**{name: values[name]})
    assert params == params_of(second)


@pytest.mark.parametrize("name", SCENES)
def test_it_segments_a_tabletop(name: str) -> None:
    cloud = simulate(tabletop(3), Camera.kinect(320, 240), seed=3).cloud
    seg = Pipeline(params_of(name)).run(cloud)
    assert 3 <= len(seg.regions) <= 60
    assert (seg.plane is not None) == seg.params.remove_floor
