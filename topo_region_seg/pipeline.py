# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The one path from a cloud to its regions, in the steps of the paper."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from topo_region_seg.beyond.auto_scale.coarser import fewer_points, wider_angles
from topo_region_seg.beyond.auto_scale.local_units import local_units
from topo_region_seg.beyond.auto_scale.stable_scale import stable_scale
from topo_region_seg.beyond.objects.frame import frame_of, free_points, grooves_in
from topo_region_seg.beyond.objects.grooves import find_grooves
from topo_region_seg.beyond.objects.image import image_of
from topo_region_seg.beyond.objects.lattice import normals_in
from topo_region_seg.beyond.supervoxels.block_normals import block_normals
from topo_region_seg.beyond.supervoxels.blocks import image_blocks, takes_blocks
from topo_region_seg.clock import Clock
from topo_region_seg.compiled.kd_tree import Tree, moved_tree, position_tree
from topo_region_seg.compiled.selection import gather, gather_columns
from topo_region_seg.compiled.threads import at_most
from topo_region_seg.data import Cloud, Components, Features, FloatArray, IntArray, Notice, SegmentationWarning
from topo_region_seg.diagnosis import doubtful_support, no_points_left, no_regions, parameters_in_vain, taken_for_map
from topo_region_seg.growth import Growth, growth_of_output, is_auto
from topo_region_seg.params import Params
from topo_region_seg.segmentation import Segmentation, segmentation_at
from topo_region_seg.steps.color import srgb_to_lab
from topo_region_seg.steps.crop import crop
from topo_region_seg.steps.filtration.persistence import filtration
from topo_region_seg.steps.homogeneity import criterion, homogeneity_channels
from topo_region_seg.steps.normals.estimate import estimate_normals
from topo_region_seg.steps.normals.sides import sided_normals
from topo_region_seg.steps.scales.filtered_cloud import FilteredCloud, InRange
from topo_region_seg.steps.sensor import Sensor, known_sensor, position_above_map, possible_axes, up_direction
from topo_region_seg.steps.small_regions.settle import lists_of_small_regions
from topo_region_seg.steps.support.removal import above
from topo_region_seg.steps.support.search import NO_SUPPORT, find_support
from topo_region_seg.steps.thinning.voxels import thin_for, unthinned
from topo_region_seg.steps.view.lengths import AS_GIVEN, lengths_of, local_positions
from topo_region_seg.steps.view.placed import placed_points
from topo_region_seg.warming import OUTPUTS, compile_filtration, compile_messages, runs

AVERAGED = 1.2
"""Largest color difference of joined points, dE, below which voxels must not average colors that differ: a step of one
in 8-bit sRGB is up to 1.2 dE, and the average of two colors may be that far from any color of the cloud."""


class MissingColorError(ValueError):
    """The cloud has no color, and the criterion needs it."""


