# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The labels of an organized cloud as an image."""

from __future__ import annotations

from typing import Any

import numpy as np

from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.types import MessageTypes
from topo_region_seg.cloud.pointcloud2 import byte_buffer

LARGEST = 2**16 - 1


def label_image(types: MessageTypes, answer: Answer) -> Any:
    """Return the labels as a `mono16` image of the cloud's grid, 0 for none; None for a cloud that has no grid."""
    cloud, labels = answer.cloud, answer.seg.labels
    if not cloud.organized:
        text = "label_image needs organized clouds, and these are lists of points; have the driver send an image grid"
        answer.warn("label_image_unorganized", text)
        return None
    buffer = byte_buffer(types.Image, 2 * len(labels))
    pixels = np.frombuffer(buffer, "<u2")
    pixels[:] = labels
    if int(np.max(labels, initial=0)) > LARGEST:
        pixels[labels > LARGEST] = 0
        text = (
            f"labels above {LARGEST} are 0 in label_image; raise min_region_size or seed_spacing to get fewer regions"
        )
        answer.warn("label_image_full", text)
    return types.Image(
        header=answer.header,
        height=cloud.height,
        width=cloud.width,
        encoding="mono16",
        is_bigendian=0,
        step=2 * cloud.width,
        data=buffer,
    )
