# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The one table of parameters.

The fields of :class:`Params` and what :func:`parameter` attaches to them (unit, range, meaning) are the
single source of the Python API, the YAML files in ``config/``, the ROS parameter descriptors, the flags
of the command line and the table in the README.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, TypeVar

P = TypeVar("P", bound="ParameterTable")

AUTO = 0.0
"""What `max_radius` is kept as where it is chosen for each cloud."""

REFERENCE_SPACING = 1.0 / 525.0
"""Spacing of points, metres, up to which lengths mean what they say where `max_radius` is auto: a Kinect's at 1 m."""

FEWEST_SPACINGS = 4.0
"""Spacings in the smallest scale that is chosen or suggested: less, and lost points part a surface."""

AUTO_REACH = 8.0 * FEWEST_SPACINGS * REFERENCE_SPACING
"""Last scale of the filtration where `max_radius` is auto, metres at the reference spacing: three octaves above the
least one that is chosen."""

THINNABLE = 4
"""How many times `max_points` a cloud may have that is thinned: to thin it takes about as much memory as to segment
`max_points`."""


class ParameterError(ValueError):
    """A parameter has an unknown name, a wrong type or a value out of range; the message says which and why."""


@dataclass(frozen=True)
class Spec:
    """What is known of one parameter besides its name, type and default."""

    doc: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    words: tuple[tuple[str, float], ...] = ()
    """Words that may stand for a number, and the numbers that they are kept as."""
    lengths: tuple[int, ...] = ()
    live: bool = True


@dataclass(frozen=True)
class Row:
    """One row of the table: a parameter's name, Python type, default and specification."""

    name: str
    type: type
    default: Any
    spec: Spec


def parameter(default: Any, doc: str, **spec: Any) -> Any:
    """Declare one parameter: a dataclass field that carries its :class:`Spec`."""
    return field(default=default, metadata={"spec": Spec(doc=doc, **spec)})


@dataclass(frozen=True)
class ParameterTable:
    """Frozen dataclass whose every field is a parameter, checked when an instance is made."""

    def __post_init__(self) -> None:
        for row in self.table():
            object.__setattr__(self, row.name, checked(row, getattr(self, row.name)))

    @classmethod
    def table(cls) -> tuple[Row, ...]:
        """Return the rows of the table in the order of declaration."""
        return tuple(
            Row(f.name, type(f.default), f.default, f.metadata["spec"]) for f in fields(cls) if "spec" in f.metadata
        )

    @classmethod
    def from_mapping(cls: type[P], values: Mapping[str, Any]) -> P:
        """Build from names and values; an unknown name raises :class:`ParameterError`."""
        known = {row.name for row in cls.table()}
        for name in values:
            if name not in known:
                raise ParameterError(f"unknown parameter '{name}'; known: {', '.join(sorted(known))}")
        return cls(**dict(values))

    def replace(self: P, **changes: Any) -> P:
        """Return a copy with some values changed; all are checked together."""
        return type(self).from_mapping({**self.as_dict(), **changes})

    def as_dict(self) -> dict[str, Any]:
        """Return names and values; tuples become lists, so that JSON and YAML can carry them."""
        values = dataclasses.asdict(self)
        for row in self.table():
            values[row.name] = next((word for word, n in row.spec.words if n == values[row.name]), values[row.name])
        return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}


