# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What flows through the pipeline: frozen dataclasses over C-contiguous NumPy arrays."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
IndexArray = npt.NDArray[np.int32]
BoolArray = npt.NDArray[np.bool_]
LabelArray = npt.NDArray[np.uint32]


@dataclass(frozen=True)
class Cloud:
    """A colored point cloud as a sensor delivers it, invalid points included.

    Parameters
    ----------
    xyz : (N, 3) float32 or float64
        Positions in the sensor frame, metres; invalid points hold NaN, infinities or zeros.
    rgb : (N, 3) uint8 or None
        8-bit sRGB, or None for a cloud without color.
    height, width : int
        Organization; ``height * width == N``, and ``height == 1`` for an unorganized cloud.
    sensor_pose : tuple of 7 floats, optional
        Where the sensor was in the frame of the positions: x, y, z (m) and the unit quaternion w, x, y, z, as the
        VIEWPOINT of a PCD file has it. None: not known; taken to be the origin.
    base_pose : tuple of 7 floats, optional
        Where the robot's base frame was, likewise; `up` and `crop_box` are in it then. None: they are in the frame of
        the positions.
    """

    xyz: npt.NDArray[np.floating]
    rgb: npt.NDArray[np.uint8] | None
    height: int
    width: int
    sensor_pose: tuple[float, ...] | None = None
    base_pose: tuple[float, ...] | None = None

    def __len__(self) -> int:
        return len(self.xyz)

    @property
    def organized(self) -> bool:
        """Whether the points form an image grid."""
        return self.height > 1


@dataclass(frozen=True)
class Notice:
    """Something that a user should know about a result.

    Parameters
    ----------
    code : str
        Stable snake_case code, for counters and logs.
    text : str
        One line: what, and what to do about it.
    """

    code: str
    text: str


class SegmentationWarning(UserWarning):
    """A notice about a result that nobody else takes, as a Python warning."""


@dataclass(frozen=True)
class Plane:
    """The removed support plane ``normal · x + offset = 0``; `normal` (unit) points towards the sensor."""

    normal: tuple[float, float, float]
    offset: float


class PointClass(IntEnum):
    """What became of an input point: why it has a label, or none."""

    NOTHING = 0
    """It is invalid, out of range, cropped, or hidden by another point of its pixel."""
    SUPPORT = 1
    """On the support plane; also behind it, unless the output is objects and the cloud is a camera's image."""
    BEHIND = 2
    """Behind the support plane, as the floor beside a table is."""
    STRUCTURE = 3
    """On another surface that is no thing, such as a wall."""
    LABELED = 4
    """In a region, an object or a patch."""
    UNSURE = 5
    """In a segment whose confidence is below `min_confidence`."""
    LOOSE = 6
    """In none of these, nor in anything else that is large enough."""


@dataclass(frozen=True)
class Features:
    """What the homogeneity criterion compares (paper, section IV.C), one row per preprocessed point.

    Parameters
    ----------
    lab : (N, 3) float64 or None
        CIELAB (D65, 2 degree observer).
    normals : (N, 3) float64 or None
        Unit normals towards the sensor; a row of NaN where a point has none.
    """

    lab: FloatArray | None
    normals: FloatArray | None


@dataclass(frozen=True)
class Components:
    """H0 of the filtration (paper, sections IV.B and IV.D), and its merge tree.

    Parameters
    ----------
    root : (N,) int64
        Smallest point id of the component of the point at `max_radius`.
    parent : (N,) int64
        Smallest point id of the component of the point at the scale of its death; the point itself for survivors.
    death : (N,) float64
        Scale at which the component represented by the point dies, metres; inf for survivors.
    max_radius : float
        Last scale of the filtration, metres.
    """

    root: IntArray
    parent: IntArray
    death: FloatArray
    max_radius: float

    def cut(self, radius: float | None = None, *, regions: int | None = None) -> Components:
        """Return the components at a smaller scale, the same as those of a filtration that ends there.

        Parameters
        ----------
        radius : float, optional
            The scale, metres, 0 to `max_radius`.
        regions : int, optional
            Instead of `radius`: the largest scale with at least so many components; of those with the most, where
            there are never as many.

        Raises
        ------
        ValueError
            If not one of the two is given, or `radius` is out of range.
        """
        if (radius is None) == (regions is None):
            raise ValueError("give either radius or regions")
        if radius is None:
            radius = self._scale_of(int(regions or 0))
        elif not 0.0 <= radius <= self.max_radius:
            raise ValueError(f"radius is {radius}, must be between 0 and max_radius, {self.max_radius}")
        dead, ids = self.death <= radius, np.arange(len(self.death))
        parent = np.where(dead, self.parent, ids)
        root = parent
        while (root != (above := root[root])).any():
            root = above
        return Components(root, parent, np.where(dead, self.death, np.inf), float(radius))

    def _scale_of(self, regions: int) -> float:
        death = np.sort(self.death)
        # The first death that there must not be; what coincides is one at every scale.
        place = max(len(death) - regions, int(np.searchsorted(death, 0.0, side="right")))
        if place >= len(death) or np.isinf(death[place]):
            return self.max_radius
        return float(np.nextafter(death[place], 0.0))

    def scales(self, steps: int) -> FloatArray:
        """Return the scales r_1..r_S of a filtration of `steps` steps, shape (steps,), metres."""
        scales = np.arange(1, steps + 1) * self.max_radius / steps
        scales[-1] = self.max_radius
        return scales

    def stepped(self, steps: int) -> FloatArray:
        """Return the deaths rounded up to the next of `steps` equal steps (the paper's deaths), shape (N,)."""
        scales = np.append(self.scales(steps), np.inf)
        return scales[np.searchsorted(scales, self.death)]

    def counts(self, steps: int) -> IntArray:
        """Return the number of components at each of the scales r_1..r_S, shape (steps,)."""
        dead = np.searchsorted(np.sort(self.death), self.scales(steps), side="right")
        return len(self.death) - dead.astype(np.int64)


