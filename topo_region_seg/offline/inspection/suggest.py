# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameters that follow from the spacing, noise and spread of some clouds, each with its reason.

Spacing and noise determine the lengths. Thresholds decide what is separated, which cannot be measured: they keep their
defaults unless noise alone would exceed them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from topo_region_seg.data import Cloud, FloatArray
from topo_region_seg.growth import FEWEST_SPACINGS, growth_of_regions
from topo_region_seg.offline.inspection.neighbors import Foreground, differences, foreground_of
from topo_region_seg.offline.inspection.points import PointFigures, known_median
from topo_region_seg.params import Params

PREFERRED = np.array([1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])
"""Leading digits of suggested lengths: the measurements are not more precise."""
FEWEST_POINTS = 20
"""Clouds with fewer points are not measured."""
ENOUGH_POINTS = 20_000
"""Clouds with more points left to segment are thinned."""
THINNING = math.sqrt(2.0)
"""A grid this many spacings wide keeps about every second point of a surface."""
RADII = (2.0, 10.0)
"""Smallest and largest normal radius tried, in spacings; within the smallest are about a dozen points of a surface."""
NOISE_PASSES = 2.08
"""19 of 20 angles of a two-dimensional normal error are below this many medians (Rayleigh distribution)."""
COLOR_PASSES = 3.06
"""99 of 100 differences of a three-dimensional normal error are below this many lower quartiles (Maxwell)."""
NOISE_TO_PLANE = 4.0
SPARSE = 2.0
"""Points farther apart than half of `max_radius` no longer hold together."""
COLORED = 1.0
"""If nine of ten neighbors differ by less (dE), the color carries no information."""


@dataclass(frozen=True)
class Suggestion:
    """One parameter, its suggested value and why."""

    name: str
    value: Any
    reason: str


@dataclass(frozen=True)
class Advice:
    """All suggestions, and the differences between neighbors behind them: 25, 50 and 90 % quantiles in dE and deg."""

    suggestions: tuple[Suggestion, ...]
    spacing: float
    color_spread: tuple[float, float, float] | None
    angle_spread: tuple[float, float, float] | None

    def params(self) -> Params:
        """Return the parameters, checked."""
        return Params.from_mapping({suggestion.name: suggestion.value for suggestion in self.suggestions})


def suggest(clouds: Sequence[Cloud], figures: Sequence[PointFigures]) -> Advice | None:
    """Derive parameters from clouds and the `point_figures` of each; None if no cloud has enough points."""
    distance = np.concatenate([f.distance for f in figures])
    if len(distance) < FEWEST_POINTS:
        return None
    suggester = _Suggester(Params())
    suggester.range(distance)
    suggester.plane(clouds, known_median(np.concatenate([f.noise for f in figures])))
    found = [foreground_of(cloud, suggester.params) for cloud in clouds]
    found = [each for each in found if len(each.xyz) >= FEWEST_POINTS]
    spacing = known_median(np.array([each.spacing() for each in found]))
    if not math.isfinite(spacing):  # no points left, or all at the same position
        return None
    suggester.lengths(found, spacing)
    suggester.color(found)
    suggester.far_end(np.concatenate([f.spacing / f.distance for f in figures]), distance)
    return suggester.advice()


