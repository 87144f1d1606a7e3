# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The one table of parameters.

The fields of :class:`Params` and what `parameter` attaches to them (unit, range, meaning) are the single source of the
Python API, the YAML files in ``config/``, the ROS parameter descriptors, the flags of the command line and the table in
the documentation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from topo_region_seg.parameter_table import Condition, ParameterError, ParameterTable, parameter

THINNABLE = 4
"""How many times `max_points` a cloud may have that is thinned: thinning it takes about as much memory as segmenting
`max_points`."""

GROWN: Condition = {"output": ("regions", "supervoxels")}
COLORS: Condition = {**GROWN, "features": ("color+normals", "color")}
NORMALS: Condition = {**GROWN, "features": ("color+normals", "normals")}
OBJECTS: Condition = {"output": ("objects",)}
SIDED: Condition = {**NORMALS, "output": ("regions",)}
FLOOR: Condition = {"remove_floor": (True,)}


def length(default: Any, doc: str, *, low: float, high: float, **spec: Any) -> Any:
    """Declare a length, metres."""
    return parameter(default, doc, unit="m", low=low, high=high, **spec)


def angle(default: float, doc: str, **spec: Any) -> Any:
    """Declare an angle, degrees."""
    return parameter(default, doc, unit="deg", low=0.0, high=180.0, **spec)


