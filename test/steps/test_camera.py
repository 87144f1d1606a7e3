# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Points as a camera sees them, against plain NumPy: angles, bends, and lengths that grow with the depth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from topo_region_seg.steps.view.camera import evened, grid_figures, growths, seen_from

HEIGHT, WIDTH = 6, 17


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("apart", [1, 3])
def test_angles_and_bends_are_those_of_pixels_beside_each_other(seed: int, apart: int) -> None:
    """An image with holes, of a camera that looks anywhere: nothing is measured across a hole or the image's edge."""
    rng = np.random.default_rng(seed)
    axes = Rotation.random(random_state=seed).as_matrix()
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH] * (0.01, 0.012)[seed % 2] + rng.normal(0.0, 1e-3, (2, HEIGHT, WIDTH))
    depth = rng.uniform(0.5, 3.0, (HEIGHT, WIDTH))
    there = rng.random((HEIGHT, WIDTH)) < (1.0, 0.85)[seed % 2]
    image = np.stack([u, v, np.ones_like(u)], axis=-1)
    xyz = np.ascontiguousarray((image * depth[..., None]) @ axes)[there]
    angles, bends = grid_figures(xyz, np.flatnonzero(there), WIDTH, axes, apart, 1)
    beside = there[:, :-1] & there[:, 1:]
    wanted = np.hypot(np.diff(u, axis=1), np.diff(v, axis=1))[beside]
    np.testing.assert_allclose(angles, wanted, rtol=1e-9)
    length = 2 * apart
    whole = np.lib.stride_tricks.sliding_window_view(there, length + 1, axis=1).all(axis=2)
    inverse = 1.0 / depth
    steps = inverse[:, :-length] - 2.0 * inverse[:, apart:-apart] + inverse[:, length:]
    np.testing.assert_allclose(bends, np.abs(steps)[whole], rtol=1e-9, atol=1e-12)
    some, _ = grid_figures(xyz, np.flatnonzero(there), WIDTH, axes, apart, 5)
    assert np.isin(np.round(some, 12), np.round(angles, 12)).all() and 0 < len(some) <= len(xyz) // 5 + 1


@pytest.mark.parametrize("seed", range(4))
def test_lengths_grow_with_the_depth_beyond_the_middle_and_nothing_jumps_there(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axes = Rotation.random(random_state=seed).as_matrix()
    image = np.column_stack([rng.uniform(-0.5, 0.5, (300, 2)), np.ones(300)])
    z = np.concatenate([rng.uniform(0.1, 9.0, 298), [2.0, 2.0 + 1e-9]])
    image[-1] = image[-2]
    seen = image * z[:, None]
    xyz = np.ascontiguousarray(seen @ axes)
    np.testing.assert_allclose(seen_from(xyz, axes), seen, atol=1e-12)
    np.testing.assert_allclose(growths(xyz, axes[2], 2.0, 0.5), np.maximum(z / 2.0, 0.5))
    even = evened(xyz, axes, 2.0)
    far = z > 2.0
    wanted = np.where(far[:, None], np.column_stack([2.0 * image[:, :2], 2.0 + 2.0 * np.log(z / 2.0)]), seen)
    np.testing.assert_allclose(even, wanted, atol=1e-12)
    assert np.abs(even[-1] - even[-2]).max() < 1e-8