class Pipeline:
    """Segments one cloud after another; holds nothing but its parameters, so threads may share it."""

    def __init__(self, params: Params | None = None) -> None:
        self.params = params or Params()
        self._told = False

    @property
    def needs_color(self) -> bool:
        """Whether the criterion compares colors, so that a cloud without is refused."""
        return growth_of_output(self.params).uses_color

    def run(self, cloud: Cloud, warn: Callable[[str, str], None] | None = None) -> Segmentation:
        """Segment a cloud.

        Parameters
        ----------
        cloud : Cloud
            As decoded, invalid points included.
        warn : callable, optional
            Called with the code and text of each notice: the cloud had to be thinned to `max_points`, or parameters
            differ from their defaults without effect (once). Without it they become a :class:`SegmentationWarning`.

        Raises
        ------
        MissingColorError
            If the cloud has no color and the criterion compares colors.
        """
        with at_most(self.params.threads):
            return self._run(cloud, warn)

    def _run(self, cloud: Cloud, warn: Callable[[str, str], None] | None) -> Segmentation:
        params, growth, auto = self.params, growth_of_output(self.params), is_auto(self.params)
        if cloud.rgb is None and growth.uses_color:
            raise MissingColorError(
                f"the cloud has no color, but features is '{params.features}'; set features to 'normals'"
            )
        notices = [] if self._told else parameters_in_vain(params)
        self._told = True
        clock = Clock()
        with clock("crop"):
            known, up = known_sensor(cloud, params), up_direction(cloud, params)
            sensor = np.zeros(3) if known is None else known.position
            rows = crop(cloud.xyz, sensor, params, base=cloud.base_pose)
            if len(rows) == 0:
                sensor, rows, notice = _seen_otherwise(cloud, params, known)
                notices.append(notice)
            xyz = gather_columns(cloud.xyz, rows, sensor)
        units, pixel = None, rows
        size: Sequence[int] = cloud.height, cloud.width
        if auto:
            with clock("local_units"):
                placed = placed_points(cloud, rows, xyz, possible_axes(cloud, params))
                axes = None if known is None else known.axes
                if placed is not None and len(placed.rows) == len(rows):
                    rows, pixel, xyz, *size, found = placed
                    axes = axes if found is None else found
                units = local_units(xyz, pixel, size[1], size[0], axes)
                growth = replace(growth, floor_distance=units.floor_distance(growth))
        scene, support = None, NO_SUPPORT
        if params.output == "objects" and len(xyz) <= params.max_points:
            with clock("surfaces"):
                image = image_of(cloud, rows, xyz, params, known)
                frame = None if image is None else frame_of(image, params, up)
                if image is not None and frame is not None:
                    (scene, support), known = frame, image.sensor
                    rows, pixel, xyz = image.rows, image.pixel, image.xyz
        with clock("floor"):
            distance = growth.floor_distance
            if params.remove_floor and scene is None:
                given = distance, params.floor_min_extent, params.floor_seed
                support = find_support(xyz, *given, sensor_known=known is not None, up=up)
            plane = support.plane
            kept = None
            if scene is not None:
                kept = free_points(scene, pixel)
            elif plane is not None:
                kept = above(xyz, plane, distance)
            in_range = InRange(rows, pixel, kept)
            if kept is None:
                xyz = np.ascontiguousarray(xyz)
            else:
                rows, pixel, xyz = rows[kept], pixel[kept], gather(xyz, kept)
            if plane is not None:
                plane = replace(plane, offset=plane.offset - float(np.dot(plane.normal, sensor)))
            notices += doubtful_support(support, known is not None, len(rows))
        with clock("thinning"):
            rgb = None if cloud.rgb is None else cloud.rgb[rows]
            exact = growth.uses_color and growth.color[1] < AVERAGED
            thinned = at = inside = None
            fewer = None
            lengths_there = () if units is None else (max(1.0, units.growth_of_spacing), units.clear)
            if takes_blocks(params, size[0], len(xyz)):
                thinned, at, inside = image_blocks(xyz, rgb, pixel, size, params, *lengths_there, mix_colors=not exact)
            elif units is not None and not exact and len(xyz) <= params.max_points:
                fewer = fewer_points(xyz, rgb, pixel, size, units, params)
            if fewer is not None:
                thinned, inside, _ = fewer
            elif at is None and scene is None:
                thinned = thin_for(params, xyz, rgb, mix_colors=not exact)
            rows = rows if inside is None else rows[inside]
            points = thinned or unthinned(xyz, rgb)
        if points.edge > params.voxel_size:
            text = _thinning_text(len(cloud), len(rows), len(points.xyz), points.edge, params)
            notices.append(Notice("thinned", text))
        with clock("color"):
            seen = growth.uses_color or params.output == "objects"
            lab = srgb_to_lab(points.rgb) if points.rgb is not None and seen else None
        with clock("normals"):
            # What grows on the image grid asks for no tree, nor for the filtration.
            tree = position_tree(points.xyz) if at is None else None
            radius: float | FloatArray = growth.normal_radius
            if units is not None:
                radius = units.normal_radius(points.xyz, growth)
            lengths, normals, near = AS_GIVEN, None, None
            if scene is not None and tree is not None:
                lengths = lengths_of(scene, params)
                normals, scene = normals_in(scene, points.xyz, pixel, tree, lengths, params)
            elif at is not None:
                if growth.uses_normals:
                    normals = block_normals(points.xyz, at, radius, params.normal_min_neighbors)
            elif growth.uses_normals and tree is not None:
                if thinned and units is None and _merges_small(params):
                    near = lists_of_small_regions(len(points.xyz), growth.max_radius)
                estimate = sided_normals if growth.sided else estimate_normals
                normals = estimate(points.xyz, tree, radius, params.normal_min_neighbors, near)
        local, compared = points.xyz, normals
        if units is not None:
            with clock("local_units"):
                local = units.at(points.xyz)
                tree = tree if tree is None or local is points.xyz else moved_tree(tree, local)
                growth = growth if fewer is None else wider_angles(growth, units, fewer.apart, params)
        if params.output == "objects" and normals is not None and tree is not None:
            with clock("grooves"):
                compared = normals.copy()
                if scene is None:
                    grooves = find_grooves(points.xyz, normals, tree, params)
                else:
                    grooves = grooves_in(scene, normals, pixel, lengths, params)
                    local = local_positions(points.xyz, scene.axes, lengths)
                    tree = moved_tree(tree, local)
                compared[grooves] = np.nan
        with clock("filtration" if at is None else "supervoxels"):
            channels = homogeneity_channels(local, lab, compared, growth)
        filtered = FilteredCloud(
            xyz=points.xyz,
            sensor=sensor,
            weight=points.weight,
            index=rows[points.first] if thinned else rows,
            rows=rows,
            stand_in=points.voxel if thinned else None,
            given=len(cloud),
            in_range=in_range,
            channels=channels,
            known_tree=tree,
            grow=partial(grown, growth),
            features=Features(lab, normals),
            plane=plane,
            growth=growth,
            scene=scene,
            pixel=pixel,
            lengths=lengths,
            near=near,
            blocks=at,
        )
        if at is None:
            with clock("filtration"):
                components = filtered.components
        scale = growth.radius
        if auto and not params.radius and at is None:
            with clock("stable_scale"):
                scale = stable_scale(components, points.weight, params.min_region_size)
        seg = segmentation_at(filtered, params, scale, clock)
        notices += no_regions(seg)
        for notice in notices:
            (warn or _python_warning)(notice.code, notice.text)
        return replace(seg, notices=tuple(notices))


