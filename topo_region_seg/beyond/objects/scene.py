# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Objects of an image grid."""

from __future__ import annotations

import math

import numpy as np
from scipy import ndimage

from topo_region_seg.beyond.objects.figure import evidence, flanked_pixels
from topo_region_seg.beyond.objects.grid_borders import grid_borders
from topo_region_seg.steps.view.label_image import half_widths, kept_labels, sizes_of
from topo_region_seg.beyond.objects.lengths import Lengths
from topo_region_seg.steps.view.outlines import OCCLUDED, OWN, TOUCHING, relations
from topo_region_seg.beyond.objects.spreading import spread_labels
from topo_region_seg.beyond.objects.uniting import unite_convex
from topo_region_seg.beyond.objects.vessels import insides, openings
from topo_region_seg.steps.support.ground import BEHIND, FREE, SUPPORT

TOLERANCE = 0.1
FACE, THING = 64, 200
NARROW, SPREAD = 1.0, 2.0
FRAME = 0.12
BOX = np.ones((3, 3))
DUMP = {}
NB = {}
SIDE = 0.3


def objects_of_grid(grid, model, ground, normals, label, lengths: Lengths, params, opts=None, surface=None):
    o = dict(figure=1, hollow=1, touch=0.5, bh=1, uf=6, fl=1.5, st=1.0, vo=1.0, again=1, t1=0.12, t2=0.25, s2=0.35, m2=800, m1=1000, off=0.7, tall=2.5, low=1000, thing=300, conf=0.5)
    o.update(opts or {})
    height, width = grid.height, grid.width
    free = ground == FREE
    middle = float(np.median(grid.depth[free]))
    scale = min(max(lengths.growth * middle, lengths.least), lengths.most)
    px = scale / (model.pixel * middle)  # pixels per metre of a length, in the middle
    narrow = max(1.5, NARROW * params.object_normal_radius * px)
    size = sizes_of(label)
    label = kept_labels(label, size >= FACE)
    label = kept_labels(label, half_widths(label, height, width, label.max() + 1) >= narrow)
    if label.max() > 1:
        reach = params.object_border_radius
        borders = grid_borders(grid, normals, label, lengths, reach, model.pixel, TOLERANCE)
        group = unite_convex(borders, int(label.max()) + 1, params.object_convexity)
        label = np.unique(group[label], return_inverse=True)[1].astype(np.int32).reshape(-1)
        if label.min() == 0 and not (label == 0).any():
            label += 1
    given = grid, normals
    label = spread_labels(*given, label, free, model.noise, model.pixel, max(3, int(SPREAD * params.object_border_radius * px)))
    for rounds in (40, 3):
        rest = ndimage.label((free & (label == 0)).reshape(height, width), BOX)[0].astype(np.int32).ravel()
        big = np.bincount(rest) >= o["thing"]
        big[0] = False
        if rounds > 3:
            big &= half_widths(rest, height, width, rest.max() + 1) >= narrow
        number = np.where(big, label.max() + np.arange(len(big)), 0).astype(np.int32)
        label = np.where(big[rest], number[rest], label)
        label = spread_labels(*given, label, free, model.noise, model.pixel, rounds)
    label = kept_labels(label, np.bincount(label) >= o["thing"])

    def related(label):
        n = int(label.max()) + 1
        both = np.where(label > 0, label, np.where(ground == SUPPORT, n, np.where(ground == BEHIND, n + 1, np.where(ground == 4, n + 2, 0))))
        return relations(both.astype(np.int32), grid.depth, height, width, n + 3, model.noise, model.pixel)

    for least, share, most in ((o["t1"], params.object_convexity, o["m1"]), (o["t2"], o["s2"], o["m2"])):
        if label.max() > 1 and o["again"]:
            label = united_again(grid, normals, label, lengths, params, model, related(label), least, share, most)
    NB.clear()
    n0 = int(label.max()) + 1
    bb = grid_borders(grid, normals, label, lengths, params.object_border_radius, model.pixel, TOLERANCE)
    NB.update(label=label, borders=bb, rel=related(label))
    if o["hollow"] and label.max() > 1:
        n = int(label.max()) + 1
        to = insides(related(label), openings(label, grid.xyz, normals, n), n, n)
        label = np.unique(np.append(0, to[label]), return_inverse=True)[1][1:].astype(np.int32)
    if o["figure"] and label.max() > 0:
        n = int(label.max()) + 1
        r = related(label)
        both = np.where(label > 0, label, np.where(ground == SUPPORT, n, np.where(ground == BEHIND, n + 1, np.where(ground == 4, n + 2, 0))))
        e = evidence(r, n, flanked_pixels(both.astype(np.int32), height, width, n, 1))
        size = np.maximum(np.bincount(label, minlength=n), 1)
        inside, tall = np.ones(n), np.full(n, np.inf)
        if surface is not None:
            inside = np.bincount(label, on_footprint(grid, surface, label), n) / size
            tall = heights_of(grid, surface, label, n)
        unflanked = np.maximum(e.frame - e.flanked, 0.0)
        stands = np.where(inside >= 0.5, e.stands, 0.0)
        plus = e.own + stands + o["touch"] * e.touches + o["st"] * e.walls
        minus = e.occluded + o["vo"] * e.void + o["fl"] * e.flanked + o["bh"] * e.behind + o["uf"] * unflanked + (e.stands - stands)
        confidence = plus / np.maximum(plus + minus, 1e-9) * np.where(inside >= 0.5, 1.0, o["off"])
        confidence[(tall < o["tall"]) & (size < o["low"])] = 0.0
        DUMP.clear()
        DUMP.update(label=label, **e._asdict(), ins=inside, tall=tall, conf=confidence, size=size)
        label = kept_labels(label, confidence >= o["conf"])
    return label