class _Suggester:
    """Sets the parameters one after the other: later ones depend on earlier ones."""

    def __init__(self, params: Params) -> None:
        self.params = params
        self._spacing = math.nan
        self._reasons: dict[str, str] = {}
        self._color: tuple[float, float, float] | None = None
        self._angle: tuple[float, float, float] | None = None

    def range(self, distance: FloatArray) -> None:
        low, high = np.quantile(distance, [0.005, 0.995])
        low, high = min(low, 900.0), min(high, 900.0)
        near, far = math.floor(low * 0.9 * 20) / 20, math.ceil(high * 1.1 * 20) / 20
        self._set("max_range", max(far, near + 0.1), f"99.5 % of the points are nearer than {high:.2f} m")
        self._set("min_range", near, f"99.5 % of the points are farther than {low:.2f} m")

    def plane(self, clouds: Sequence[Cloud], noise: float) -> None:
        """Decide whether to remove a support plane; `noise` is the depth noise, metres."""
        wide = _preferred(NOISE_TO_PLANE * noise) if math.isfinite(noise) else 0.0
        default = self.params.floor_distance
        margin = f"{NOISE_TO_PLANE:g} times the depth noise of {1e3 * noise:.1f} mm"
        why = margin if wide > default else f"the default; {margin} is not larger"
        self._set("floor_distance", min(max(default, wide), 0.1), why)
        trial = self.params.replace(remove_floor=True)
        seen = [foreground_of(cloud, trial) for cloud in clouds]
        with_plane = [t for t in seen if t.on_plane]
        left = [len(t.xyz) / t.cropped for t in with_plane]
        carries = 2 * len(with_plane) > len(seen) and float(np.median(left)) > 0.01
        why = f"a plane at least {self.params.floor_min_extent:g} m wide in {len(with_plane)} of {len(seen)} clouds"
        if with_plane:
            why += f", {100 * np.median(left):.0f} % of the points in front of it"
        self._set("remove_floor", carries, why)

    def lengths(self, found: Sequence[Foreground], spacing: float) -> None:
        """Set the lengths that follow from the spacing (m) and noise of the points left to segment."""
        count = int(np.median([len(each.xyz) for each in found]))
        left = f"{count:,} points left to segment, {1e3 * spacing:.2g} mm apart"
        if count > ENOUGH_POINTS:
            self._set("voxel_size", _preferred(THINNING * spacing), f"{left}: every second one is enough")
        else:
            self._set("voxel_size", 0.0, f"{left}: few enough to use all")
        self._spacing = spacing
        step = max(spacing, self.params.voxel_size)
        self._normals(found, step)
        radius = self.params.normal_radius
        reach = min(max(2.0 * radius, _preferred(FEWEST_SPACINGS * step)), 10.0)
        why = "twice normal_radius: normals of points farther apart share no neighbors"
        self._set("max_radius", reach, why if reach == 2.0 * radius else f"{FEWEST_SPACINGS:g} spacings")
        patch = math.pi * (self.params.normal_radius / spacing) ** 2
        self._set(
            "min_region_size",
            min(max(round(_preferred(patch)), 16), 2_000),
            f"about the {patch:.0f} points within normal_radius: fewer are not a surface",
        )

    def _normals(self, found: Sequence[Foreground], step: float) -> None:
        threshold = self.params.angle_threshold
        tried: list[tuple[float, float]] = []
        for radius in _radii(step):
            trial = self.params.replace(normal_radius=radius)
            spreads = [_spread(differences(each, trial)[1]) for each in found]
            spread = _typical([s for s in spreads if s])
            if spread is None:
                continue
            tried.append((NOISE_PASSES * spread[1], radius))
            self._angle = spread
            if tried[-1][0] <= threshold:
                break
        if not tried:
            self._set("normal_radius", _radii(step)[-1], f"{RADII[1]:g} spacings; too few points have normals")
            self._set("angle_threshold", threshold, "the default; too few points have normals")
            return
        noise, radius = tried[-1]
        spread_of = f"19 of 20 neighbors on a smooth surface differ by less than {noise:.1f} deg"
        self._set("normal_radius", radius, f"{radius / step:.1f} spacings: {spread_of}")
        higher = min(math.ceil(2 * noise) / 2, 30.0)
        why = f"the default; {spread_of}" if noise <= threshold else f"above the noise: {spread_of}"
        self._set("angle_threshold", max(threshold, higher) if noise > threshold else threshold, why)

    def color(self, found: Sequence[Foreground]) -> None:
        """Decide on the features, and on the color threshold."""
        spreads = [_spread(differences(each, self.params)[0]) for each in found if each.rgb is not None]
        spread = _typical([s for s in spreads if s])
        self._color = spread
        threshold = self.params.color_threshold
        if spread is None or spread[2] < COLORED:
            without = "the clouds have no color" if spread is None else "the color is nearly uniform"
            self._set("features", "normals", without)
            self._set("color_threshold", threshold, "not used without color")
            return
        self._set("features", "color+normals", f"the clouds have color: neighbors differ by up to {spread[2]:.1f} dE")
        noise = COLOR_PASSES * spread[0]
        below = f"noise alone stays below {noise:.1f} dE"
        why = f"the default; {below}" if noise <= threshold else f"above the noise: {below} for 99 of 100 neighbors"
        self._set("color_threshold", max(threshold, float(min(math.ceil(noise), 50))), why)

    def far_end(self, growth: FloatArray, distance: FloatArray) -> None:
        """Limit the range where points are too far apart; `growth` is their spacing per metre of distance."""
        per_metre = known_median(growth)
        max_radius = growth_of_regions(self.params).max_radius
        reach = max_radius / (SPARSE * per_metre)
        reach = math.floor(20 * reach) / 20
        if self.params.min_range + 0.1 <= reach < self.params.max_range:
            share = 100 * float((distance > reach).mean())
            self._set(
                "max_range",
                reach,
                f"farther points ({share:.0f} %) are more than {1e3 * max_radius / SPARSE:.2g} mm apart, "
                f"half of max_radius",
            )

    def advice(self) -> Advice:
        """Return all suggestions in the order of the parameter table."""
        names = [row.name for row in Params.table() if row.name in self._reasons]
        return Advice(
            tuple(Suggestion(name, getattr(self.params, name), self._reasons[name]) for name in names),
            self._spacing,
            self._color,
            self._angle,
        )

    def _set(self, name: str, value: Any, reason: str) -> None:
        self.params = self.params.replace(**{name: value})
        self._reasons[name] = reason


def _preferred(value: float) -> float:
    """Round to the nearest preferred length, by ratio, within the range of any length parameter."""
    value = min(max(value, 1e-6), 1e3)
    exponent = math.floor(math.log10(value))
    scale = 10.0**exponent
    nearest = PREFERRED[np.argmin(np.abs(np.log(PREFERRED / (value / scale))))]
    return float(f"{nearest * scale:.3g}")


def _radii(step: float) -> list[float]:
    """Return the preferred lengths from the smallest to the largest radius, within the range of the parameter."""
    low, high = (min(max(_preferred(factor * step), 5e-4), 1.0) for factor in RADII)
    decades = range(math.floor(math.log10(low)), math.floor(math.log10(high)) + 1)
    lengths = {float(f"{digit * 10.0**decade:.3g}") for decade in decades for digit in PREFERRED}
    return sorted(length for length in lengths if low <= length <= high)


def _spread(values: FloatArray) -> tuple[float, float, float] | None:
    if len(values) == 0:
        return None
    quarter, half, most = np.quantile(values, [0.25, 0.5, 0.9])
    return float(quarter), float(half), float(most)


def _typical(spreads: Sequence[tuple[float, float, float]]) -> tuple[float, float, float] | None:
    if not spreads:
        return None
    quarter, half, most = np.median(spreads, axis=0)
    return float(quarter), float(half), float(most)