@dataclass(frozen=True)
class Params(ParameterTable):
    """Parameters of the segmentation. Lengths are metres, angles degrees, color differences CIE76 dE."""

    RENAMED: ClassVar[Mapping[str, str]] = {
        "mode": "'output' (regions, objects or supervoxels)",
        "level": "'output' (regions, objects or supervoxels)",
    }

    # Preprocessing (paper, section V)
    min_range: float = length(0.0, "nearest distance from the sensor that is kept", low=0.0, high=1000.0)
    max_range: float = length(10.0, "farthest distance from the sensor that is kept", low=0.01, high=1000.0)
    crop_box: tuple[float, ...] = parameter(
        (), "keep only the box [x_min, y_min, z_min, x_max, y_max, z_max]; empty = everything", unit="m", lengths=(0, 6)
    )
    crop_box_pose: tuple[float, ...] = parameter(
        (),
        "pose [x, y, z, roll, pitch, yaw] (m, rad) of the crop box's frame in that of the clouds, or in the node's "
        "base_frame if that is set; empty = the same",
        lengths=(0, 6),
    )
    sensor_pose: tuple[float, ...] = parameter(
        (),
        "pose [x, y, z, roll, pitch, yaw] (m, rad) of the sensor in the frame of the clouds, for clouds in another "
        "frame than the sensor's, such as base_link or map; empty = as the file says, else at the origin",
        lengths=(0, 6),
    )
    up: tuple[float, ...] = parameter(
        (),
        "direction [x, y, z] of up in the frame of the clouds, such as [0, -1, 0] for a level camera's optical frame, "
        "or [0, 0, 1] for base_link: then only planes that are level within 10 degrees are taken for table or floor; "
        "empty = not known; with the node's base_frame a direction in it, and empty = its z",
        lengths=(0, 3),
    )
    drop_zeros: bool = parameter(
        True, "take points at exactly (0, 0, 0) as 'no depth', as several drivers publish them"
    )
    max_points: int = parameter(
        4_000_000, "clouds of more points are rejected or thinned, see over_max_points", low=1, high=100_000_000
    )
    over_max_points: str = parameter(
        "reject",
        "what happens to clouds of more than max_points: they are rejected, or thinned with wider voxels until at most "
        f"so many are left; more than {THINNABLE} times as many are always rejected",
        choices=("reject", "thin"),
    )
    remove_floor: bool = parameter(
        True, "remove the dominant plane (table, floor) and what lies behind it, if it is large enough to carry objects"
    )
    floor_distance: float = length(
        0.01,
        "points nearer to the plane than this belong to it; objects use object_floor_distance",
        low=0.0005,
        high=1.0,
        when=({**GROWN, **FLOOR},),
    )
    floor_min_extent: float = length(
        0.3,
        "a plane whose shorter side is less than this carries no objects and is kept",
        low=0.0,
        high=100.0,
        when=(FLOOR,),
    )
    floor_seed: int = parameter(
        0, "seed of the plane search; same cloud, same seed, same plane", low=0, high=2**31 - 1, when=(FLOOR,)
    )
    voxel_size: float = length(
        0.002, "edge of the thinning voxel grid; 0 = off; every input point still gets a label", low=0.0, high=1.0
    )

    # Output
    output: str = parameter(
        "regions",
        "what gets a label: regions of like color and direction; objects, which unite regions across convex borders; "
        "or supervoxels, connected patches of regions of bounded extent",
        choices=("regions", "objects", "supervoxels"),
    )

    # Features (paper, section IV.C)
    features: str = parameter(
        "color+normals",
        "what two points must agree in; objects compare normals",
        choices=("color+normals", "color", "normals"),
        when=(GROWN,),
    )
    normal_radius: float = length(
        0.01,
        "radius of the neighborhood that gives a point its normal; objects use object_normal_radius",
        low=0.0005,
        high=1.0,
        when=(NORMALS,),
    )
    normal_min_neighbors: int = parameter(
        8,
        "points with fewer neighbors in normal_radius take this many nearest ones (within 3 radii)",
        low=3,
        high=64,
        when=(NORMALS, OBJECTS),
    )
    creases: str = parameter(
        "part",
        "what creases do: part regions, as each point takes the normal of the flat neighborhoods around that it lies "
        "on; or ignore, as in the paper, each point has that of its own neighborhood, which turns over a crease little "
        "by little",
        choices=("part", "ignore"),
        when=(SIDED,),
    )
    color_threshold: float = parameter(
        10.0, "largest color difference of joined points", unit="dE", low=0.0, high=500.0, when=(COLORS,)
    )
    min_color_threshold: float = parameter(
        0.0, "smallest color difference of joined points", unit="dE", low=0.0, high=500.0, when=(COLORS,)
    )
    angle_threshold: float = angle(
        5.0, "largest angle between normals of joined points; objects use object_angle_threshold", when=(NORMALS,)
    )
    min_angle_threshold: float = angle(0.0, "smallest angle between normals of joined points", when=(NORMALS,))

    # Filtration (paper, sections IV.A, IV.B, IV.D)
    max_radius: float | Literal["auto"] = length(
        "auto",
        "largest scale of the Vietoris-Rips filtration (R); auto: the scale of the regions is chosen from the barcode "
        "of each cloud, and lengths grow with the spacing and noise of the sensor's points (see docs/auto_radius.md); "
        "objects use object_radius",
        low=1e-6,
        high=10.0,
        words=("auto",),
        when=(GROWN,),
    )
    radius: float = length(
        0.0,
        "scale of the regions, up to max_radius; 0 = max_radius, or if that is auto the scale chosen; the barcode "
        "always goes up to max_radius",
        low=0.0,
        high=10.0,
        when=(GROWN,),
    )
    filtration_steps: int = parameter(10, "steps of the filtration up to max_radius (S)", low=1, high=10_000)

    # Small regions (paper, section IV.E)
    min_region_size: int = parameter(64, "regions with fewer points are small", unit="points", low=1, high=10_000_000)
    small_regions: str = parameter(
        "merge",
        "small regions join their best neighbor within three radii, and lose their label where they stay small; or all "
        "of them lose it",
        choices=("merge", "remove"),
        when=(GROWN,),
    )

    # Supervoxels
    seed_spacing: float = length(
        0.03,
        "supervoxels: spacing of their seeds, and the largest distance of a point from its patch's seed",
        low=0.001,
        high=10.0,
        when=({"output": ("supervoxels",)},),
    )

    # Objects
    object_radius: float = length(
        0.01, "objects: largest scale of the regions that they are made of", low=1e-6, high=10.0, when=(OBJECTS,)
    )
    object_angle_threshold: float = angle(
        4.0, "objects: largest angle between normals of joined points", when=(OBJECTS,)
    )
    object_normal_radius: float = length(
        0.008,
        "objects: radius of the neighborhood that gives a point its normal",
        low=0.0005,
        high=1.0,
        when=(OBJECTS,),
    )
    object_floor_distance: float = length(
        0.004,
        "objects: points nearer to the plane than this belong to it; two to three times the noise of the depth",
        low=0.0005,
        high=1.0,
        when=({**OBJECTS, **FLOOR},),
    )
    object_border_radius: float = length(
        0.015,
        "objects: points of two regions up to this far apart judge the border",
        low=1e-6,
        high=10.0,
        when=(OBJECTS,),
    )
    object_groove_angle: float = angle(
        15.0,
        "objects: where normals turn to the inside by more than this over object_border_radius, on the mean of all "
        "directions, points lie in a groove, which parts regions",
        when=(OBJECTS,),
    )
    object_vessels: bool = parameter(
        True,
        "objects: the inside of a cup or bowl is one object with its outside; images of a camera only",
        when=(OBJECTS,),
    )
    object_min_area: float = parameter(
        0.0006,
        "objects: smallest area of an object, as seen from the sensor; images of a camera only",
        unit="m²",
        low=0.0,
        high=1.0,
        when=(OBJECTS,),
    )
    min_confidence: float = parameter(
        0.5,
        "objects: how sure it must be that a segment is a thing, and no wall, rim of a bin or robot: the share of its "
        "outline that speaks for it; images of a camera only",
        low=0.0,
        high=1.0,
        when=(OBJECTS,),
    )
    object_convexity: float = parameter(
        0.6,
        "objects: share of the pairs of points at a border that must be convex for the regions to be one object",
        low=0.5,
        high=1.0,
        when=(OBJECTS,),
    )

    # Work
    threads: int = parameter(
        0,
        "threads that work at one cloud; 0 = as many as there are cores, at most 8; results do not depend on it",
        low=0,
        high=64,
    )

    # Streams
    track_regions: bool = parameter(
        False,
        "regions keep their labels (1 to 65535) from frame to frame; the regions stay the same. The label of a region "
        "that is gone is given to a new one when no other label has been unused for longer",
    )
    hold_regions: bool = parameter(
        False,
        "tracked regions that become one stay apart for up to 10 frames, what comes off a region at rest stays with it "
        "for 5, and points at borders at rest change over after 3: steadier regions, which are no longer those of the "
        "frame alone",
        when=({"track_regions": (True,)},),
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for small, large in (
            ("min_range", "max_range"),
            ("min_color_threshold", "color_threshold"),
            ("min_angle_threshold", "angle_threshold"),
            ("radius", "max_radius"),
        ):
            low, high = getattr(self, small), getattr(self, large)
            if high != "auto" and low > high:
                raise ParameterError(
                    f"{small} ({low}) is greater than {large} ({high}); lower the one or raise the other"
                )
        if self.up and not max(map(abs, self.up)) > 0.0:
            raise ParameterError(f"up {list(self.up)}: must have a direction, such as [0, 0, 1]")
        if self.crop_box and not all(self.crop_box[i] < self.crop_box[i + 3] for i in range(3)):
            raise ParameterError(f"crop_box {list(self.crop_box)}: each minimum must be less than its maximum")

    @property
    def point_limit(self) -> int:
        """Points of the largest cloud that is not rejected."""
        return self.max_points * (THINNABLE if self.over_max_points == "thin" else 1)
