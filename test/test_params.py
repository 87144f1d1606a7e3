# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of parameters."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from topo_region_seg.params import ParameterError, Params


def test_every_field_is_a_row_with_a_meaning_and_bounds() -> None:
    rows = Params.table()
    assert [row.name for row in rows] == [field.name for field in dataclasses.fields(Params)]
    for row in rows:
        assert row.spec.doc
        if row.type in (int, float):
            assert row.spec.low is not None
            assert row.spec.high is not None
            assert row.spec.low <= row.default <= row.spec.high


def test_the_fixed_names_and_values() -> None:
    params = Params()
    assert (params.max_radius, params.filtration_steps, params.features) == (0.02, 10, "color+normals")
    assert (params.color_threshold, params.angle_threshold) == (10.0, 5.0)
    assert (params.min_region_size, params.small_regions) == (64, "merge")


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
