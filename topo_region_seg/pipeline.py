# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The one path from a cloud to its regions, in the steps of the paper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt

from topo_region_seg.beyond.auto_scale.local_units import local_units
from topo_region_seg.beyond.objects.grooves import find_grooves
from topo_region_seg.clock import Clock
from topo_region_seg.cloud.records import read_records, write_labeled_records
from topo_region_seg.compiled.kd_tree import position_tree
from topo_region_seg.compiled.selection import gather, gather_columns
from topo_region_seg.data import Cloud, Features, FloatArray, IntArray, Segmentation
from topo_region_seg.params import Params
from topo_region_seg.segmentation import Filtered
from topo_region_seg.steps.color import srgb_to_lab
from topo_region_seg.steps.crop import crop
from topo_region_seg.steps.filtration.persistence import filtration
from topo_region_seg.steps.homogeneity import criterion, homogeneity_channels
from topo_region_seg.steps.normals.estimate import estimate_normals
from topo_region_seg.steps.support import above, find_floor
from topo_region_seg.steps.thinning import thin_for


class MissingColorError(ValueError):
    """The cloud has no color, and the criterion needs it."""


class Pipeline:
    """Segments one cloud after another; holds nothing but its parameters, so threads may share it."""

    def __init__(self, params: Params | None = None) -> None:
        self.params = params or Params()
        self._used = self.params.of_level()

    def run(self, cloud: Cloud, warn: Callable[[str, str], None] | None = None) -> Segmentation:
        """Segment a cloud.

        Parameters
        ----------
        cloud : Cloud
            As decoded, invalid points included.
        warn : callable, optional
            Called with (code, text) where the cloud had to be thinned to `max_points`.

        Raises
        ------
        MissingColorError
            If the cloud has no color and ``params.features`` is not ``normals``.
        """
        params = self._used
        if cloud.rgb is None and params.uses_color:
            raise MissingColorError(
                f"the cloud has no color, but features is '{params.features}'; set features to 'normals'"
            )
        clock = Clock()
        with clock("crop"):
            rows = crop(cloud.xyz, params)
            xyz = gather_columns(cloud.xyz, rows)
        units = None
        if params.auto:
            with clock("local_units"):
                units = local_units(xyz, rows, cloud.width, cloud.height)
        with clock("floor"):
            plane, distance = None, params.floor_distance if units is None else units.floor_distance(params)
            if params.remove_floor:
                plane = find_floor(xyz, params.replace(floor_distance=distance))
            if plane is not None:
                kept = above(xyz, plane, distance)
                rows, xyz = rows[kept], gather(xyz, kept)
            else:
                xyz = np.ascontiguousarray(xyz)
        with clock("thinning"):
            points = _Points(rows, xyz, None if cloud.rgb is None else cloud.rgb[rows], params)
        if warn is not None and points.edge > params.voxel_size:
            warn("thinned", _thinning_text(len(cloud), len(rows), len(points.xyz), points.edge, params))
        with clock("color"):
            seen = params.uses_color or params.level == "objects"
            lab = srgb_to_lab(points.rgb) if points.rgb is not None and seen else None
        with clock("normals"):
            tree = position_tree(points.xyz)
            radius = None if units is None else units.normal_radius(points.xyz, params)
            normals = estimate_normals(points.xyz, tree, params, radius) if params.uses_normals else None
        local, compared = points.xyz, normals
        if units is not None:
            with clock("local_units"):
                local = units.at(points.xyz)
                tree = tree if local is points.xyz else position_tree(local)
        if params.level == "objects" and normals is not None:
            with clock("grooves"):
                compared = normals.copy()
                compared[find_grooves(points.xyz, normals, tree, params)] = np.nan
        with clock("filtration"):
            channels = homogeneity_channels(local, lab, compared, params)
            limits = criterion(params)
            components = filtration(channels, limits, params.reach, tree, needs_normals=not params.uses_color)
        filtered = Filtered(
            xyz=points.xyz,
            weight=points.weight,
            index=points.index,
            carry_back=partial(points.carry_back, n=len(cloud)),
            channels=channels,
            tree=tree,
            components=components,
            features=Features(lab, normals),
            plane=plane,
            params=params,
        )
        if params.auto:
            with clock("stable_scale"):
                params = params.replace(max_radius=params.reach, radius=filtered.stable_scale())
            filtered = replace(filtered, params=params)
        return filtered.segmentation(params, clock)


