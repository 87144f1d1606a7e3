# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Figure and ground: how sure it is that a segment is a thing, told along its outline.

A thing hides what is beyond its outline, or stands on the support. A wall, the rim of a bin or the floor behind a table
is hidden by what is before it, ends where the view ends, or lies beside the support. A robot's own arm is cut by the
image's near edge.
"""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import BoolArray, FloatArray, IntArray
from topo_region_seg.steps.view.grid import Single
from topo_region_seg.steps.view.label_image import Labels, sizes_of
from topo_region_seg.steps.view.outlines import AT_EDGE, OCCLUDED, OWN, TOUCHING, Relations, relations
from topo_region_seg.steps.view.scene import BEHIND, STRUCTURE, SUPPORT, Classes, Scene, Surface, within_footprint
from topo_region_seg.steps.view.table import DepthTable, at_depth

BESIDE = 0.5
"""What touching another segment counts for, where hiding something or standing on the support counts 1."""
BEHIND_ANOTHER = 0.7
"""What being hidden by another segment counts against a thing, where anything else counts 1: in piles, things are."""
CUT = 6.0
"""What an outline pixel that the image's edge cuts counts against a thing."""
CUT_IN_SIGHT = 1.0
"""The same where the support, or another thing on it, goes on beside it along that edge: things reach out of the view,
too."""
HIDING, CUT_HIDING_NOTHING = 0.1, 2.0
"""Share of its outline that such a thing hides something with at the least, and what counts if it does not: where a
table bends, it hides nothing."""
LARGE = 0.04
"""Share of the image from which on what comes in at the lower edge is taken for the robot itself."""
OFF_SUPPORT = 0.8
"""By how much the confidence falls where most of a segment lies beside the support."""
NEAR_SUPPORT = 0.3
"""Distance from the support's footprint, times its shorter side, up to which points are above it: much of a table may
be hidden, or have no depth."""
LOW, FEW = 2.5, 1000
"""Height above the support, times its margin, that a segment of fewer than so many pixels needs: less is noise."""
HIGH = 0.97
"""Share of a segment's pixels that are no higher than it counts."""


def with_ground(label: Labels, classes: Classes, n: int) -> Labels:
    """Return labels (P,), below `n`, and in their gaps the classes of the ground: support `n`, behind it, structure."""
    code = np.zeros(5, np.int32)
    code[SUPPORT], code[BEHIND], code[STRUCTURE] = n, n + 1, n + 2
    return filled(label, classes, code)


@kernel
def filled(label: Labels, classes: Classes, code: Labels) -> Labels:
    """Return labels (P,) with the `code` of its class in place of label 0."""
    both = np.empty_like(label)
    for p in range(len(label)):
        both[p] = label[p] if label[p] > 0 else code[classes[p]]
    return both


def relations_in(scene: Scene, label: Labels, n: int) -> Relations:
    """Return what lies beyond the outlines of `n` labels, 0 included; the ground has labels from `n` on."""
    grid, model = scene.grid, scene.model
    both = with_ground(label, scene.classes, n)
    return relations(both, grid.depth, grid.height, grid.width, n + 3, model.noise, model.pixel)


def confidences(scene: Scene, label: Labels, found: Relations, n: int) -> FloatArray:
    """Return how sure it is that each label is a thing, (n,), 0 to 1: the share of its outline that speaks for it.

    Parameters
    ----------
    scene : Scene
        The frame.
    label : (P,) int32
        Segments of the pixels.
    found : Relations
        What lies beyond their outlines, as `relations_in` returns it.
    n : int
        Number of labels, 0 included.
    """
    total = found.totals(n)
    every: BoolArray = np.ones(len(found.first), np.bool_)
    beside = found.second < n

    def share(kind: int, chosen: BoolArray) -> FloatArray:
        counted = np.bincount(found.first[chosen], found.pixels[chosen, kind], n + 3)[:n]
        shares: FloatArray = counted / total
        return shares

    grid = scene.grid
    size = sizes_of(label, n)
    both = with_ground(label, scene.classes, n)
    flanked = flanked_pixels(both, grid.height, grid.width, n, size < LARGE * len(label)) / total
    plus = share(OWN, every) + share(TOUCHING, ~beside & (found.second != n + 1)) + BESIDE * share(TOUCHING, beside)
    minus = (
        share(OCCLUDED, ~beside)
        + BEHIND_ANOTHER * share(OCCLUDED, beside)
        + share(TOUCHING, found.second == n + 1)
        + found.void[:n] / total
    )
    in_sight = np.where(share(OWN, every) >= HIDING, CUT_IN_SIGHT, CUT_HIDING_NOTHING)
    minus += in_sight * flanked + CUT * np.maximum(found.frame[:n] / total - flanked, 0.0)
    confidence: FloatArray = plus / np.maximum(plus + minus, 1e-9)
    if scene.support is not None and scene.margin is not None:
        above, height = places_of(label, grid.xyz, grid.depth, n, scene.support, scene.margin)
        confidence[above < 0.5 * size] *= OFF_SUPPORT
        confidence[(height < LOW) & (size < FEW)] = 0.0
    confidence[0] = 0.0
    return confidence


