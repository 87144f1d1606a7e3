# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Bounding boxes of tree nodes, in single precision, and the gaps between them.

Channels come in threes: position, color, normal. Of each three a box keeps the lower bounds, then the upper ones, and a
zero after both, as vectors have four cells. Boxes of K nodes are (T, K, 2, 4) float32.
"""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import index, inlined, kernel

LOWER, UPPER = 0, 1
ROUNDING = 1.2e-7  # of a bound: by 2**-24 of it, at most, single precision may move it inwards
SLACK = 1.0 - 1e-6  # of a squared gap: by less than 2**-21 of it the rounding of six operations may make it larger


@inlined
def bound_channel(boxes, node, channel, low, high):  # type: ignore[no-untyped-def]
    """Set the bounds of one channel of a node, rounded outwards."""
    t, k, c = index(channel // 3), index(node), index(channel % 3)
    boxes[t, k, LOWER, c] = low - abs(low) * ROUNDING
    boxes[t, k, UPPER, c] = high + abs(high) * ROUNDING


@kernel
def join_boxes(boxes, node, left, right):  # type: ignore[no-untyped-def]
    """Bound a node by the boxes of its children."""
    k, p, q = index(node), index(left), index(right)
    for three in range(len(boxes)):
        t = index(three)
        for cell in range(4):
            c = index(cell)
            boxes[t, k, LOWER, c] = min(boxes[t, p, LOWER, c], boxes[t, q, LOWER, c])
            boxes[t, k, UPPER, c] = max(boxes[t, p, UPPER, c], boxes[t, q, UPPER, c])


@kernel
def box_of_point(xyz, point):  # type: ignore[no-untyped-def]
    """Return the box (1, 1, 2, 4) around the position of a point."""
    box = np.zeros((1, 1, 2, 4), np.float32)
    for c in range(3):
        bound_channel(box, 0, c, xyz[point, c], xyz[point, c])
    return box


@inlined
def box_gap(boxes, a, others, b, three):  # type: ignore[no-untyped-def]
    """Return a lower bound of the squared distance of box `a` from box `b` of `others`, in one three of channels."""
    t, p, q = index(three), index(a), index(b)
    gap = np.float32(0.0)
    for channel in range(3):
        c = index(channel)
        below = others[t, q, LOWER, c] - boxes[t, p, UPPER, c]
        above = boxes[t, p, LOWER, c] - others[t, q, UPPER, c]
        apart = max(np.float32(0.0), below, above)
        gap += apart * apart
    return np.float64(gap) * SLACK