def warm_up() -> None:
    """Compile all kernels, or load them from the cache, by segmenting a small made cloud in different ways."""
    side = np.linspace(0.0, 0.5, 40)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    table = np.column_stack([x, y, np.full(x.size, 1.0)])
    thing = np.column_stack([0.2 * x, 0.2 * y, np.full(x.size, 0.9)])
    xyz = np.concatenate([table, thing, [[0.9, 0.9, 0.5]]])
    # Colors without order leave much to do, so that also what makes room for it is compiled.
    rgb = np.random.default_rng(0).integers(0, 256, xyz.shape).astype(np.uint8)
    for dtype, params in ((np.float32, Params()), (np.float64, Params(voxel_size=0.0))):
        Pipeline(params).run(Cloud(xyz.astype(dtype), rgb, 1, len(xyz))).cut(regions=3)
    Pipeline(Params(level="objects")).run(Cloud(xyz.astype(np.float32), rgb, 1, len(xyz)))
    auto, grid = Params.from_mapping({"max_radius": "auto"}), 2 * table.shape[0]
    Pipeline(auto).run(Cloud(xyz[:grid].astype(np.float32), rgb[:grid], 2 * len(side), len(side)))
    data = np.zeros(20, np.uint8)
    data.flags.writeable = False
    floats, colors = np.zeros((1, 3), np.float32), np.zeros((1, 3), np.uint8)
    read_records(data, 1, 1, 20, 20, (0, 4, 8), (18, 17, 16), floats, colors)
    record = np.zeros((1, 5), np.float32)
    write_labeled_records(floats, colors, np.zeros(1, np.uint32), record, record.view(np.uint32))
    # A heap has more edges at one scale than a forest needs.
    heap = np.random.default_rng(0).normal(scale=0.001, size=(300, 3))
    limits = criterion(Params())
    filtration(homogeneity_channels(heap, np.zeros_like(heap), np.ones_like(heap), Params()), limits, Params().reach)


class _Points:
    """The points that the filtration sees, and the input rows that each one stands for."""

    def __init__(self, rows: IntArray, xyz: FloatArray, rgb: npt.NDArray[np.uint8] | None, params: Params) -> None:
        self._rows = rows
        thinned = thin_for(params, xyz, rgb)
        self.edge = 0.0 if thinned is None else thinned.edge
        if thinned is not None:
            self.xyz, self.rgb, self.index = thinned.xyz, thinned.rgb, rows[thinned.first]
            self._stand_in: IntArray | None = thinned.voxel
            self.weight = thinned.weight
        else:
            self.xyz, self.rgb, self.index = xyz, rgb, rows
            self._stand_in = None
            self.weight = np.ones(len(rows), np.int64)

    def carry_back(self, labels: npt.NDArray[np.uint32], n: int) -> npt.NDArray[np.uint32]:
        """Return the labels of all `n` input rows; 0 where a row was cropped."""
        full = np.zeros(n, np.uint32)
        full[self._rows] = labels if self._stand_in is None else labels[self._stand_in]
        return full


def _thinning_text(given: int, kept: int, left: int, edge: float, params: Params) -> str:
    return (
        f"of {given} points, {kept} were left after the crop, more than max_points = {params.max_points}: thinned to "
        f"{left} with voxels of {1e3 * edge:.3g} mm, whose labels all their points get"
    )
