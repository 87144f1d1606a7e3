# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The pixels of sensor_msgs/Image and CompressedImage, checked before anything is allocated.

Depth and color are taken as `depth_image_proc` takes them; names of encodings are those of
``sensor_msgs/image_encodings``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.buffers import bytes_of
from topo_region_seg.cloud.compressed_images import compressed_color, compressed_depth, is_compressed
from topo_region_seg.cloud.layout import CloudFormatError, Warn, check_points, check_stamp
from topo_region_seg.cloud.pixels import read_colors
from topo_region_seg.compiled.threads import in_parts, side_by_side

DEPTHS = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4"}
"""NumPy type of each encoding of depth: millimetres as whole numbers, metres as floats."""


@dataclass(frozen=True)
class _Color:
    """Where red, green and blue lie in a pixel, in values, and the bytes of a value."""

    channels: int
    places: tuple[int, int, int]
    bytes: int = 1


COLORS = {
    "rgb8": _Color(3, (0, 1, 2)),
    "bgr8": _Color(3, (2, 1, 0)),
    "8UC3": _Color(3, (2, 1, 0)),
    "rgba8": _Color(4, (0, 1, 2)),
    "bgra8": _Color(4, (2, 1, 0)),
    "8UC4": _Color(4, (2, 1, 0)),
    "mono8": _Color(1, (0, 0, 0)),
    "8UC1": _Color(1, (0, 0, 0)),
    "rgb16": _Color(3, (0, 1, 2), 2),
    "bgr16": _Color(3, (2, 1, 0), 2),
    "rgba16": _Color(4, (0, 1, 2), 2),
    "bgra16": _Color(4, (2, 1, 0), 2),
    "mono16": _Color(1, (0, 0, 0), 2),
}


@dataclass(frozen=True)
class DepthPixels:
    """The depth of every pixel, row by row.

    Parameters
    ----------
    values : (M,) uint16 or float32
        Millimetres or metres; read-only.
    height, width : int
        Size of the image, pixels.
    stride : int
        From a row to the next one, in values.
    """

    values: npt.NDArray[np.uint16] | npt.NDArray[np.float32]
    height: int
    width: int
    stride: int


def depth_pixels(msg: Any, *, max_points: int, warn: Warn) -> DepthPixels:
    """Return the depth of an Image, or of a CompressedImage of `compressedDepth`.

    Raises
    ------
    CloudFormatError
        The message contradicts itself, is no depth image, or is too large.
    """
    check_stamp(msg)
    if is_compressed(msg):
        values = compressed_depth(msg, max_points=max_points)
        height, width = values.shape
        return DepthPixels(read_only(values.reshape(-1)), height, width, width)
    encoding = str(msg.encoding)
    if encoding not in DEPTHS:
        raise CloudFormatError(
            "depth_encoding", f"encoding of the depth image is '{encoding[:40]}', not one of {', '.join(DEPTHS)}"
        )
    kind = np.dtype(DEPTHS[encoding])
    buffer = bytes_of(msg.data)
    height, width, step = _size(msg, buffer.nbytes, kind.itemsize, max_points, warn)
    if height * width == 0:
        return DepthPixels(read_only(np.empty(0, kind)), height, width, width)
    pixels = np.ndarray((height, width), kind.newbyteorder(_order(msg)), buffer, 0, (step, kind.itemsize))
    if not pixels.dtype.isnative or not pixels.flags.aligned or step % kind.itemsize:
        return DepthPixels(read_only(np.array(pixels, kind, order="C").reshape(-1)), height, width, width)
    in_use = (height - 1) * step + width * kind.itemsize
    return DepthPixels(read_only(buffer[:in_use].view(kind)), height, width, step // kind.itemsize)


def color_pixels(msg: Any, height: int, width: int, *, max_points: int, warn: Warn) -> npt.NDArray[np.uint8]:
    """Return the colors (N, 3) of an Image, or of a CompressedImage of JPEG or PNG, as large as the depth image.

    Raises
    ------
    CloudFormatError
        The message contradicts itself, is no color image, or of another size than `height` x `width`.
    """
    check_stamp(msg)
    if is_compressed(msg):
        packed = compressed_color(msg, max_points=max_points)
        _check_same_size(packed.shape[0], packed.shape[1], height, width)
        return packed.reshape(-1, 3)
    encoding = str(msg.encoding)
    if encoding not in COLORS:
        raise CloudFormatError(
            "color_encoding", f"encoding of the color image is '{encoding[:40]}', not one of {', '.join(COLORS)}"
        )
    color = COLORS[encoding]
    _check_same_size(int(msg.height), int(msg.width), height, width)
    buffer = bytes_of(msg.data)
    pixel = color.channels * color.bytes
    *_, step = _size(msg, buffer.nbytes, pixel, max_points, warn)
    rgb = np.empty((height * width, 3), np.uint8)
    # Of 16 bits the upper byte: right for 8 bits that were shifted as well as for those that were repeated.
    upper = color.bytes - 1 if _order(msg) == "<" else 0
    red, green, blue = (place * color.bytes + upper for place in color.places)
    buffer = read_only(buffer)
    parts = [(buffer, first, end, width, step, pixel, (red, green, blue), rgb) for first, end in in_parts(height, 4)]
    if height * width:
        side_by_side(read_colors, parts)
    return rgb


def _order(msg: Any) -> Literal["<", ">"]:
    return ">" if msg.is_bigendian else "<"


def read_only(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return a view that cannot be written: kernels would be compiled twice, for either kind."""
    values = values.view()
    values.flags.writeable = False
    return values


def _size(msg: Any, size: int, pixel: int, max_points: int, warn: Warn) -> tuple[int, int, int]:
    """Return height, width and the stride of rows in bytes of an image whose pixels have `pixel` bytes."""
    height, width, step = int(msg.height), int(msg.width), int(msg.step)
    check_points(height, width, max_points)
    if height * width == 0:
        return height, width, 0
    packed = width * pixel
    if step < packed and size == height * packed:
        warn("stale_step", f"step is {step}, but rows are packed in {packed} bytes; read as packed")
        step = packed
    if step < packed:
        raise CloudFormatError("step_too_small", f"step {step} is less than {width} pixels of {pixel} bytes")
    needed = (height - 1) * step + packed
    if size < needed:
        raise CloudFormatError("data_too_short", f"{size} bytes of data, {needed} needed for {width} x {height} pixels")
    if size > height * step:
        warn("data_too_long", f"{size} bytes of data, {height * step} needed; the rest is ignored")
    return height, width, step


def _check_same_size(height: int, width: int, wanted_height: int, wanted_width: int) -> None:
    if (height, width) != (wanted_height, wanted_width):
        raise CloudFormatError(
            "color_size",
            f"the color image has {width} x {height} pixels, the depth image {wanted_width} x {wanted_height}; "
            "subscribe to images that the driver has registered (aligned) to each other",
        )