def places_of(
    label: Labels, xyz: Single, depth: Single, n: int, support: Surface, margin: DepthTable
) -> tuple[IntArray, FloatArray]:
    """Return how many pixels of each label are above the support's footprint, and its height, margins, (n,) each."""
    rows = np.flatnonzero(label)
    near = NEAR_SUPPORT * support.side
    above, height = feet(
        rows,
        label,
        xyz,
        depth,
        n,
        support.normal,
        support.offset,
        margin,
        support.center,
        support.axes,
        support.hull,
        near,
    )
    return above, highest_counted(label[rows], height, n)


@kernel
def feet(
    rows: IntArray,
    label: Labels,
    xyz: Single,
    depth: Single,
    n: int,
    normal: FloatArray,
    offset: float,
    margin: DepthTable,
    center: FloatArray,
    axes: FloatArray,
    hull: FloatArray,
    near: float,
) -> tuple[IntArray, FloatArray]:
    """Return how many pixels of each label are above a footprint, and the height of each of the `rows`, in margins."""
    above, height = np.zeros(n, np.int64), np.empty(len(rows))
    for i in range(len(rows)):
        p = rows[i]
        h = offset
        for c in range(3):
            h += normal[c] * xyz[p, c]
        height[i] = h / at_depth(margin, np.float64(depth[p]))
        above[label[p]] += within_footprint(xyz, p, center, axes, hull, near)
    return above, height


@kernel
def highest_counted(label: Labels, height: FloatArray, n: int) -> FloatArray:
    """Return the height (n,) above which few pixels of each label are; 0 where it has none."""
    size = sizes_of(label, n)
    end, own, highest = np.cumsum(size) - size, np.empty(len(height)), np.zeros(n)
    for i in range(len(label)):
        own[end[label[i]]] = height[i]
        end[label[i]] += 1
    for k in range(n):
        if size[k] > 0:
            counted = np.int64(HIGH * size[k])
            highest[k] = np.partition(own[end[k] - size[k] : end[k]], counted)[counted]
    return highest


@kernel
def flanked_pixels(both: Labels, height: int, width: int, n: int, small: BoolArray) -> FloatArray:
    """Return how many pixels at the image's edge each segment (n,) has beside which the view goes on along that edge.

    That is where the support is, or another segment: on both sides at the upper and lower edges, below at the left and
    right ones. At the lower edge only those count that are `small` (n,). `both` (P,) are labels with ground, where the
    support is `n`.
    """
    flanked = np.zeros(n)
    for side in range(4):
        # From left to right along the upper and lower edges, downwards along the others.
        level = side < 2
        start = (height - 1) * width if side == 1 else (width - 1 if side == 3 else 0)
        stride = 1 if level else width
        inward = (width if level else 1) * (1 if side == 0 or side == 2 else -1)
        before, run, count = 0, 0, 0
        for i in range(width if level else height):
            found = 0
            for k in range(AT_EDGE + 1):
                found = np.int64(both[start + i * stride + k * inward])
                if found != 0:
                    break
            if found == 0:
                continue
            if found == run:
                count += 1
                continue
            if 0 < run < n and found <= n and (0 < before <= n or not level) and (small[run] or side != 1):
                flanked[run] += count
            before, run, count = run, found, 1
    return flanked