@dataclass(frozen=True)
class Params(ParameterTable):
    """Parameters of the segmentation. Lengths are metres, angles degrees, colour differences CIE76 dE."""

    # Preprocessing (paper, section V)
    min_range: float = parameter(0.0, "nearest distance from the sensor that is kept", unit="m", low=0.0, high=1000.0)
    max_range: float = parameter(
        10.0, "farthest distance from the sensor that is kept", unit="m", low=0.01, high=1000.0
    )
    crop_box: tuple[float, ...] = parameter(
        (), "keep only the box [x_min, y_min, z_min, x_max, y_max, z_max]; empty = everything", unit="m", lengths=(0, 6)
    )
    crop_box_pose: tuple[float, ...] = parameter(
        (),
        "pose [x, y, z, roll, pitch, yaw] (m, rad) of the crop box's frame in the sensor frame; empty = that frame",
        lengths=(0, 6),
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
    floor_distance: float = parameter(
        0.01, "points nearer to the plane than this belong to it", unit="m", low=0.0005, high=1.0
    )
    floor_min_extent: float = parameter(
        0.3,
        "a plane whose shorter side is less than this carries no objects and is kept",
        unit="m",
        low=0.0,
        high=100.0,
    )
    floor_seed: int = parameter(0, "seed of the plane search; same cloud, same seed, same plane", low=0, high=2**31 - 1)
    voxel_size: float = parameter(
        0.002,
        "edge of the thinning voxel grid; 0 = off; every input point still gets a label",
        unit="m",
        low=0.0,
        high=1.0,
    )

    # Features (paper, section IV.C)
    features: str = parameter(
        "color+normals", "what two points must agree in", choices=("color+normals", "color", "normals")
    )
    normal_radius: float = parameter(
        0.01, "radius of the neighborhood that gives a point its normal", unit="m", low=0.0005, high=1.0
    )
    normal_min_neighbors: int = parameter(
        8, "points with fewer neighbors in normal_radius take this many nearest ones (within 3 radii)", low=3, high=64
    )
    color_threshold: float = parameter(
        10.0, "largest color difference of joined points", unit="dE", low=0.0, high=500.0
    )
    min_color_threshold: float = parameter(
        0.0, "smallest color difference of joined points", unit="dE", low=0.0, high=500.0
    )
    angle_threshold: float = parameter(
        5.0, "largest angle between normals of joined points", unit="deg", low=0.0, high=180.0
    )
    min_angle_threshold: float = parameter(
        0.0, "smallest angle between normals of joined points", unit="deg", low=0.0, high=180.0
    )

    # Filtration (paper, sections IV.A, IV.B, IV.D)
    max_radius: float = parameter(
        0.02,
        "largest scale of the Vietoris-Rips filtration (R); auto: the scale of the regions is chosen from the barcode "
        "of each cloud, and lengths grow with the spacing and noise of the sensor's points (see docs/auto_radius.md)",
        unit="m",
        low=1e-6,
        high=10.0,
        words=(("auto", AUTO),),
    )
    radius: float = parameter(
        0.0,
        "scale of the regions, up to max_radius; 0 = max_radius; the barcode always goes up to max_radius",
        unit="m",
        low=0.0,
        high=10.0,
    )
    filtration_steps: int = parameter(10, "steps of the filtration up to max_radius (S)", low=1, high=10_000)

    # Supervoxels
    mode: str = parameter(
        "regions",
        "what gets a label: regions, or supervoxels, which are connected patches of regions of bounded extent",
        choices=("regions", "supervoxels"),
    )
    seed_spacing: float = parameter(
        0.03,
        "supervoxels: spacing of their seeds, and the largest distance of a point from its patch's seed",
        unit="m",
        low=0.001,
        high=10.0,
    )

    # Small regions (paper, section IV.E)
    min_region_size: int = parameter(64, "regions with fewer points are small", unit="points", low=1, high=10_000_000)
    small_regions: str = parameter(
        "merge", "small regions join their best neighbor, or lose their label", choices=("merge", "remove")
    )

    # Objects
    level: str = parameter(
        "regions",
        "what gets a label: regions, or objects, which unite regions of like normals across convex borders; objects "
        "go by the object_ parameters in place of features, max_radius, angle_threshold, normal_radius and "
        "floor_distance",
        choices=("regions", "objects"),
    )
    object_radius: float = parameter(
        0.01, "objects: largest scale of the regions that they are made of", unit="m", low=1e-6, high=10.0
    )
    object_angle_threshold: float = parameter(
        4.0, "objects: largest angle between normals of joined points", unit="deg", low=0.0, high=180.0
    )
    object_normal_radius: float = parameter(
        0.008, "objects: radius of the neighborhood that gives a point its normal", unit="m", low=0.0005, high=1.0
    )
    object_floor_distance: float = parameter(
        0.004,
        "objects: points nearer to the plane than this belong to it; two to three times the noise of the depth",
        unit="m",
        low=0.0005,
        high=1.0,
    )
    object_border_radius: float = parameter(
        0.015, "objects: points of two regions up to this far apart judge the border", unit="m", low=1e-6, high=10.0
    )
    object_groove_angle: float = parameter(
        15.0,
        "objects: where normals turn to the inside by more than this over object_border_radius, on the mean of all "
        "directions, points lie in a groove, which parts regions",
        unit="deg",
        low=0.0,
        high=180.0,
    )
    object_convexity: float = parameter(
        0.6,
        "objects: share of the pairs of points at a border that must be convex for the regions to be one object",
        low=0.5,
        high=1.0,
    )

    # Streams
    track_regions: bool = parameter(
        False, "regions keep their labels from frame to frame; new ones get labels that were not used before"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.auto and self.radius:
            raise ParameterError(f"radius ({self.radius}) is chosen where max_radius is auto; set one of the two back")
        for small, large in (
            ("min_range", "max_range"),
            ("min_color_threshold", "color_threshold"),
            ("min_angle_threshold", "angle_threshold"),
            ("radius", "max_radius"),
        ):
            if getattr(self, small) > getattr(self, large):
                raise ParameterError(
                    f"{small} ({getattr(self, small)}) is greater than {large} ({getattr(self, large)}); "
                    "lower the one or raise the other"
                )
        if self.mode == "supervoxels" and self.level == "objects":
            raise ParameterError(
                "mode 'supervoxels' divides regions, level 'objects' unites them; set one of the two back"
            )
        if self.crop_box and not all(self.crop_box[i] < self.crop_box[i + 3] for i in range(3)):
            raise ParameterError(f"crop_box {list(self.crop_box)}: each minimum must be less than its maximum")

    def of_level(self) -> Params:
        """Return the parameters with which the regions of the level are grown."""
        if self.level == "regions":
            return self
        return self.replace(
            features="normals",
            max_radius=self.object_radius,
            radius=0.0,
            angle_threshold=self.object_angle_threshold,
            min_angle_threshold=0.0,
            normal_radius=self.object_normal_radius,
            floor_distance=self.object_floor_distance,
        )

    @property
    def point_limit(self) -> int:
        """Points of the largest cloud that is not rejected."""
        return self.max_points * (THINNABLE if self.over_max_points == "thin" else 1)

    @property
    def auto(self) -> bool:
        """Whether the scale is chosen for each cloud."""
        return self.max_radius == AUTO

    @property
    def reach(self) -> float:
        """The last scale of the filtration, metres."""
        return AUTO_REACH if self.auto else self.max_radius

    @property
    def scale(self) -> float:
        """The scale of the regions, metres; where it is chosen for each cloud, the largest that can be."""
        return self.radius or self.reach

    @property
    def uses_color(self) -> bool:
        """Whether the homogeneity criterion compares colors."""
        return self.features != "normals"

    @property
    def uses_normals(self) -> bool:
        """Whether the homogeneity criterion compares normals."""
        return self.features != "color"


def checked(row: Row, value: Any) -> Any:
    """Return `value` in the row's own type, or raise :class:`ParameterError` naming row, value and reason."""
    spec = row.spec
    if row.type is bool:
        if not isinstance(value, bool):
            raise ParameterError(f"{row.name} = {value!r}: must be true or false")
        return value
    if row.type is str:
        if value not in spec.choices:
            raise ParameterError(f"{row.name} = {value!r}: must be one of {', '.join(spec.choices)}")
        return value
    if row.type is tuple:
        return _checked_numbers(row, value)
    for word, number in spec.words:
        if isinstance(value, str) and value == word:
            return number
    if row.type is int and isinstance(value, float) and value.is_integer():
        value = int(value)
    kind = " or ".join(["a whole number" if row.type is int else "a number", *(word for word, _ in spec.words)])
    if isinstance(value, bool) or not _is_number(value, row.type):
        raise ParameterError(f"{row.name} = {value!r}: must be {kind}")
    value = row.type(value)
    unit = f" {spec.unit}" if spec.unit else ""
    if not math.isfinite(value):
        raise ParameterError(f"{row.name} = {value}: must be a finite number")
    if spec.low is not None and value < spec.low:
        raise ParameterError(f"{row.name} = {value}: must be at least {spec.low:g}{unit}")
    if spec.high is not None and value > spec.high:
        raise ParameterError(f"{row.name} = {value}: must be at most {spec.high:g}{unit}")
    return value


def _is_number(value: Any, kind: type) -> bool:
    if kind is int:
        return hasattr(value, "__index__")
    return hasattr(value, "__float__") and not isinstance(value, str | bytes)


def _checked_numbers(row: Row, value: Any) -> tuple[float, ...]:
    wanted = " or ".join(str(n) for n in row.spec.lengths)
    try:
        numbers = tuple(float(x) for x in value)
    except (TypeError, ValueError):
        raise ParameterError(f"{row.name} = {value!r}: must be a list of {wanted} numbers") from None
    if len(numbers) not in row.spec.lengths:
        raise ParameterError(f"{row.name} = {list(numbers)}: must have {wanted} numbers, has {len(numbers)}")
    if not all(math.isfinite(x) for x in numbers):
        raise ParameterError(f"{row.name} = {list(numbers)}: must be finite numbers")
    return numbers
