# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Colors of labels: distinct, stable, and dark gray for no region."""

from __future__ import annotations

import hashlib

import numpy as np
import numpy.typing as npt
import pytest

from topo_region_seg.cloud.label_colors import SIZE, UNLABELED, colors, palette

# Machado, Oliveira and Fernandes (2009), severity 1.0, on linear RGB.
PROTANOPIA = np.array(
    [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
)
DEUTERANOPIA = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
)
SRGB_TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def seen(srgb: npt.NDArray[np.uint8], vision: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """CIELAB (D65) of 8-bit colors (N, 3) as seen through a matrix on linear RGB."""
    value = srgb / 255.0
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    xyz = np.clip(linear @ vision.T, 0.0, 1.0) @ SRGB_TO_XYZ.T / [0.95047, 1.0, 1.08883]
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)


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


def test_labels_keep_their_colors_over_versions() -> None:
    wanted = "093d459833753a51642dc5664361ea7a2bcfccd50d37d72cb7b0f7f96823fc69"
    assert hashlib.sha256(palette().tobytes()).hexdigest() == wanted


@pytest.mark.parametrize(
    ("vision", "first", "all_of_them"),
    [(np.eye(3), 28.0, 12.5), (PROTANOPIA, 15.5, 6.5), (DEUTERANOPIA, 15.5, 6.5)],
    ids=["normal", "protan", "deutan"],
)
def test_colors_are_far_apart_for_every_kind_of_vision(vision: np.ndarray, first: float, all_of_them: float) -> None:
    """CIE76 differences; about 2.3 can just be told apart side by side."""
    lab = seen(palette(), vision)
    apart = np.linalg.norm(lab[:, None] - lab[None], axis=-1) + 1e3 * np.eye(len(lab))
    assert apart[:17, :17].min() > first
    assert apart.min() > all_of_them


def test_no_color_is_gray_or_too_dark_or_too_light_to_be_seen_on_paper() -> None:
    lightness, a, b = seen(palette()[1:], np.eye(3)).T
    assert np.hypot(a, b).min() > 29
    assert 41 < lightness.min() < lightness.max() < 93