@dataclass(frozen=True)
class Barcode:
    """The H0 barcode: one bar per preprocessed point (paper, section IV.F and Fig. 5).

    Parameters
    ----------
    xyz : (M, 3) float64
        Position of the point that represents the bar, metres.
    birth, death : (M,) float64
        Scales, metres; all births are 0, `death` is inf for bars that never die.
    label : (M,) uint32
        Label of the region that the representative ended in; 0 = none.
    steps : int
        Steps of the filtration, for the stepped deaths of the paper.
    max_radius : float
        Last scale of the filtration, metres.
    """

    xyz: FloatArray
    birth: FloatArray
    death: FloatArray
    label: LabelArray
    steps: int
    max_radius: float

    def __len__(self) -> int:
        return len(self.death)


@dataclass(frozen=True)
class Region:
    """One region; lengths in metres, sensor frame."""

    label: int
    size: int
    centroid: tuple[float, float, float]
    minimum: tuple[float, float, float]
    maximum: tuple[float, float, float]
    mean_lab: tuple[float, float, float]
    mean_normal: tuple[float, float, float]
    persistence: float
    confidence: float


@dataclass(frozen=True)
class RegionTable:
    """All regions of a frame, one row each, largest first; lengths in metres, sensor frame.

    Parameters
    ----------
    label : (M,) uint32
        Label of the region: the row counted from 1, unless labels are kept over frames.
    size : (M,) int64
        Number of labeled input points.
    centroid, minimum, maximum : (M, 3) float64
        Mean position and the corners of the axis-aligned box.
    mean_lab, mean_normal : (M, 3) float64
        NaN where the feature was not computed.
    persistence : (M,) float64
        Over how many metres of scale the region lives as a class of the merge tree: from the scale at which a
        component first holds `min_region_size` input points to that at which it joins an older class, or the end of the
        filtration. 0 for a region made of small ones alone; NaN for supervoxels.
    confidence : (M,) float64
        How sure it is that the region is a thing, 0 to 1; NaN unless these are objects of a camera's image.
    """

    label: LabelArray
    size: IntArray
    centroid: FloatArray
    minimum: FloatArray
    maximum: FloatArray
    mean_lab: FloatArray
    mean_normal: FloatArray
    persistence: FloatArray
    confidence: FloatArray

    def __len__(self) -> int:
        return len(self.size)

    def __getitem__(self, index: int) -> Region:
        if not -len(self) <= index < len(self):
            raise IndexError(f"region {index} of {len(self)}")
        index %= len(self)

        def row(column: FloatArray) -> tuple[float, float, float]:
            x, y, z = column[index].tolist()
            return x, y, z

        return Region(
            label=int(self.label[index]),
            size=int(self.size[index]),
            centroid=row(self.centroid),
            minimum=row(self.minimum),
            maximum=row(self.maximum),
            mean_lab=row(self.mean_lab),
            mean_normal=row(self.mean_normal),
            persistence=float(self.persistence[index]),
            confidence=float(self.confidence[index]),
        )


@dataclass(frozen=True)
class Adjacency:
    """Which regions touch: the edges of their adjacency graph, in the order of their labels.

    Parameters
    ----------
    pairs : (M, 2) uint32
        Labels of two regions that touch, the smaller one first; each pair is there once.
    counts : (M,) int64
        How many pairs of points, one of each region, are near.
    points : (sum of counts, 2) int32
        These points, rows of the preprocessed cloud, that of the first region first; pair after pair of regions.
    start : (M + 1,) int64
        The points of pair i are the rows ``start[i]:start[i + 1]`` of `points`.
    """

    pairs: npt.NDArray[np.uint32]
    counts: IntArray
    points: IndexArray
    start: IntArray

    def __len__(self) -> int:
        return len(self.pairs)
