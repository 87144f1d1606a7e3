# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The order of numbers by counting, against numpy's stable sort."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from topo_region_seg.compiled.order import order_of

RNG = np.random.default_rng(0)
KINDS = {
    "even": RNG.random(5_000),
    "few": RNG.random(3),
    "normal": RNG.normal(size=5_000),
    "of all scales": np.exp(30.0 * RNG.normal(size=5_000)),
    "equal ones": RNG.integers(0, 20, 5_000).astype(float),
    "one": np.ones(500),
    "crowded": np.append(RNG.random(3_000), 1e9),
    "beyond a number": np.array([1e308, -1e308, 0.0, 1.0]),
    "none": np.empty(0),
    "hardly apart": 1.0 + np.arange(1_000) % 3 * 2.0**-52,
    "least numbers": np.array([0.0, 5e-324, 0.0, 1e-323]),
}


@pytest.mark.parametrize("values", KINDS.values(), ids=KINDS)
def test_numbers_rise_and_equal_ones_stay_as_they_are(values: npt.NDArray[np.float64]) -> None:
    np.testing.assert_array_equal(order_of(values), np.argsort(values, kind="stable"))


@settings(max_examples=200, deadline=None)
@given(arrays(np.float64, st.integers(0, 60), elements=st.floats(width=16, allow_nan=False)))
def test_any_numbers_rise(values: npt.NDArray[np.float64]) -> None:
    np.testing.assert_array_equal(order_of(values), np.argsort(values, kind="stable"))


def test_what_is_no_number_comes_last() -> None:
    values = np.array([np.nan, 2.0, np.nan, -np.inf, 1.0, np.inf])
    assert order_of(values)[:4].tolist() == [3, 4, 1, 5]
