# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Trees whose points are in a given order, and trees whose points have moved."""

from __future__ import annotations

import numpy as np
import pytest

from topo_region_seg.compiled.kd_tree import Tree, moved_tree, ordered_tree, position_tree
from topo_region_seg.data import FloatArray


def points(n: int) -> FloatArray:
    return np.random.default_rng(n).normal(size=(n, 3))


def check_boxes(tree: Tree, xyz: FloatArray) -> None:
    for node in range(len(tree.start)):
        rows = tree.order[tree.start[node] : tree.stop[node]]
        lower, upper = tree.boxes[0, node, :, :3]
        assert (lower <= xyz[rows]).all() and (upper >= xyz[rows]).all()
        np.testing.assert_allclose(lower, xyz[rows].min(axis=0), rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(upper, xyz[rows].max(axis=0), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("n", [0, 1, 8, 9, 16, 17, 100, 777])
def test_the_nodes_of_an_order_are_those_of_any_tree(n: int) -> None:
    xyz, order = points(n), np.random.default_rng(0).permutation(n).astype(np.int32)
    tree, usual = ordered_tree(order, xyz), position_tree(xyz)
    np.testing.assert_array_equal(tree.order, order)
    for field in ("start", "stop", "right"):
        np.testing.assert_array_equal(getattr(tree, field), getattr(usual, field))
    check_boxes(tree, xyz)


@pytest.mark.parametrize("n", [0, 1, 8, 100])
def test_where_points_moved_boxes_follow_and_nothing_else(n: int) -> None:
    xyz = points(n)
    tree, moved = position_tree(xyz), 3.0 * xyz + 1.0
    again = moved_tree(tree, moved)
    np.testing.assert_array_equal(again.order, tree.order)
    check_boxes(again, moved)
    check_boxes(tree, xyz)
