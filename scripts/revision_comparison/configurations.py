# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What is run on each cloud and each recording.

Parameters carry their present names; the worker translates them for older revisions.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

FEATURES = ("color+normals", "color", "normals")
OUTPUTS = ("regions", "objects", "supervoxels")
BOX = {
    "crop_box": [-0.3, -0.3, -0.4, 0.3, 0.3, 0.4],
    "crop_box_pose": [0.0, 0.0, 1.0, 0.4, 0.1, -0.2],
}
"""A box about what stands a meter before the camera, turned about all axes."""


@dataclass(frozen=True)
class Configuration:
    """A name, and the parameters that differ from their defaults."""

    name: str
    params: dict[str, Any] = field(default_factory=dict)

    @property
    def needs_color(self) -> bool:
        """Whether a cloud without color is refused."""
        return self.params.get("features") != "normals" and self.params.get("output") != "objects"


def _one(**params: Any) -> Configuration:
    output, features = params.get("output", "regions"), params.get("features", "")
    rest = [f"{name}={value}" for name, value in params.items() if name not in ("output", "features")]
    return Configuration(" ".join(part for part in (output, features, *rest) if part), params)


CORE = (
    *(_one(output="regions", features=features) for features in FEATURES),
    *(_one(output="supervoxels", features=features) for features in FEATURES),
    _one(output="objects"),
    *(_one(output="regions", features=features, max_radius="auto") for features in FEATURES),
    _one(output="supervoxels", max_radius="auto"),
)
"""For every cloud: all outputs and features, with a given and a chosen scale."""

SPECIAL = (
    *(
        _one(output=output, **params)
        for output in OUTPUTS
        for params in (
            {"small_regions": "remove"},
            {"voxel_size": 0.0},
            {"remove_floor": False},
            {"min_region_size": 300},
            {"max_points": 20_000, "over_max_points": "thin"},
            BOX,
        )
    ),
    *(_one(max_radius="auto", **params) for params in ({"small_regions": "remove"}, {"voxel_size": 0.0}, BOX)),
    _one(max_radius="auto", remove_floor=False),
    _one(max_radius="auto", output="objects"),
    _one(max_radius="auto", output="supervoxels", features="normals", small_regions="remove"),
    _one(max_radius=0.05),
    _one(max_radius=0.03, radius=0.012),
    _one(max_radius=0.03, radius=0.012, output="supervoxels"),
    _one(filtration_steps=37),
    _one(min_range=0.9, max_range=1.4),
    _one(drop_zeros=False, remove_floor=False),
    _one(min_color_threshold=1.0, min_angle_threshold=0.5),
    _one(color_threshold=20.0, angle_threshold=12.0),
    _one(normal_radius=0.02, normal_min_neighbors=20),
    _one(floor_distance=0.02, floor_seed=5, floor_min_extent=0.1),
    _one(output="supervoxels", seed_spacing=0.015),
    _one(output="supervoxels", seed_spacing=0.1, small_regions="remove", features="color"),
    _one(output="objects", features="color", angle_threshold=12.0, normal_radius=0.02, floor_distance=0.02),
    _one(output="objects", object_radius=0.015, object_angle_threshold=6.0, object_normal_radius=0.012),
    _one(output="objects", object_floor_distance=0.008, object_border_radius=0.02),
    _one(output="objects", object_groove_angle=30.0, object_convexity=0.8),
)
"""For some clouds: every parameter changed at least once."""

STREAMS = (
    *(_one(output=output) for output in OUTPUTS),
    _one(max_radius="auto"),
    *(_one(output=output, track_regions=True) for output in OUTPUTS),
    _one(max_radius="auto", track_regions=True),
)
"""For every recording, replayed on the command line."""

LAYOUTS = (_one(features="normals"), _one(features="normals", output="objects", track_regions=True))
"""For every layout of points in a message, with and without color."""

TIMED = (*(_one(output=output) for output in OUTPUTS), _one(max_radius="auto"))
"""Whose CPU time is measured."""
