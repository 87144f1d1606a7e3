# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Small pictures of clouds, with outlines and numbers that distinguish regions without color."""

from __future__ import annotations

import base64
import io

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from topo_region_seg.data import BoolArray, IntArray, LabelArray

BACKDROP = 22
"""Gray level of pixels without a point."""
_SMALLEST = 0.002  # share of the picture below which a region gets no number
_DENSE = 0.25  # share of all regions' pixels that are borders from which on lines are dark shades of the regions
_QUALITIES = (82, 70, 55, 40, 25)


def small_view(picture: IntArray, side: int) -> IntArray:
    """Return the part of a picture that shows points, subsampled so that its longer side has at most `side` pixels."""
    rows, columns = np.flatnonzero((picture >= 0).any(axis=1)), np.flatnonzero((picture >= 0).any(axis=0))
    if len(rows):
        picture = picture[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    height, width = picture.shape
    factor = max(height, width) / side
    if factor <= 1.0:
        return picture
    down = (np.arange(max(1, int(height / factor))) * factor).astype(np.int64)
    across = (np.arange(max(1, int(width / factor))) * factor).astype(np.int64)
    return picture[np.ix_(down, across)]


def paint(colors: npt.NDArray[np.uint8], view: IntArray) -> npt.NDArray[np.uint8]:
    """Return the image, (H, W, 3) uint8, of a view: the row of the point at each pixel, -1 for none."""
    return np.concatenate([colors, np.full((1, 3), BACKDROP, np.uint8)])[view]


def outlined(
    image: npt.NDArray[np.uint8], labels: LabelArray, view: IntArray, names: dict[int, str] | None = None
) -> Image.Image:
    """Return the image with dark lines between regions and a number in each large region.

    Parameters
    ----------
    image : (H, W, 3) uint8
        The painted view.
    labels : (N,) uint32
        Region of every point; 0 = none.
    view : (H, W) int64
        Row of the point at each pixel, -1 for none.
    names : dict of int to str, optional
        Text in place of a label.
    """
    shown = np.concatenate([labels, np.zeros(1, labels.dtype)])[view]
    image, lines = image.copy(), _borders(shown)
    # Black lines would cover most of many small patches.
    dense = np.count_nonzero(lines & (shown > 0)) > _DENSE * np.count_nonzero(shown)
    image[lines] = image[lines] // 2 if dense else 0
    result = Image.fromarray(image)
    draw = ImageDraw.Draw(result)
    size = int(np.clip(max(shown.shape) / 34, 9, 20))
    font = ImageFont.load_default(size)
    label, count = np.unique(shown[shown > 0], return_counts=True)
    for number in label[count >= _SMALLEST * shown.size]:
        x, y = _inside(shown == number)
        text = names.get(int(number), "") if names else str(number)
        draw.text((x, y), text, fill="white", stroke_fill="black", stroke_width=2, anchor="mm", font=font)
    return result


def data_uri(image: Image.Image, budget: int) -> str:
    """Return the image as WebP in a data URI of at most `budget` characters, in lower quality or size if necessary."""
    while True:
        for quality in _QUALITIES:
            stream = io.BytesIO()
            image.save(stream, "WEBP", quality=quality, method=4)
            if stream.tell() * 4 / 3 + 30 <= budget:
                break
        else:
            if min(image.size) > 24:
                image = image.resize((image.width * 3 // 4, image.height * 3 // 4))
                continue
        return "data:image/webp;base64," + base64.b64encode(stream.getvalue()).decode("ascii")


def _borders(shown: LabelArray) -> BoolArray:
    """Return the pixels whose right or lower neighbor has another label, (H, W)."""
    border = np.zeros(shown.shape, np.bool_)
    border[:, :-1] |= shown[:, :-1] != shown[:, 1:]
    border[:-1] |= shown[:-1] != shown[1:]
    return border


def _inside(mask: BoolArray) -> tuple[float, float]:
    """Return the pixel (x, y) of a region that is nearest to its centroid: a ring has its centroid outside."""
    v, u = np.nonzero(mask)
    nearest = np.argmin((u - u.mean()) ** 2 + (v - v.mean()) ** 2)
    return float(u[nearest]), float(v[nearest])
