# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The regions, objects or supervoxels of a filtered cloud at a scale: what the parameter `output` chooses."""

from __future__ import annotations

import numpy as np

from topo_region_seg.beyond.objects.grid_objects import Objects, objects_of_points
from topo_region_seg.beyond.objects.unite import unite_objects
from topo_region_seg.beyond.supervoxels.patches import supervoxels, supervoxels_of_blocks
from topo_region_seg.compiled.partition import count_off
from topo_region_seg.data import IntArray
from topo_region_seg.params import Params
from topo_region_seg.steps.homogeneity import criterion
from topo_region_seg.steps.scales.filtered_cloud import FilteredCloud, components_at
from topo_region_seg.steps.small_regions.settle import settle_small_regions

STAGES = {"regions": "small_regions", "objects": "objects", "supervoxels": "supervoxels"}
"""The stage that makes the regions of each output, as `ms` names it."""


def regions_of_output(filtered: FilteredCloud, params: Params, scale: float) -> IntArray | Objects:
    """Return the region of each preprocessed point, from 0; -1 for none; with confidence where that is known."""
    channels, weight = filtered.channels, filtered.weight
    normals, limits = filtered.features.normals, criterion(filtered.growth, scale)
    if filtered.blocks is not None:
        return supervoxels_of_blocks(filtered.xyz, channels, filtered.blocks, weight, limits, params)
    tree, components = filtered.tree, components_at(filtered, scale)
    if params.output == "supervoxels":
        return supervoxels(filtered.xyz, channels, tree, components.root, weight, limits, params)
    if params.output == "objects" and filtered.scene is not None and filtered.pixel is not None and normals is not None:
        region, _ = count_off(components.root, weight)
        loose = np.isnan(channels[:, 6])
        given = filtered.scene, filtered.pixel, normals, np.where(loose, -1, region), filtered.lengths
        return objects_of_points(*given, params)
    if params.output == "objects" and normals is not None:
        loose = np.isnan(channels[:, 6])
        return unite_objects(filtered.xyz, normals, loose, tree, components.root, weight, params)
    return settle_small_regions(channels, tree, components.root, weight, limits, params, filtered.near)