def grown(growth: Growth, channels: FloatArray, tree: Tree) -> Components:
    """Return the components of a whole filtration."""
    limits = criterion(growth, growth.max_radius)
    return filtration(channels, limits, growth.max_radius, tree, needs_normals=not growth.uses_color)


def warm_up(outputs: Iterable[str] = OUTPUTS) -> None:
    """Compile all kernels of some outputs and of messages, or load them from the cache, by segmenting made clouds."""
    for output in outputs:
        for params, cloud in runs(output):
            seg = Pipeline(params).run(cloud, _unheard)
            if output == "regions":
                seg.cut(regions=3)
                compile_filtration()
    compile_messages()


def _unheard(code: str, text: str) -> None:
    """Take what is said of made clouds."""


def _merges_small(params: Params) -> bool:
    return params.output == "regions" and params.small_regions == "merge"


def _seen_otherwise(cloud: Cloud, params: Params, known: Sensor | None) -> tuple[FloatArray, IntArray, Notice]:
    """Return where a cloud of which nothing is in range is seen from, the rows that are left then, and a notice."""
    sensor = np.zeros(3) if known is None else known.position
    if known is None:
        rows = crop(cloud.xyz, sensor, params, any_range=True, base=cloud.base_pose)
        above_map = position_above_map(cloud.xyz[rows].astype(np.float64))
        if above_map is not None:
            return above_map, rows, taken_for_map(above_map)
    return sensor, np.empty(0, np.int64), no_points_left(cloud, params, sensor)


def _python_warning(code: str, text: str) -> None:
    warnings.warn(f"{text} ({code})", SegmentationWarning, stacklevel=3)


def _thinning_text(given: int, kept: int, left: int, edge: float, params: Params) -> str:
    return (
        f"of {given} points, {kept} were left after the crop, more than max_points = {params.max_points}: thinned to "
        f"{left} with voxels of {1e3 * edge:.3g} mm, whose labels all their points get"
    )
