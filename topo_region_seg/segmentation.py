# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The regions at any scale of one filtration, cut from its merge tree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from topo_region_seg.beyond.adjacency import adjacency
from topo_region_seg.beyond.auto_scale.stability import stability
from topo_region_seg.beyond.objects.unite import unite_objects
from topo_region_seg.beyond.supervoxels.patches import supervoxels
from topo_region_seg.clock import Clock
from topo_region_seg.compiled.kd_tree import Tree
from topo_region_seg.data import (
    Adjacency,
    Barcode,
    Components,
    Features,
    FloatArray,
    IntArray,
    LabelArray,
    Plane,
    Segmentation,
)
from topo_region_seg.params import FEWEST_SPACINGS, REFERENCE_SPACING, Params
from topo_region_seg.steps.homogeneity import criterion
from topo_region_seg.steps.regions import describe_regions, number_regions
from topo_region_seg.steps.scales.counts import region_counts
from topo_region_seg.steps.small_regions import settle_small_regions

SAME = 0.8
"""Share of what becomes of it and another that a region must be to count as still the same. Less would let regions of
like size pass for one of them, more would end a region with every bit that it gains."""


@dataclass(frozen=True)
class Filtered:
    """A cloud after its filtration: all that the regions of a scale are made from.

    Parameters
    ----------
    xyz : (N, 3) float64
        The preprocessed points, metres. Their positions in `channels` and `tree` are others where `max_radius` is auto.
    weight, index : (N,) int64
        How many input points each of them stands for, and the row of the first.
    carry_back : callable
        Makes the labels of all input points from those of the preprocessed ones.
    channels : (N, 9) float64
        Positions (m), colors and normals as the criterion compares them.
    tree : Tree
        Tree over the positions.
    components : Components
        The whole filtration, up to `max_radius`.
    features : Features
        Features of the preprocessed points.
    plane : Plane or None
        The removed support plane.
    params : Params
        The parameters of the run.
    """

    xyz: FloatArray
    weight: IntArray
    index: IntArray
    carry_back: Callable[[LabelArray], LabelArray]
    channels: FloatArray
    tree: Tree
    components: Components
    features: Features
    plane: Plane | None
    params: Params

    def at(self, radius: float) -> Segmentation:
        """Return the segmentation at a scale, metres, above 0 up to `max_radius`."""
        if not 0.0 < radius <= self.params.max_radius:
            raise ValueError(f"radius is {radius}, must be above 0 and at most max_radius, {self.params.max_radius}")
        return self.segmentation(self.params.replace(radius=float(radius)), Clock())

    def segmentation(self, params: Params, clock: Clock) -> Segmentation:
        """Return the segmentation at `params.scale`, other parameters being those of the run."""
        patches = params.mode == "supervoxels"
        with clock("supervoxels" if patches else "small_regions" if params.level == "regions" else "objects"):
            components = self._components_at(params)
            if patches:
                region = supervoxels(self.channels, self.tree, components.root, self.weight, params)
            else:
                region = self._settled(components)
        with clock("regions"):
            return self._described(region, components, params, clock)

    def divided(self, seg: Segmentation, region: IntArray) -> Segmentation:
        """Return one of these segmentations with other regions of its points, (N,), counted from 0; -1 for none."""
        return self._described(region, self._components_at(seg.params), seg.params, Clock(seg.ms))

    def _components_at(self, params: Params) -> Components:
        whole = params.scale == self.components.max_radius
        return self.components if whole else self.components.cut(params.scale)

    def _described(self, region: IntArray, components: Components, params: Params, clock: Clock) -> Segmentation:
        labels = number_regions(self.xyz, region, self.weight)
        return Segmentation(
            labels=self.carry_back(labels),
            regions=describe_regions(self.xyz, self.features, labels, self.weight, components),
            barcode=self._barcode(labels),
            components=self.components,
            index=self.index,
            features=self.features,
            plane=self.plane,
            params=params,
            scales=self,
            ms=clock.ms,
        )

    def radius_of(self, regions: int) -> float:
        """Return a scale with at least so many regions, metres, as `Segmentation.cut` says."""
        if self.params.mode == "supervoxels":
            raise ValueError(
                "cut(regions=...) counts regions, not supervoxels; cut at a radius, or change seed_spacing"
            )
        radius, large, most = self._candidates()
        if self.params.small_regions == "remove":
            enough = np.flatnonzero(large >= regions)
            return float(radius[enough[-1] if len(enough) else np.flatnonzero(large == np.max(large))[-1]])
        # Merging makes regions of small ones too; how many, only doing it can tell.
        sure, possible = np.flatnonzero(large >= regions), np.flatnonzero(most >= regions)
        low = int(sure[-1]) if len(sure) else 0
        high = int(possible[-1]) if len(possible) else len(radius) - 1
        found: dict[int, int] = {}

        def enough_at(place: int) -> bool:
            region = self._settled(self.components.cut(float(radius[place])))
            found[place] = int(np.max(region, initial=-1)) + 1
            return found[place] >= regions

        place, above, step = high, high + 1, 1
        while not (len(sure) and place == low) and not enough_at(place):
            if place == low:
                return float(radius[max(found, key=lambda one: (found[one], one))])
            above, place, step = place, max(high - step, low), 2 * step
        while above - place > 1:
            middle = (place + above) // 2
            if enough_at(middle):
                place = middle
            else:
                above = middle
        return float(radius[place])

    def stable_scale(self) -> float:
        """Return the scale whose regions stay the same for longest, as a ratio of scales, in the mean over the points.

        It lies between FEWEST_SPACINGS and the end of the filtration. This is the gap that ToMATo looks for in a
        barcode (Chazal, Guibas, Oudot and Skraba, Persistence-based clustering in Riemannian manifolds, 2013), but for
        each region: in a cloud of many things two of them join at nearly every scale.
        """
        death, least, last = self.components.death, FEWEST_SPACINGS * REFERENCE_SPACING, self.components.max_radius
        order = np.argsort(death, kind="stable")[: np.count_nonzero(np.isfinite(death))]
        lasting = stability(
            self.components.parent,
            order,
            np.minimum(death, last),
            self.weight,
            self.params.min_region_size,
            SAME,
            least,
        )
        begins = np.maximum(np.append(least, death[order]), least)
        ends = np.append(begins[1:], last)
        places = np.flatnonzero(ends > begins)
        best = places[np.argmax(lasting[places])]
        return float(np.sqrt(begins[best] * ends[best]))

    def adjacency(self, labels: LabelArray, radius: float) -> Adjacency:
        """Return which regions touch, given the labels of the preprocessed points."""
        return adjacency(np.ascontiguousarray(self.channels[:, :3]), labels, self.tree, radius)

    def _candidates(self) -> tuple[FloatArray, IntArray, IntArray]:
        """Return, for all scales that differ, the largest of those alike, and the least and largest count of regions.

        All are (K,), the smallest scale first; the least count is that of components that are not small.
        """
        death, size = self.components.death, self.params.min_region_size
        order = np.argsort(death, kind="stable")[: np.count_nonzero(np.isfinite(death))]
        large, rest = region_counts(self.components.parent, order, self.weight, size)
        radius = np.append(np.nextafter(death[order], 0.0), self.components.max_radius)
        # Deaths at one scale come together, and those at 0, where points coincide, before every scale.
        whole = (radius > 0.0) & (radius >= np.append(0.0, death[order]))
        return radius[whole], large[whole], np.maximum(large + rest // size, 1)[whole]

    def _settled(self, components: Components) -> IntArray:
        normals = self.features.normals
        if self.params.level == "objects" and normals is not None:
            loose = np.isnan(self.channels[:, 6])
            return unite_objects(self.xyz, normals, loose, self.tree, components.root, self.weight, self.params)
        limits = criterion(self.params)
        return settle_small_regions(self.channels, self.tree, components.root, self.weight, limits, self.params)

    def _barcode(self, labels: LabelArray) -> Barcode:
        return Barcode(
            xyz=self.xyz,
            birth=np.zeros(len(labels)),
            death=self.components.death,
            label=labels,
            steps=self.params.filtration_steps,
            max_radius=self.components.max_radius,
        )
