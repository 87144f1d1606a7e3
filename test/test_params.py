# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of parameters."""

from __future__ import annotations

import copy
import dataclasses
import math
import pickle
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from places import TEST

from topo_region_seg.parameter_table import ParameterError, Row
from topo_region_seg.params import Params
from topo_region_seg.ros.node_params import NodeParams


def test_every_field_is_a_row_with_a_meaning_and_bounds() -> None:
    rows = Params.table()
    assert [row.name for row in rows] == [field.name for field in dataclasses.fields(Params)]
    for row in rows:
        assert row.spec.doc
        if row.type in (int, float):
            assert row.spec.low is not None
            assert row.spec.high is not None
            assert row.default in row.spec.words or row.spec.low <= row.default <= row.spec.high


def test_the_fixed_names_and_values() -> None:
    params = Params()
    assert (params.max_radius, params.filtration_steps, params.features) == ("auto", 10, "color+normals")
    assert (params.color_threshold, params.angle_threshold) == (10.0, 5.0)
    assert (params.min_region_size, params.small_regions) == (64, "merge")


def test_auto_is_a_word_that_number_formats_leave_as_it_is() -> None:
    """Whoever prints lengths does not fail on it; whoever writes files gets plain text."""
    params = Params.from_mapping({"max_radius": "auto"})
    assert f"{params.max_radius:.4f} {params.max_radius:6}|" == "auto auto  |" and repr(params.max_radius) == "'auto'"
    written = params.as_dict()["max_radius"]
    assert written == "auto" and type(written) is str
    for same in (copy.deepcopy(params), pickle.loads(pickle.dumps(params)), Params(**dataclasses.asdict(params))):
        assert same == params and f"{same.max_radius:.4f}" == "auto"


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("max_radius", math.nan, "max_radius = nan: must be a finite number"),
        ("max_radius", -1.0, "max_radius = -1.0: must be at least 1e-06 m"),
        ("max_radius", "0.02", "max_radius = '0.02': must be a number"),
        ("max_radius", True, "max_radius = True: must be a number"),
        ("filtration_steps", 2.5, "filtration_steps = 2.5: must be a whole number"),
        ("filtration_steps", 0, "filtration_steps = 0: must be at least 1"),
        ("features", "colour", "features = 'colour': must be one of color+normals, color, normals"),
        ("remove_floor", 1, "remove_floor = 1: must be true or false"),
        ("crop_box", [1.0, 2.0], "crop_box = [1.0, 2.0]: must have 0 or 6 numbers, has 2"),
        ("crop_box", [0, 0, 0, 1, 1, 0], "each minimum must be less than its maximum"),
        ("crop_box", [0, 0, 0, 1, 1, math.inf], "must be finite numbers"),
        ("crop_box", 3.0, "must be a list of 0 or 6 numbers"),
        ("min_color_threshold", 11.0, r"min_color_threshold (11.0) is greater than color_threshold (10.0)"),
        ("min_range", 11.0, r"min_range (11.0) is greater than max_range (10.0)"),
        ("max_radios", 1.0, "unknown parameter 'max_radios'"),
    ],
)
def test_bad_values_are_named_with_the_reason(name: str, value: object, reason: str) -> None:
    with pytest.raises(ParameterError) as error:
        Params().replace(**{name: value})
    assert reason in str(error.value)
    assert "\n" not in str(error.value)


def test_values_come_in_the_row_s_own_type() -> None:
    params = Params(
        max_radius=1, filtration_steps=np.int64(5), crop_box=[0, 0, 0, 1, 1, 1], angle_threshold=np.float32(4)
    )
    assert type(params.max_radius) is float
    assert type(params.filtration_steps) is int
    assert params.crop_box == (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
    assert type(params.angle_threshold) is float


@given(
    st.sampled_from([row.name for row in Params.table()]),
    st.one_of(st.floats(), st.integers(), st.text(), st.none(), st.binary(), st.lists(st.floats(), max_size=7)),
)
def test_anything_is_taken_or_refused(name: str, value: object) -> None:
    try:
        params = Params().replace(**{name: value})
    except ParameterError as error:
        assert name in str(error)
    else:
        assert Params.from_mapping(params.as_dict()) == params


@pytest.mark.parametrize("name", ["mode", "level"])
def test_names_of_former_versions_lead_to_the_new_one(name: str) -> None:
    with pytest.raises(ParameterError, match=rf"unknown parameter '{name}'; write 'output' \(regions, objects or"):
        Params.from_mapping({name: "objects"})


@pytest.mark.parametrize(
    ("changes", "cause"),
    [
        ({"output": "objects", "max_radius": 0.03}, "output = objects"),
        ({"output": "objects", "color_threshold": 3.0}, "output = objects"),
        ({"output": "supervoxels", "object_radius": 0.02}, "output = supervoxels"),
        ({"seed_spacing": 0.05}, "output = regions"),
        ({"features": "normals", "color_threshold": 3.0}, "features = normals"),
        ({"features": "color", "normal_min_neighbors": 9}, "features = color"),
        ({"remove_floor": False, "floor_seed": 3}, "remove_floor = false"),
        ({"hold_regions": True}, "track_regions = false"),
        ({"output": "objects", "remove_floor": False, "object_floor_distance": 0.01}, "remove_floor = false"),
    ],
)
def test_values_without_effect_are_named_with_their_cause(changes: dict[str, object], cause: str) -> None:
    name = list(changes)[-1]
    assert Params.from_mapping(changes).without_effect() == {name: cause}


def test_values_with_an_effect_are_not_named() -> None:
    for changes in ({"max_radius": 0.03}, {"output": "supervoxels", "seed_spacing": 0.05, "max_radius": 0.01}):
        assert Params.from_mapping(changes).without_effect() == {}
    objects = Params(output="objects", object_radius=0.02, normal_min_neighbors=9, min_region_size=100)
    assert objects.without_effect() == {}


def _another(row: Row) -> object:
    low, high, default = row.spec.low, row.spec.high, row.default
    if row.type is bool:
        return not default
    if row.spec.choices:
        return next(choice for choice in row.spec.choices if choice != default)
    assert low is not None and high is not None
    return (
        low
        if default != low and row.name not in ("color_threshold", "angle_threshold")
        else type(default)(min(high, 1.0))
    )


def test_every_parameter_with_a_condition_is_ineffective_somewhere_and_effective_elsewhere() -> None:
    settings = [
        Params(output=output, features=features, remove_floor=floor, track_regions=tracked)
        for output in ("regions", "objects", "supervoxels")
        for features in ("color+normals", "color", "normals")
        for floor in (True, False)
        for tracked in (True, False)
    ]
    for row in Params.table():
        if not row.spec.when or row.name in ("features", "output"):
            continue
        other = 0.01 if row.name == "radius" else _another(row)
        effect = {row.name in dataclasses.replace(p, **{row.name: other}).without_effect() for p in settings}
        assert effect == {True, False}, row.name


def test_every_parameter_is_named_in_a_test() -> None:
    """Of its own accord: not in a list of all of them."""
    tests = "".join(path.read_text(encoding="utf-8") for path in TEST.rglob("test_*.py"))
    for row in (*Params.table(), *NodeParams.table()):
        assert re.search(rf"\b{row.name}\b", tests), f"no test names {row.name}"
