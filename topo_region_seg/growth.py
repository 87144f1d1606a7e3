# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How regions grow in one run: what the chosen output takes of the parameters, as plain numbers.

Lengths that follow from a cloud replace these without passing through the ranges of the parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

from topo_region_seg.params import Params

REFERENCE_SPACING = 1.0 / 525.0
"""Spacing of points, metres, up to which lengths are used as given where `max_radius` is auto: a Kinect's at 1 m."""

FEWEST_SPACINGS = 4.0
"""Spacings in the smallest scale that is chosen or suggested: less, and lost points part a surface."""

AUTO_REACH = 3.0 * FEWEST_SPACINGS * REFERENCE_SPACING
"""Last scale of the filtration where `max_radius` is auto, metres at the reference spacing: three times the least one
that is chosen. More would join what lies beside each other."""


@dataclass(frozen=True)
class Growth:
    """How regions grow (paper, section IV.C).

    Parameters
    ----------
    uses_color, uses_normals : bool
        What the homogeneity criterion compares.
    color : tuple of float
        Smallest and largest color difference of joined points, CIE76 dE.
    angle : tuple of float
        Smallest and largest angle between their normals, degrees.
    max_radius : float
        Last scale of the filtration, metres.
    radius : float
        Scale of the regions, metres.
    normal_radius : float
        Radius of the neighborhood of a normal, metres.
    sided : bool
        Whether points take their normals from one side of a crease.
    floor_distance : float
        Largest distance of a point of the support plane from it, metres.
    """

    uses_color: bool
    uses_normals: bool
    color: tuple[float, float]
    angle: tuple[float, float]
    max_radius: float
    radius: float
    normal_radius: float
    sided: bool
    floor_distance: float


def is_auto(params: Params) -> bool:
    """Return whether the scale is chosen for each cloud."""
    return params.max_radius == "auto" and params.output != "objects"


def growth_of_output(params: Params) -> Growth:
    """Return how the regions that the chosen output is made of grow."""
    if params.output != "objects":
        return growth_of_regions(params)
    return Growth(
        uses_color=False,
        uses_normals=True,
        color=(params.min_color_threshold, params.color_threshold),
        angle=(0.0, params.object_angle_threshold),
        max_radius=params.object_radius,
        radius=params.object_radius,
        normal_radius=params.object_normal_radius,
        sided=False,
        floor_distance=params.object_floor_distance,
    )


def growth_of_regions(params: Params) -> Growth:
    """Return how regions grow, whatever the output."""
    max_radius = max(AUTO_REACH, params.radius) if params.max_radius == "auto" else params.max_radius
    return Growth(
        uses_color=params.features != "normals",
        uses_normals=params.features != "color",
        color=(params.min_color_threshold, params.color_threshold),
        angle=(params.min_angle_threshold, params.angle_threshold),
        max_radius=max_radius,
        radius=params.radius or max_radius,
        normal_radius=params.normal_radius,
        sided=params.creases == "part" and params.output == "regions",
        floor_distance=params.floor_distance,
    )