def united_again(grid, normals, label, lengths, params, model, found, least, share, most):
    """Unite segments that touch along enough of the smaller one's outline, and whose border is convex."""
    n = int(label.max()) + 1
    borders = grid_borders(grid, normals, label, lengths, params.object_border_radius, model.pixel, TOLERANCE)
    size = np.bincount(label, minlength=n)
    total = np.maximum(np.bincount(found.first, found.count.sum(axis=1), n + 3) + found.frame + found.void, 1.0)
    small = np.where(size[borders.first] < size[borders.second], borders.first, borders.second)
    large = borders.first + borders.second - small
    code = found.first * (n + 3) + found.second
    place = np.clip(np.searchsorted(code, small * (n + 3) + large), 0, len(code) - 1)
    hit = code[place] == small * (n + 3) + large
    count = np.where(hit[:, None], found.count[place], 0.0)
    touch = count[:, TOUCHING] / total[small]
    good = (touch >= least) & (count[:, OCCLUDED] <= count[:, TOUCHING]) & (size[small] <= most)
    borders = borders._replace(pairs=np.where(good, borders.pairs, 0.0), convex=np.where(good, borders.convex, 0.0))
    group = unite_convex(borders, n, share)
    return np.unique(np.append(0, group[label]), return_inverse=True)[1][1:].astype(np.int32)


def on_footprint(grid, surface, label):
    """Return (P,) whether each labelled pixel's foot lies on the surface's footprint."""
    found = np.zeros(len(label))
    p = np.flatnonzero(label)
    flat = (grid.xyz[p] - surface.center.astype(np.float32)) @ surface.axes.astype(np.float32)
    found[p] = (flat @ surface.hull[:, :2].T.astype(np.float32) + surface.hull[:, 2].astype(np.float32) <= 0.03 + SIDE * surface.side).all(axis=1)
    return found


def heights_of(grid, surface, label, n):
    """97th percentile of the height of each label, in margins there."""
    p = np.flatnonzero(label)
    h = (grid.xyz[p] @ surface.normal.astype(np.float32) + np.float32(surface.offset)) / np.interp(grid.depth[p], MARGIN[0], MARGIN[1])
    order = np.lexsort((h, label[p]))
    l = label[p][order]
    last = np.searchsorted(l, np.arange(n), side="right")
    first = np.searchsorted(l, np.arange(n), side="left")
    at = np.clip(first + ((last - first) * 0.97).astype(int), 0, len(l) - 1)
    return np.where(last > first, h[order][at], np.inf)


MARGIN = [np.zeros(1), np.zeros(1)]
