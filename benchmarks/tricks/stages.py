# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The stages whose kernels are measured, each on the same frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from benchmarks import hostile, recordings, synthetic
from benchmarks.points import FloatArray
from topo_region_seg.beyond.adjacency import adjacency
from topo_region_seg.beyond.objects.grooves import find_grooves
from topo_region_seg.beyond.objects.unite import unite_objects
from topo_region_seg.beyond.supervoxels.patches import supervoxels
from topo_region_seg.compiled.kd_tree import Tree, position_tree
from topo_region_seg.params import Params
from topo_region_seg.steps.color import srgb_to_lab
from topo_region_seg.steps.crop import crop
from topo_region_seg.steps.filtration.persistence import filtration
from topo_region_seg.steps.homogeneity import criterion, homogeneity_channels
from topo_region_seg.steps.normals.estimate import estimate_normals
from topo_region_seg.steps.small_regions import settle_small_regions
from topo_region_seg.steps.support import above, find_floor
from topo_region_seg.steps.thinning import thin_for


@dataclass(frozen=True)
class Scene:
    """The first frame, as each stage of the pipeline sees it."""

    message: Any
    params: Params
    cropped: FloatArray
    rgb: Any
    xyz: FloatArray
    lab: FloatArray
    normals: FloatArray
    tree: Tree


@cache
def scene() -> Scene:
    """Preprocess the first frame."""
    frame, params = recordings.frames()[0], Params()
    cloud = frame.cloud()
    rows = crop(cloud.xyz, params)
    cropped = cloud.xyz[rows].astype(np.float64)
    plane = find_floor(cropped, params)
    kept = np.arange(len(rows)) if plane is None else above(cropped, plane, params.floor_distance)
    thinned = thin_for(params, np.ascontiguousarray(cropped[kept]), cloud.rgb[rows[kept]])
    assert thinned is not None and thinned.rgb is not None
    tree = position_tree(thinned.xyz)
    lab, normals = srgb_to_lab(thinned.rgb), estimate_normals(thinned.xyz, tree, params)
    return Scene(frame.msg, params, cropped, thinned.rgb, thinned.xyz, lab, normals, tree)


def records() -> Callable[[], Any]:
    """Decode the message."""
    frame = recordings.frames()[0]
    return frame.cloud


def support() -> Callable[[], Any]:
    """Find the support plane, and what is in front of it."""
    cropped, params = np.asfortranarray(scene().cropped), scene().params
    plane = find_floor(cropped, params)
    assert plane is not None
    return lambda: (find_floor(cropped, params), above(cropped, plane, params.floor_distance))


def color() -> Callable[[], Any]:
    """Convert sRGB to CIELAB."""
    rgb = scene().rgb
    return lambda: srgb_to_lab(rgb)


def tree() -> Callable[[], Any]:
    """Build the tree of positions."""
    xyz = scene().xyz
    return lambda: position_tree(xyz)


def normals() -> Callable[[], Any]:
    """Estimate normals."""
    s = scene()
    return lambda: estimate_normals(s.xyz, s.tree, s.params)


def _filtration(channels: FloatArray, params: Params, by_position: Tree | None = None) -> Callable[[], Any]:
    limits = criterion(params)
    return lambda: filtration(channels, limits, params.reach, by_position)


def filtration_() -> Callable[[], Any]:
    """Compute the filtration."""
    s = scene()
    return _filtration(homogeneity_channels(s.xyz, s.lab, s.normals, s.params), s.params, s.tree)


def small_regions() -> Callable[[], Any]:
    """Merge the small regions."""
    s = scene()
    channels, weight = homogeneity_channels(s.xyz, s.lab, s.normals, s.params), np.ones(len(s.xyz), np.int64)
    root = filtration_()().root
    limits = criterion(s.params)
    return lambda: settle_small_regions(channels, s.tree, root, weight, limits, s.params)


def grooves() -> Callable[[], Any]:
    """Find the grooves."""
    s = scene()
    params = s.params.replace(level="objects")
    return lambda: find_grooves(s.xyz, s.normals, s.tree, params)


def objects() -> Callable[[], Any]:
    """Unite regions to objects."""
    s = scene()
    params = s.params.replace(level="objects")
    loose = find_grooves(s.xyz, s.normals, s.tree, params) | np.isnan(s.normals[:, 0])
    root, weight = filtration_()().root, np.ones(len(s.xyz), np.int64)
    return lambda: unite_objects(s.xyz, s.normals, loose, s.tree, root, weight, params)


def adjacency_() -> Callable[[], Any]:
    """Find the pairs of points at the borders of components."""
    s = scene()
    labels = (filtration_()().root + 1).astype(np.uint32)
    return lambda: adjacency(s.xyz, labels, s.tree, 0.01)


def supervoxels_() -> Callable[[], Any]:
    """Divide the regions into supervoxels."""
    s = scene()
    params = s.params.replace(mode="supervoxels")
    channels, weight = homogeneity_channels(s.xyz, s.lab, s.normals, s.params), np.ones(len(s.xyz), np.int64)
    root = filtration_()().root
    return lambda: supervoxels(channels, s.tree, root, weight, params)


def dense() -> Callable[[], Any]:
    """Compute the filtration of points that are all within reach of each other."""
    params = Params(max_radius=0.03, color_threshold=10.0, angle_threshold=5.0)
    ball = hostile.dense_ball(26_000, params.max_radius)
    return _filtration(homogeneity_channels(ball.xyz, ball.lab, ball.normals, params), params)


def near() -> Callable[[], Any]:
    """Compute the filtration of made objects whose points are 0.8 mm apart."""
    params = Params(max_radius=0.03, color_threshold=10.0, angle_threshold=5.0)
    points = synthetic.objects(26_000, 0.0008)
    return _filtration(homogeneity_channels(points.xyz, points.lab, points.normals, params), params)


STAGES: dict[str, Callable[[], Callable[[], Any]]] = {
    "records": records,
    "support": support,
    "color": color,
    "tree": tree,
    "normals": normals,
    "filtration": filtration_,
    "small_regions": small_regions,
    "grooves": grooves,
    "objects": objects,
    "adjacency": adjacency_,
    "supervoxels": supervoxels_,
    "dense": dense,
    "near": near,
}
