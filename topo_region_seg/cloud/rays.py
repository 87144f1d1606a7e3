# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The viewing rays of a camera whose images are not rectified, computed once for a camera."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.camera_info import Camera
from topo_region_seg.compiled.dialect import index, inlined, kernel
from topo_region_seg.compiled.threads import in_parts, side_by_side

STEPS = 30
EXACT = 1e-9
"""Squared error at z = 1 up to which a ray counts as found, far below a hundredth of a pixel."""
Lens = tuple[float, float, float, float, float, float, float, float]


@lru_cache(maxsize=2)
def undistorted_rays(camera: Camera, height: int, width: int) -> npt.NDArray[np.float32]:
    """Return x and y of each pixel's ray at z = 1, shape (height * width, 2), read-only; NaN where there is none."""
    rays = np.empty((height * width, 2), np.float32)
    focal = camera.fx, camera.fy, camera.cx, camera.cy
    parts = [(focal, camera.distortion, first, end, width, rays) for first, end in in_parts(height)]
    side_by_side(find_rays, parts)
    rays.flags.writeable = False
    return rays


@kernel
def find_rays(
    focal: tuple[float, float, float, float],
    lens: Lens,
    first: int,
    end: int,
    width: int,
    rays: npt.NDArray[np.float32],
) -> None:
    """Fill rays for some rows of pixels: Newton's method for the point that the lens images at the pixel.

    `focal` is fx, fy, cx, cy; `lens` k1, k2, p1, p2, k3, k4, k5, k6.
    """
    for row in range(first, end):
        for column in range(width):
            seen_x, seen_y = (column - focal[2]) / focal[0], (row - focal[3]) / focal[1]
            x, y = seen_x, seen_y
            error, turn = np.inf, 0.0
            for _ in range(STEPS):
                image_x, image_y, xx, xy, yx, yy = imaged(x, y, lens)
                off_x, off_y = seen_x - image_x, seen_y - image_y
                error = off_x * off_x + off_y * off_y
                turn = xx * yy - xy * yx
                if error < 1e-4 * EXACT * EXACT or turn == 0.0:
                    break
                x += (yy * off_x - xy * off_y) / turn
                y += (xx * off_y - yx * off_x) / turn
            # Beyond where its polynomials turn back, a lens images what no pixel really sees.
            on_its_side = x * seen_x + y * seen_y >= 0.0
            found = (error < EXACT * EXACT) & on_its_side & (turn > 0.0)
            i = index(row * width + column)
            rays[i, 0] = np.float32(x) if found else np.float32(np.nan)
            rays[i, 1] = np.float32(y) if found else np.float32(np.nan)


@inlined
def imaged(x, y, lens):  # type: ignore[no-untyped-def]
    """Return where a lens images the point (x, y) at z = 1, and its derivatives: x by x, x by y, y by x, y by y.

    OpenCV's model: radial polynomials in numerator and denominator, and tangential terms.
    """
    k1, k2, p1, p2, k3, k4, k5, k6 = lens
    r2 = x * x + y * y
    above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    radial = above / below
    by_r2 = ((k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3)) - radial * (k4 + r2 * (2.0 * k5 + 3.0 * r2 * k6))) / below
    image_x = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
    image_y = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
    xx = radial + 2.0 * x * x * by_r2 + 2.0 * p1 * y + 6.0 * p2 * x
    xy = 2.0 * x * y * by_r2 + 2.0 * p1 * x + 2.0 * p2 * y
    yx = 2.0 * x * y * by_r2 + 2.0 * p1 * x + 2.0 * p2 * y
    yy = radial + 2.0 * y * y * by_r2 + 6.0 * p1 * y + 2.0 * p2 * x
    return image_x, image_y, xx, xy, yx, yy
