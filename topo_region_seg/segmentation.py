# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The result for one cloud, and the results at other scales of the same filtration."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from topo_region_seg.beyond.adjacency import adjacency
from topo_region_seg.beyond.objects.grid_objects import Objects
from topo_region_seg.clock import Clock
from topo_region_seg.compiled.kd_tree import position_tree
from topo_region_seg.compiled.threads import at_most
from topo_region_seg.data import (
    Adjacency,
    Barcode,
    BoolArray,
    Components,
    Features,
    FloatArray,
    IntArray,
    LabelArray,
    Notice,
    Plane,
    RegionTable,
)
from topo_region_seg.output import STAGES, regions_of_output
from topo_region_seg.params import Params
from topo_region_seg.steps.regions import describe_regions, number_regions
from topo_region_seg.steps.scales.classes import bars_of_regions, classes_of
from topo_region_seg.steps.scales.filtered_cloud import (
    FilteredCloud,
    labels_of_input,
    positions_of_input,
)
from topo_region_seg.steps.scales.point_classes import PointClasses, point_classes
from topo_region_seg.steps.scales.search import scale_with_kept_regions, scale_with_merged_regions
from topo_region_seg.steps.view.model import SensorModel
from topo_region_seg.steps.view.scene import Surface


@dataclass(frozen=True)
class Segmentation:
    """The result for one cloud.

    Parameters
    ----------
    labels : (N,) uint32
        Label of every input point; 0 = no region, regions count from 1, largest first,
        unless labels are kept over frames.
    regions : RegionTable
        Properties of the regions.
    point_labels : (M,) uint32
        Label of every preprocessed point.
    index : (M,) int64
        Row of the preprocessed points in the input (of the first point of a voxel where the cloud was thinned).
    features : Features
        Features of the preprocessed points.
    plane : Plane or None
        The removed support plane.
    params : Params
        The parameters asked for: a run with them gives the same labels.
    scale : float
        Scale of the regions, metres. Where `max_radius` is auto it is the scale that was chosen, as it is where the
        points are no farther apart than 1.9 mm; it grows with their spacing.
    filtered : FilteredCloud
        What the regions of other scales are made from.
    ms, cpu_ms : dict of str to float
        Milliseconds per stage, in order of execution, and those of CPU time in the threads that worked at it.
    notices : tuple of Notice
        What a user should know about the result.
    unsure : (M,) bool, optional
        Which preprocessed points are in segments below `min_confidence`; None where there is no confidence.
    """

    labels: LabelArray
    regions: RegionTable
    point_labels: LabelArray
    index: IntArray
    features: Features
    plane: Plane | None
    params: Params
    scale: float
    filtered: FilteredCloud = field(repr=False)
    ms: dict[str, float] = field(default_factory=dict)
    cpu_ms: dict[str, float] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()
    unsure: BoolArray | None = field(default=None, repr=False)

    @property
    def components(self) -> Components:
        """Exact components and deaths of the preprocessed points, before small regions were dealt with.

        The filtration runs when they are first asked for, where the output needs none: supervoxels of images.
        """
        return self.filtered.components

    @property
    def barcode(self) -> Barcode:
        """The H0 barcode of the preprocessed points; like the components it may take a filtration."""
        return Barcode(
            xyz=self.points,
            birth=np.zeros(len(self.point_labels)),
            death=self.components.death,
            label=self.point_labels,
            steps=self.params.filtration_steps,
            max_radius=self.components.max_radius,
        )

    @property
    def region_bars(self) -> FloatArray:
        """Birth and death of each region as a class of the merge tree, (R, 2), metres.

        A region is born at the scale at which a component first holds `min_region_size` input points, and dies where it
        joins an older one; inf where it does not up to the end of the filtration. An object has the bar of the oldest
        class in it. Of supervoxels, which are parts of classes, both are NaN.
        """
        bars = _bars(self.filtered, self.params, self.scale, self.point_labels, self.regions.label)
        return np.column_stack(bars)

    @property
    def points(self) -> FloatArray:
        """Positions of the preprocessed points, (M, 3), metres, in the frame of the input."""
        return positions_of_input(self.filtered, self.filtered.xyz)

    @property
    def point_classes(self) -> PointClasses:
        """What became of every input point, as :class:`PointClass` counts, (N,) uint8; made when it is asked for."""
        return point_classes(self.filtered, self.labels, self.unsure)

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """Support and structure that were found and set aside, the support first, seen from the sensor at the origin.

        Empty unless the output is objects and the cloud is a camera's image, or what is left of one.
        """
        scene = self.filtered.scene
        if scene is None:
            return ()
        return (() if scene.support is None else (scene.support,)) + scene.structure

    @property
    def sensor_model(self) -> SensorModel | None:
        """The angle between pixels, the noise by depth and the share of valid pixels, as the frame shows them.

        None unless the output is objects and the cloud is a camera's image, or what is left of one.
        """
        return None if self.filtered.scene is None else self.filtered.scene.model

    def cut(self, radius: float | None = None, *, regions: int | None = None) -> Segmentation:
        """Return the segmentation at another scale of the same filtration.

        Labels and regions are those of a new run with `radius` (of objects: `object_radius`) set to the scale;
        components, barcode and the persistence of regions remain those of the whole filtration, so that any result may
        be cut again.

        Parameters
        ----------
        radius : float, optional
            The scale, metres, above 0 up to that of the filtration.
        regions : int, optional
            Instead of `radius`: the largest scale with at least so many components of `min_region_size` input points;
            where no scale has as many, the largest of those with the most. Each of them is a region. Where small ones
            are merged, more regions may be made of these.
            Objects are counted themselves: their scale is searched down from the largest in growing steps and by
            halving. It has at least so many and the next larger one has fewer, but a still larger one may have as many
            too; where none is found, it is that with the most of those looked at.

        Returns
        -------
        Segmentation
            Its `scale` is the new scale. So is ``params.radius`` (of objects: ``params.object_radius``).

        Raises
        ------
        ValueError
            If not one of the two is given, `radius` is out of range, or supervoxels are to be counted.
        """
        if (radius is None) == (regions is None):
            raise ValueError("give either radius or regions")
        last = self.filtered.growth.max_radius
        if radius is not None and not 0.0 < radius <= last:
            raise ValueError(f"radius is {radius}, must be above 0 and at most the filtration's last scale, {last}")
        with at_most(self.params.threads):
            if radius is None:
                radius = _scale_with(self.filtered, self.params, int(regions or 0))
            return segmentation_at(self.filtered, _params_of_cut(self.params, float(radius)), float(radius), Clock())

    def adjacency(self, radius: float | None = None) -> Adjacency:
        """Return which regions touch, and how many pairs of points at their border are near.

        Parameters
        ----------
        radius : float, optional
            Largest distance of two such points, metres; unless given, the radius of normals, within which points count
            as one surface: it grows with the spacing of points where `max_radius` is auto.

        Raises
        ------
        ValueError
            If `radius` is not above 0.
        """
        filtered, tree = self.filtered, self.filtered.tree
        positions = np.ascontiguousarray(filtered.channels[:, :3])
        if radius is None:
            radius = filtered.growth.normal_radius
        elif not radius > 0.0:
            raise ValueError(f"radius is {radius}, must be above 0 m")
        elif not np.array_equal(positions, filtered.xyz):
            positions, tree = filtered.xyz, position_tree(filtered.xyz)
        return adjacency(positions, self.point_labels, tree, radius)

    def divided(self, region: IntArray) -> Segmentation:
        """Return this segmentation with other regions of the preprocessed points, (M,), from 0; -1 for none."""
        divided = _described(self.filtered, region, self.params, self.scale, Clock(self.ms, self.cpu_ms))
        return replace(divided, unsure=self.unsure)


