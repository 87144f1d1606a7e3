# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames that leave much to do: made ones of any size, and those of other cameras in ../shared where these are."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

import topo_region_seg as trs

SCENES = Path(__file__).resolve().parents[2] / "shared" / "data" / "scenes"
FOCAL = 0.89  # focal length in widths of the image: a 640 pixel camera that sees 59 degrees
FloatArray = npt.NDArray[np.float64]
ColorArray = npt.NDArray[np.uint8]


def room(width: int, height: int) -> trs.Cloud:
    """Floor, back wall, side wall and a chest at 2 to 4 m, with the noise of a stereo camera."""
    return _room(width, height, 0.0015)


def exact_room(width: int, height: int) -> trs.Cloud:
    """Make the same room without noise."""
    return _room(width, height, 0.0)


def _room(width: int, height: int, noise: float) -> trs.Cloud:
    rng, rays = np.random.default_rng(1), _rays(width, height)
    depths = np.stack(
        [
            _plane(rays, (0.0, 1.0, 0.0), 1.1),
            _plane(rays, (0.0, 0.0, 1.0), 3.8),
            _plane(rays, (1.0, 0.0, 0.3), 2.0),
            _plane(rays, (0.0, 0.8, 0.6), 2.0, within=(-0.7, 0.6)),
        ]
    )
    part, depth = depths.argmin(axis=0), depths.min(axis=0)
    paint = np.array([[120, 95, 70], [190, 190, 180], [170, 180, 190], [80, 90, 140]])[part]
    depth = depth + noise * rng.normal(size=depth.shape) * depth**2
    return _cloud(rays * depth[..., None], paint + rng.normal(0.0, 4.0, paint.shape))


def noise(width: int, height: int) -> trs.Cloud:
    """Every pixel at a depth and of a color of its own."""
    rng, rays = np.random.default_rng(2), _rays(width, height)
    return _cloud(rays * rng.uniform(0.5, 4.0, (height, width, 1)), rng.integers(0, 256, rays.shape))


def checkerboard(width: int, height: int) -> trs.Cloud:
    """Two slanted walls whose color changes from pixel to pixel."""
    rng, rays = np.random.default_rng(3), _rays(width, height)
    depth = np.minimum(_plane(rays, (0.6, 0.0, 0.8), 0.9), _plane(rays, (-0.6, 0.0, 0.8), 0.9))
    black = np.indices((height, width)).sum(axis=0) % 2
    depth = depth + 0.0005 * rng.normal(size=depth.shape)
    return _cloud(rays * depth[..., None], np.repeat(np.where(black, 40, 220)[..., None], 3, axis=2))


def sponge(width: int, height: int) -> trs.Cloud:
    """Make a block full of holes of all sizes, some of them very deep."""
    rng, rays = np.random.default_rng(4), _rays(width, height)
    depth = np.full((height, width), 0.8)
    rows, columns = np.indices((height, width))
    for size in (2, 3, 5, 9, 17):
        deep = rng.exponential(0.03, (height // size + 1, width // size + 1))
        hole = rng.random(deep.shape) < 0.3
        depth += (deep * hole)[rows // size, columns // size]
    depth += 0.001 * rng.normal(size=depth.shape)
    return _cloud(rays * depth[..., None], 120 + 20 * rng.normal(size=rays.shape))


def clutter(width: int, height: int) -> trs.Cloud:
    """As many points anywhere in a box of 2 m, of two colors, as a list."""
    rng = np.random.default_rng(5)
    xyz = rng.uniform([-1.0, -1.0, 1.0], [1.0, 1.0, 3.0], (1, width * height, 3))
    return _cloud(xyz, 60 + 120 * rng.integers(0, 2, (1, width * height, 1)) + np.zeros(3))


def egg_box(width: int, height: int) -> trs.Cloud:
    """Thousands of small facets."""
    rays = _rays(width, height)
    rows, columns = np.indices((height, width)) / 8.0
    depth = 0.8 + 0.03 * (np.abs(rows % 1 - 0.5) + np.abs(columns % 1 - 0.5))
    return _cloud(rays * depth[..., None], np.full(rays.shape, 128))


MADE: dict[str, Callable[[int, int], trs.Cloud]] = {
    "room with stereo noise": room,
    "room": exact_room,
    "noise": noise,
    "checkerboard": checkerboard,
    "sponge": sponge,
    "uniform clutter": clutter,
    "egg box": egg_box,
}


def scenes(folder: Path | None = None) -> Iterator[tuple[str, trs.Cloud]]:
    """Yield name and cloud of each .npz file (depth, its scale, K, rgb) in a folder, or SCENES; none without it."""
    for file in sorted((folder or SCENES).glob("*.npz")):
        with np.load(file) as frame:
            depth, matrix = frame["depth"] / float(frame["depth_scale"]), frame["K"]
            rows, columns = np.indices(depth.shape)
            depth = np.where(depth > 0.0, depth, np.nan)
            x = (columns - matrix[0, 2]) / matrix[0, 0]
            y = (rows - matrix[1, 2]) / matrix[1, 1]
            yield file.stem, _cloud(np.stack([x, y, np.ones_like(x)], axis=-1) * depth[..., None], frame["rgb"])


def _rays(width: int, height: int) -> FloatArray:
    """Return the direction of each pixel, of depth 1, (H, W, 3)."""
    rows, columns = np.indices((height, width))
    x, y = (columns - width / 2 + 0.5) / (FOCAL * width), (rows - height / 2 + 0.5) / (FOCAL * width)
    return np.stack([x, y, np.ones_like(x)], axis=-1)


def _plane(
    rays: FloatArray, normal: tuple[float, float, float], offset: float, within: tuple[float, float] | None = None
) -> FloatArray:
    """Return the depth (H, W) at which rays meet a plane, or the part between two x; far away where they do not."""
    along = rays @ np.array(normal)
    depth = np.where(along > 1e-6, offset / np.maximum(along, 1e-6), 1e6)
    if within is not None:
        x = rays[..., 0] * depth
        depth = np.where((x > within[0]) & (x < within[1]) & (rays[..., 1] > 0.1), depth, 1e6)
    return depth


def _cloud(xyz: FloatArray, rgb: npt.NDArray[np.generic]) -> trs.Cloud:
    height, width = xyz.shape[:2]
    colors = np.clip(np.asarray(rgb, np.float64), 0, 255).astype(np.uint8)
    return trs.Cloud(xyz.reshape(-1, 3).astype(np.float32), colors.reshape(-1, 3), height, width)
