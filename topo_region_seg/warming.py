# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What all kernels are compiled by: runs with small made clouds, and calls of what no pipeline calls."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud import depth_image
from topo_region_seg.cloud.placing import Transform, moved
from topo_region_seg.cloud.records import read_records, write_labeled_records
from topo_region_seg.compiled.boxes import join_boxes
from topo_region_seg.data import Cloud, FloatArray
from topo_region_seg.growth import growth_of_regions
from topo_region_seg.params import Params
from topo_region_seg.steps.filtration.persistence import filtration
from topo_region_seg.steps.homogeneity import criterion, homogeneity_channels

OUTPUTS = ("regions", "objects", "supervoxels")
"""Each has kernels of its own; most are those of regions, which others use too."""
SIDE = 40
"""Points along each side of what the made cloud holds."""


def made_cloud() -> tuple[FloatArray, npt.NDArray[np.uint8]]:
    """Return points (2 SIDE² + 1, 3) of a table and a thing on it, and colors without order."""
    side = np.linspace(0.0, 0.5, SIDE)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    table = np.column_stack([x, y, np.full(x.size, 1.0)])
    thing = np.column_stack([0.2 * x, 0.2 * y, np.full(x.size, 0.9)])
    xyz = np.concatenate([table, thing, [[0.9, 0.9, 0.5]]])
    # Such colors leave much to do, so that also what makes room for it is compiled.
    return xyz, np.random.default_rng(0).integers(0, 256, xyz.shape).astype(np.uint8)


def made_frame() -> npt.NDArray[np.float32]:
    """Return an image grid (60, 80, 3) of a table, a box and a cup on it, and a wall, seen from above."""
    y, x = np.mgrid[-0.3:0.3:60j, -0.4:0.4:80j]
    depth = np.full(x.shape, 1.0)
    depth[:, :8] = 0.8 + 0.5 * (x[:, :8] + 0.4)
    depth[20:40, 30:50] = 0.9
    cup = np.hypot(x - 0.25, y) < 0.08
    depth[cup] = 0.85 + 5.0 * (x[cup] - 0.25) ** 2
    depth += np.random.default_rng(0).normal(scale=1e-3, size=depth.shape)
    depth[:2, :2] = np.nan
    return np.stack([x * depth, y * depth, depth], axis=2).astype(np.float32)


def runs(output: str) -> Iterator[tuple[Params, Cloud]]:
    """Yield parameters and clouds whose segmentation needs all kernels of an output."""
    xyz, rgb = made_cloud()
    single = xyz.astype(np.float32)
    frame = made_frame()
    seen = frame.reshape(-1, 3)
    if output == "regions":
        yield Params(max_radius=0.02), Cloud(single, rgb, 1, len(xyz))
        yield Params(voxel_size=0.0), Cloud(xyz, rgb, 1, len(xyz))
        grid = 2 * SIDE**2
        for shape in ((2 * SIDE, SIDE), (1, grid)):
            yield Params(), Cloud(single[:grid], rgb[:grid], *shape)
        yield Params(), Cloud(seen, np.zeros(seen.shape, np.uint8), *frame.shape[:2])
    elif output == "objects":
        yield Params(output="objects"), Cloud(single, rgb, 1, len(xyz))
        for points, rows in ((seen, len(frame)), (seen[np.isfinite(seen[:, 2])], 1)):
            yield Params(output="objects"), Cloud(points, None, rows, len(points) // rows)
    else:
        yield Params(output="supervoxels"), Cloud(single, rgb, 1, len(xyz))
        colors = np.zeros(seen.shape, np.uint8)
        yield Params(output="supervoxels"), Cloud(seen, colors, *frame.shape[:2])
        yield Params(output="supervoxels", features="color"), Cloud(seen, colors, *frame.shape[:2])


def compile_filtration() -> None:
    """Compile what only points as even as these need, which have more edges at one scale than a forest needs.

    And what only clouds need that are large enough for a tree that several threads build.
    """
    join_boxes(np.zeros((1, 3, 2, 4), np.float32), 0, 1, 2)  # type: ignore[no-untyped-call]
    dense = 0.001 * np.stack(np.meshgrid(*[np.arange(6.0)] * 3), axis=-1).reshape(-1, 3)
    growth = growth_of_regions(Params())
    channels = homogeneity_channels(dense, np.zeros_like(dense), np.ones_like(dense), growth)
    filtration(channels, criterion(growth, growth.max_radius), growth.max_radius)


def compile_messages() -> None:
    """Compile what reads and writes messages."""
    data = np.zeros(20, np.uint8)
    data.flags.writeable = False
    floats, colors = np.zeros((1, 3), np.float32), np.zeros((1, 3), np.uint8)
    read_records(data, 1, 1, 20, 20, (0, 4, 8), (18, 17, 16), floats, colors)
    record = np.zeros((1, 5), np.float32)
    write_labeled_records(floats, colors, np.zeros(1, np.uint32), record, record.view(np.uint32))
    depth_image.warm_up()
    moved(Cloud(floats, None, 1, 1), Transform(np.eye(3), np.zeros(3)))