def segmentation_at(filtered: FilteredCloud, params: Params, scale: float, clock: Clock) -> Segmentation:
    """Return the segmentation of a cloud at a scale, metres."""
    with clock(STAGES[params.output]):
        found = regions_of_output(filtered, params, scale)
    with clock("regions"):
        if not isinstance(found, Objects):
            return _described(filtered, found, params, scale, clock)
        seg = _described(filtered, found.region, params, scale, clock, found.confidence)
        return replace(seg, unsure=found.unsure)


def _described(
    filtered: FilteredCloud,
    region: IntArray,
    params: Params,
    scale: float,
    clock: Clock,
    confidence: FloatArray | None = None,
) -> Segmentation:
    labels = number_regions(filtered.xyz, region, filtered.weight)
    number = np.arange(1, int(np.max(labels, initial=0)) + 1, dtype=np.uint32)
    birth, death = _bars(filtered, params, scale, labels, number)
    persistence = np.minimum(death, filtered.growth.max_radius) - birth
    table = describe_regions(filtered.xyz, filtered.features, labels, filtered.weight, persistence)
    if confidence is not None:
        known = np.flatnonzero(region >= 0)
        by_label = np.empty(len(table))
        by_label[labels[known].astype(np.int64) - 1] = confidence[region[known]]
        table = replace(table, confidence=by_label)
    centroid, minimum, maximum = (
        positions_of_input(filtered, column) for column in (table.centroid, table.minimum, table.maximum)
    )
    return Segmentation(
        labels=labels_of_input(filtered, labels),
        regions=replace(table, centroid=centroid, minimum=minimum, maximum=maximum),
        point_labels=labels,
        index=filtered.index,
        features=filtered.features,
        plane=filtered.plane,
        params=params,
        scale=scale,
        filtered=filtered,
        ms=clock.ms,
        cpu_ms=clock.cpu_ms,
    )


def _bars(
    filtered: FilteredCloud, params: Params, scale: float, labels: LabelArray, of: LabelArray
) -> tuple[FloatArray, FloatArray]:
    """Return birth and death, metres, of regions `of` (R,) from the labels (N,) of points; NaN for supervoxels."""
    if params.output == "supervoxels":
        return np.full(len(of), np.nan), np.full(len(of), np.nan)
    classes = classes_of(filtered.components, filtered.weight, params.min_region_size)
    return bars_of_regions(classes, scale, labels, of)


def _scale_with(filtered: FilteredCloud, params: Params, regions: int) -> float:
    if params.output == "supervoxels":
        raise ValueError("cut(regions=...) counts regions, not supervoxels; cut at a radius, or change seed_spacing")
    given = filtered.components, filtered.weight, params.min_region_size, regions
    if params.output == "regions":
        return scale_with_kept_regions(*given)

    def count_at(scale: float) -> int:
        found = regions_of_output(filtered, params, scale)
        region = found.region if isinstance(found, Objects) else found
        return int(np.max(region, initial=-1)) + 1

    return scale_with_merged_regions(*given, count_at)


def _params_of_cut(params: Params, radius: float) -> Params:
    """Return the parameters of a run whose regions are those of the scale."""
    return params.replace(**{"object_radius" if params.output == "objects" else "radius": radius})
