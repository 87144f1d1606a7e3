# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The stages whose kernels are measured, each on the same frame."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from benchmarks import hostile, recordings, synthetic
from benchmarks.points import FloatArray, Points
from topo_region_seg.beyond.adjacency import adjacency
from topo_region_seg.beyond.auto_scale.local_units import local_units
from topo_region_seg.beyond.objects.grooves import find_grooves
from topo_region_seg.beyond.objects.unite import unite_objects
from topo_region_seg.beyond.supervoxels.patches import supervoxels
from topo_region_seg.compiled.kd_tree import position_tree
from topo_region_seg.compiled.selection import gather, gather_columns
from topo_region_seg.growth import growth_of_output
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.segmentation import Segmentation
from topo_region_seg.steps.color import srgb_to_lab
from topo_region_seg.steps.crop import crop
from topo_region_seg.steps.filtration.persistence import filtration
from topo_region_seg.steps.homogeneity import criterion, homogeneity_channels
from topo_region_seg.steps.normals.estimate import estimate_normals
from topo_region_seg.steps.regions import describe_regions, number_regions
from topo_region_seg.steps.small_regions.settle import settle_small_regions
from topo_region_seg.steps.support.removal import above
from topo_region_seg.steps.support.search import find_support
from topo_region_seg.steps.thinning.voxels import thin

SENSOR = np.zeros(3)
PEERS = Params(max_radius=0.03, color_threshold=10.0, angle_threshold=5.0)
"""Parameters of the clouds that the core is held against other programs on."""
Work = Callable[[], Any]


@cache
def segmented(output: str = "regions") -> Segmentation:
    """Segment the first frame."""
    return Pipeline(Params(output=output, max_radius=0.02)).run(recordings.frames()[0].cloud())


@cache
def cropped() -> tuple[Any, FloatArray]:
    """Return the first frame, and its points after the crop, column by column."""
    cloud = recordings.frames()[0].cloud()
    return cloud, gather_columns(cloud.xyz, crop(cloud.xyz, SENSOR, Params()), SENSOR)


def records() -> Work:
    """Decode the message."""
    return recordings.frames()[0].cloud


def cropping() -> Work:
    """Crop the cloud."""
    cloud, _ = cropped()

    def work() -> FloatArray:
        return gather_columns(cloud.xyz, crop(cloud.xyz, SENSOR, Params()), SENSOR)

    return work


def support() -> Work:
    """Find the support plane, and what is in front of it."""
    _, xyz = cropped()
    params, plane = Params(), segmented().plane
    assert plane is not None

    def work() -> FloatArray:
        find_support(xyz, params.floor_distance, params.floor_min_extent, params.floor_seed)
        return gather(xyz, above(xyz, plane, params.floor_distance))

    return work


def thinning() -> Work:
    """Thin the cloud."""
    cloud, xyz = cropped()
    return partial(thin, np.ascontiguousarray(xyz), cloud.rgb[crop(cloud.xyz, SENSOR, Params())], Params().voxel_size)


def color() -> Work:
    """Convert sRGB to CIELAB."""
    return partial(srgb_to_lab, recordings.frames()[0].cloud().rgb[segmented().index])


def tree() -> Work:
    """Build the tree of positions."""
    return partial(position_tree, segmented().filtered.xyz)


def normals() -> Work:
    """Estimate normals."""
    filtered, params = segmented().filtered, Params()
    return partial(estimate_normals, filtered.xyz, filtered.tree, params.normal_radius, params.normal_min_neighbors)


def filtering() -> Work:
    """Compute the filtration."""
    filtered = segmented().filtered
    radius = filtered.growth.max_radius
    return partial(filtration, filtered.channels, criterion(filtered.growth, radius), radius, filtered.tree)


def small_regions() -> Work:
    """Merge the small regions."""
    filtered = segmented().filtered
    limits = criterion(filtered.growth, filtered.growth.radius)
    root = filtered.components.root
    return partial(settle_small_regions, filtered.channels, filtered.tree, root, filtered.weight, limits, Params())


def regions() -> Work:
    """Describe the components as regions."""
    filtered = segmented().filtered

    def work() -> Any:
        labels = number_regions(filtered.xyz, filtered.components.root, filtered.weight)
        persistence = np.zeros(int(labels.max()))
        return describe_regions(filtered.xyz, filtered.features, labels, filtered.weight, persistence)

    return work


def grooves() -> Work:
    """Find the grooves."""
    filtered = segmented("objects").filtered
    assert filtered.features.normals is not None
    return partial(find_grooves, filtered.xyz, filtered.features.normals, filtered.tree, Params(output="objects"))


def objects() -> Work:
    """Unite regions to objects."""
    filtered = segmented("objects").filtered
    normals, params = filtered.features.normals, Params(output="objects")
    assert normals is not None
    loose, root = np.isnan(filtered.channels[:, 6]), filtered.components.root
    return partial(unite_objects, filtered.xyz, normals, loose, filtered.tree, root, filtered.weight, params)


def borders() -> Work:
    """Find the pairs of points at the borders of components."""
    filtered = segmented().filtered
    return partial(adjacency, filtered.xyz, (filtered.components.root + 1).astype(np.uint32), filtered.tree, 0.01)


def patches() -> Work:
    """Divide the regions into supervoxels."""
    filtered, params = segmented("supervoxels").filtered, Params(output="supervoxels")
    limits = criterion(filtered.growth, filtered.growth.radius)
    root = filtered.components.root
    xyz, channels = filtered.xyz, filtered.channels
    return partial(supervoxels, xyz, channels, filtered.tree, root, filtered.weight, limits, params)


def scattered_patches() -> Work:
    """Divide points of random colors into supervoxels: nearly every point is a patch."""
    points, params = hostile.random_colors(26_000, 0.03), PEERS.replace(output="supervoxels")
    growth, tree = growth_of_output(params), position_tree(points.xyz)
    channels = homogeneity_channels(points.xyz, points.lab, points.normals, growth)
    limits, weight = criterion(growth, growth.radius), np.ones(len(points.xyz), np.int64)
    root = filtration(channels, limits, growth.max_radius, tree).root
    return partial(supervoxels, points.xyz, channels, tree, root, weight, limits, params)


def local() -> Work:
    """Find the spacing and noise of the cloud, and the coordinates in which lengths do not grow."""
    cloud, xyz = cropped()
    rows = crop(cloud.xyz, SENSOR, Params())
    return lambda: local_units(xyz, rows, cloud.width, cloud.height).at(xyz)


def _from_nothing(points: Points) -> Work:
    growth = growth_of_output(PEERS)
    channels = homogeneity_channels(points.xyz, points.lab, points.normals, growth)
    return partial(filtration, channels, criterion(growth, growth.max_radius), growth.max_radius)


def ball() -> Work:
    """Compute the filtration of points that are all within reach of each other."""
    return _from_nothing(hostile.dense_ball(26_000, 0.03))


def made() -> Work:
    """Compute the filtration of made objects whose points are 0.8 mm apart."""
    return _from_nothing(synthetic.objects(26_000, 0.0008))


STAGES: dict[str, Callable[[], Work]] = {
    "records": records,
    "crop": cropping,
    "support": support,
    "thinning": thinning,
    "color": color,
    "tree": tree,
    "normals": normals,
    "filtration": filtering,
    "filtration, ball": ball,
    "filtration, made": made,
    "small_regions": small_regions,
    "regions": regions,
    "grooves": grooves,
    "objects": objects,
    "adjacency": borders,
    "supervoxels": patches,
    "supervoxels, random": scattered_patches,
    "local_units": local,
}
