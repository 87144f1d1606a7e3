# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Colors of labels: distinct, stable, and dark gray for no region."""

from __future__ import annotations

import numpy as np

from topo_region_seg.cloud.label_colors import SIZE, UNLABELED, colors, palette


def test_no_region_is_dark_gray_and_nothing_else_is() -> None:
    assert colors([0]).tolist() == [list(UNLABELED)]
    used = colors(np.arange(1, 10 * SIZE, dtype=np.uint32)).astype(int)
    assert np.abs(used - UNLABELED).max(axis=1).min() > 40


def test_every_label_of_a_cycle_has_its_own_color_then_they_repeat() -> None:
    labels = np.arange(1, 2 * SIZE + 1, dtype=np.uint32)
    given = colors(labels)
    assert len(np.unique(given[:SIZE], axis=0)) == SIZE
    np.testing.assert_array_equal(given[:SIZE], given[SIZE:])
    np.testing.assert_array_equal(given[:SIZE], palette()[1:])


def test_shape_and_type_for_any_integers() -> None:
    for labels in ([], [7], np.array([2**32 - 1], dtype=np.uint32), np.arange(5, dtype=np.int64)):
        given = colors(labels)
        assert given.shape == (len(labels), 3)
        assert given.dtype == np.uint8


def test_first_colors_are_far_apart() -> None:
    first = palette()[:17].astype(float)
    apart = np.linalg.norm(first[:, None] - first[None], axis=-1) + 1e3 * np.eye(len(first))
    assert apart.min() > 40
