# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A sample is of the wanted size, fair, and that of the points whatever their order."""

from __future__ import annotations

import numpy as np
import pytest

from topo_region_seg.compiled.sampling import sample_rows


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("n", "size"), [(5000, 500), (5000, 50), (20_000, 10_000)])
def test_it_has_the_wanted_size_and_takes_from_everywhere(n: int, size: int, seed: int) -> None:
    """Within five standard deviations of what chance gives, of all points and of those on one side."""
    xyz = np.random.default_rng(seed).normal(size=(n, 3))
    rows = sample_rows(xyz, size, seed)
    assert len(np.unique(rows)) == len(rows)
    for taken, expected in ((len(rows), size), (np.count_nonzero(xyz[rows, 0] > 0.0), size / 2)):
        assert abs(taken - expected) < 5.0 * np.sqrt(expected)


@pytest.mark.parametrize("seed", range(4))
def test_it_does_not_depend_on_the_order_of_the_points_and_a_smaller_one_begins_a_larger(seed: int) -> None:
    rng = np.random.default_rng(seed)
    xyz = rng.normal(size=(3000, 3))
    rows, order = sample_rows(xyz, 300, seed), rng.permutation(3000)
    np.testing.assert_array_equal(xyz[order][sample_rows(xyz[order], 300, seed)], xyz[rows])
    small = sample_rows(xyz, 30, seed)
    np.testing.assert_array_equal(small, rows[: len(small)])
    assert not np.array_equal(sample_rows(xyz, 300, seed + 1), rows)


@pytest.mark.parametrize("n", [0, 1, 100])
def test_of_few_points_all_are_taken(n: int) -> None:
    xyz = np.random.default_rng(0).normal(size=(n, 3))
    for size in (n, n + 1, 10 * n + 1):
        np.testing.assert_array_equal(np.sort(sample_rows(xyz, size, 0)), np.arange(n))


def test_points_that_differ_in_any_coordinate_are_drawn_apart() -> None:
    for axis in range(3):
        xyz = np.zeros((4000, 3))
        xyz[:, axis] = np.linspace(1.0, 2.0, 4000)
        assert abs(len(sample_rows(xyz, 400, 0)) - 400) < 100
