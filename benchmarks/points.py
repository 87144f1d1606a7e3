# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Points with the features that the core compares, so that every program is given the same."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import topo_region_seg as trs

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Points:
    """A named cloud: positions (m), CIELAB colors and unit normals, all (N, 3) float64, all finite.

    Positions hold values that float32 has too, so that programs in single precision get the same points.
    `grid` is the width and height of the organized cloud that the points were taken from, if any, and `pixel` (N,)
    the row of each in it.
    """

    name: str
    xyz: FloatArray
    lab: FloatArray
    normals: FloatArray
    grid: tuple[int, int] | None = None
    pixel: npt.NDArray[np.integer] | None = None

    def __len__(self) -> int:
        return len(self.xyz)

    def take(self, rows: npt.NDArray[np.integer], name: str) -> Points:
        """Return some of the points as a cloud of another name."""
        pixel = None if self.pixel is None else self.pixel[rows]
        return Points(name, self.xyz[rows], self.lab[rows], self.normals[rows], self.grid, pixel)

    def components(self, params: trs.Params) -> trs.Components:
        """Run the core: from positions, colors and normals to components and exact deaths."""
        return trs.persistent_components(self.xyz, self.lab, self.normals, params)


def single(xyz: npt.ArrayLike) -> FloatArray:
    """Round to what float32 can hold."""
    return np.asarray(xyz, np.float32).astype(np.float64)


def unit(vectors: npt.ArrayLike) -> FloatArray:
    """Scale rows to length 1."""
    vectors = np.asarray(vectors, np.float64)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def featured(name: str, cloud: trs.Cloud, params: trs.Params) -> Points:
    """Let the pipeline compute the features of a cloud's points, not thinned.

    Points without a normal are left out: other programs have no such thing.
    """
    seg = trs.Pipeline(params.replace(voxel_size=0.0)).run(cloud)
    lab, normals = seg.features.lab, seg.features.normals
    assert lab is not None and normals is not None
    kept = np.flatnonzero(np.isfinite(normals).all(axis=1))
    grid = (cloud.width, cloud.height)
    return Points(name, single(seg.barcode.xyz[kept]), lab[kept], normals[kept], grid, seg.index[kept])


def pack_rgb(rgb: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    """Pack (N, 3) 8-bit colors as PCL does: the bits of 0x00RRGGBB in a float32, shape (N,)."""
    packed = np.zeros((len(rgb), 4), np.uint8)
    for channel in range(3):  # columns one by one: several times faster than all in one assignment
        packed[:, channel] = rgb[:, 2 - channel]
    return packed.view("<f4")[:, 0]
