# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth images, color images and camera_info for tests, and the cloud that depth_image_proc makes of them."""

from __future__ import annotations

import io
import struct
from typing import Any

import numpy as np
from clouds import header

from topo_region_seg.offline.bags.types import typestore

KINDS = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4"}
CHANNELS = {"rgb8": "rgb", "bgr8": "bgr", "rgba8": "rgba", "bgra8": "bgra", "mono8": "m"}


def types(name: str) -> Any:
    return typestore().types[f"sensor_msgs/msg/{name}"]


def image(
    pixels: np.ndarray, encoding: str, *, big_endian: bool = False, padding: int = 0, sec: int = 1, nanosec: int = 2
) -> Any:
    """Pixels (H, W) or (H, W, C), laid out row by row, each followed by rubbish."""
    pixels = pixels.astype(pixels.dtype.newbyteorder(">" if big_endian else "<"))
    height, width = pixels.shape[:2]
    rows = b"".join(row.tobytes() + b"\xa5" * padding for row in pixels)
    return types("Image")(
        header=header(sec, nanosec),
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=int(big_endian),
        step=(len(rows) // height if height else 0),
        data=np.frombuffer(rows, np.uint8),
    )


def depth_image(depth: np.ndarray, encoding: str = "16UC1", **more: Any) -> Any:
    """Depth in units of the encoding: mm or m."""
    return image(depth.astype(KINDS[encoding]), encoding, **more)


def color_image(rgb: np.ndarray, encoding: str = "rgb8", **more: Any) -> Any:
    """Colors (H, W, 3); a gray image has their red."""
    planes = {"r": rgb[..., 0], "g": rgb[..., 1], "b": rgb[..., 2], "a": np.full(rgb.shape[:2], 0x5A), "m": rgb[..., 0]}
    pixels = np.stack([planes[channel] for channel in CHANNELS[encoding]], axis=-1)
    return image(pixels.astype(np.uint8), encoding, **more)


def packed_depth(depth: np.ndarray, quantum: float | None = None, far: float = 10.0) -> Any:
    """A CompressedImage as compressedDepth makes it: millimetres, or where `quantum` is given metres in quanta."""
    from PIL import Image

    a, b = 0.0, 0.0
    if quantum is None:
        values = depth.astype(np.uint16)
    else:
        a = quantum * (quantum + 1.0)
        b = 1.0 - a / far
        with np.errstate(divide="ignore", invalid="ignore"):
            values = np.where(depth < far, a / depth + b, 0.0).astype(np.uint16)
    file = io.BytesIO()
    Image.fromarray(values).save(file, "PNG")
    encoding = "16UC1" if quantum is None else "32FC1"
    data = struct.pack("<iff", 0, a, b) + file.getvalue()
    return compressed(data, f"{encoding}; compressedDepth png")


def compressed(data: bytes, form: str) -> Any:
    return types("CompressedImage")(header=header(), format=form, data=np.frombuffer(data, np.uint8))


def camera_info(
    height: int,
    width: int,
    *,
    fx: float = 525.0,
    fy: float = 520.0,
    cx: float = 319.5,
    cy: float = 239.5,
    d: tuple[float, ...] = (),
    model: str = "plumb_bob",
    binning: tuple[int, int] = (0, 0),
    roi: tuple[int, int, int, int] = (0, 0, 0, 0),
    p: tuple[float, ...] | None = None,
) -> Any:
    """`height`, `width` and the numbers are those of the full image; `roi` is x, y, width, height in it."""
    k = (fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0)
    p = (fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0) if p is None else p
    return types("CameraInfo")(
        header=header(),
        height=height,
        width=width,
        distortion_model=model,
        d=np.array(d),
        k=np.array(k),
        r=np.eye(3).ravel(),
        p=np.array(p),
        binning_x=binning[0],
        binning_y=binning[1],
        roi=types("RegionOfInterest")(x_offset=roi[0], y_offset=roi[1], width=roi[2], height=roi[3], do_rectify=False),
    )


def cloud_of_depth_image_proc(depth: np.ndarray, info: Any) -> np.ndarray:
    """Points (N, 3) float32, one at a time, by the formula of depth_image_proc with the model of image_geometry.

    In C++ the products are of floats, from left to right: (u - cx) * depth * (unit / fx).
    """
    full_x, full_y = (info.p[2] - info.roi.x_offset, info.p[6] - info.roi.y_offset)
    across, down = 1.0 / max(1, info.binning_x), 1.0 / max(1, info.binning_y)
    center_x, center_y = np.float32(full_x * across), np.float32(full_y * down)
    unit = np.float32(0.001) if depth.dtype == np.uint16 else np.float32(1.0)
    constant_x = np.float32(float(unit) / (info.p[0] * across))
    constant_y = np.float32(float(unit) / (info.p[5] * down))
    points = []
    for v, row in enumerate(depth):
        for u, value in enumerate(row):
            if not np.isfinite(value) or value <= 0:
                points.append((np.float32(np.nan),) * 3)
                continue
            d = np.float32(value)
            x = np.float32(np.float32(np.float32(u) - center_x) * d) * constant_x
            y = np.float32(np.float32(np.float32(v) - center_y) * d) * constant_y
            points.append((x, y, d * unit))
    return np.array(points, np.float32).reshape(-1, 3)
