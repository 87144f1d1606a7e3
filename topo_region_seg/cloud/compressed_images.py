# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Images as image_transport packs them: depth of `compressedDepth` (PNG), color of `compressed` (JPEG or PNG).

Pillow unpacks them, which is only loaded for them: a node with raw images does without.
"""

from __future__ import annotations

import io
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.buffers import bytes_of
from topo_region_seg.cloud.layout import CloudFormatError, check_points

_CONFIG = struct.Struct("<iff")
"""What compressedDepth puts before the picture: a number of its own, and the two parameters of quantized depth."""
_PNG_START, _PNG_SIZE = b"\x89PNG\r\n\x1a\n", slice(16, 24)
_FORMATS = ("PNG", "JPEG")


def is_compressed(msg: Any) -> bool:
    """Return whether a message is a CompressedImage, which is packed by a library of pictures."""
    return hasattr(msg, "format")


def packed_size(msg: Any) -> tuple[int, int] | None:
    """Return (height, width) that the picture of a compressed depth image says it has; None if it says nothing."""
    head = bytes_of(msg.data)[_CONFIG.size : _CONFIG.size + _PNG_SIZE.stop].tobytes()
    if not head.startswith(_PNG_START) or len(head) < _PNG_SIZE.stop:
        return None
    width, height = struct.unpack(">II", head[_PNG_SIZE])
    return height, width


def compressed_depth(msg: Any, *, max_points: int) -> npt.NDArray[Any]:
    """Return the depth (H, W) of a CompressedImage: uint16 millimetres, or float32 metres, NaN where it has none.

    Raises
    ------
    CloudFormatError
        It is packed in another way, is damaged or too large, or Pillow is missing.
    """
    encoding, _, how = (part.strip() for part in str(msg.format).partition(";"))
    if encoding not in ("16UC1", "mono16", "32FC1") or how not in ("", "compressedDepth", "compressedDepth png"):
        raise CloudFormatError(
            "depth_encoding",
            f"format of the compressed depth image is '{str(msg.format)[:60]}', not '16UC1; compressedDepth png' or "
            "'32FC1; compressedDepth png'; set the driver's compressedDepth format to png",
        )
    data = bytes_of(msg.data)
    if data.nbytes <= _CONFIG.size:
        raise CloudFormatError("data_too_short", f"{data.nbytes} bytes of data are no compressed depth image")
    _, quantum, offset = _CONFIG.unpack(data[: _CONFIG.size].tobytes())
    pixels = _unpacked(data[_CONFIG.size :], ("PNG",), "depth", max_points)
    if pixels.ndim != 2 or pixels.dtype.kind not in "iu" or pixels.dtype.itemsize < 2:
        raise CloudFormatError("depth_encoding", "the compressed depth image does not have one channel of 16 bits")
    # Some versions of Pillow deliver 16 bits as 32.
    values = pixels.astype(np.uint16)
    if encoding != "32FC1":
        return values
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        metres: npt.NDArray[Any] = np.float32(quantum) / (values.astype(np.float32) - np.float32(offset))
    metres[values == 0] = np.nan
    return metres


def compressed_color(msg: Any, *, max_points: int) -> npt.NDArray[np.uint8]:
    """Return the colors (H, W, 3) of a CompressedImage.

    Raises
    ------
    CloudFormatError
        It is neither JPEG nor PNG, is damaged or too large, or Pillow is missing.
    """
    return _unpacked(bytes_of(msg.data), _FORMATS, "color", max_points, mode="RGB")


def _unpacked(
    data: npt.NDArray[np.uint8], formats: tuple[str, ...], what: str, max_points: int, mode: str = ""
) -> npt.NDArray[Any]:
    try:
        from PIL import Image
    except ImportError:
        raise CloudFormatError(
            "missing_pillow",
            f"compressed {what} images need Pillow, which is not installed: sudo apt install python3-pil, or "
            "pip install pillow",
        ) from None
    try:
        picture = Image.open(io.BytesIO(data.tobytes()), formats=formats)
        width, height = picture.size
        check_points(height, width, max_points)
        picture.load()
        return np.asarray(picture.convert(mode) if mode and picture.mode != mode else picture)
    except CloudFormatError:
        raise
    except Exception as error:  # any byte may be wrong, and Pillow's errors are of many kinds
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise CloudFormatError(
            "undecodable_image", f"the compressed {what} image is not a whole {' or '.join(formats)}: {reason}"
        ) from None
