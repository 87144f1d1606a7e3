# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Why a result is empty or doubtful, and what to do about it, as notices for node, tools and Python."""

from __future__ import annotations

import numpy as np

from topo_region_seg.data import BoolArray, Cloud, FloatArray, Notice
from topo_region_seg.params import Params
from topo_region_seg.segmentation import Segmentation
from topo_region_seg.steps.support.search import IN_PLANE, Support

MILLIMETRES = (100.0, 20_000.0)
"""Median distances that are unlikely in metres, and usual in millimetres."""
FEW = 0.01
"""Share of the points in front of the support plane below which the side that is kept is doubtful."""


def parameters_in_vain(params: Params) -> list[Notice]:
    """Return a notice if parameters differ from their defaults without an effect."""
    by_cause: dict[str, list[str]] = {}
    for name, cause in params.without_effect().items():
        by_cause.setdefault(cause, []).append(f"{name} = {getattr(params, name)}")
    parts = [f"with {cause}: {', '.join(values)}" for cause, values in by_cause.items()]
    return [Notice("no_effect", f"parameters without effect {'; '.join(parts)}")] if parts else []


def no_points_left(cloud: Cloud, params: Params, sensor: FloatArray) -> Notice:
    """Return why no point of a cloud is left after the crop; `sensor` (3,) is where it is, metres."""
    if len(cloud) == 0:
        return Notice("empty_cloud", "the cloud has no points; check the driver")
    xyz = cloud.xyz.astype(np.float64)
    valid: BoolArray = np.isfinite(xyz).all(axis=1)
    if params.drop_zeros:
        valid &= (xyz != 0.0).any(axis=1)
    if not valid.any():
        text = f"none of the {len(cloud)} points is valid: all are not finite, or (0, 0, 0); check the driver"
        return Notice("all_invalid", text)
    distance = np.linalg.norm(xyz[valid] - sensor, axis=1)
    middle = float(np.median(distance))
    if not ((distance >= params.min_range) & (distance <= params.max_range)).any():
        text = (
            f"all {len(distance)} valid points are out of range: {np.min(distance):.4g} to {np.max(distance):.4g} m "
            f"from the sensor, {middle:.4g} m in the middle, with min_range {params.min_range:g} and max_range "
            f"{params.max_range:g} m"
        )
        if MILLIMETRES[0] <= middle <= MILLIMETRES[1] and params.max_range < middle:
            return Notice("out_of_range", f"{text}; these look like millimetres: divide the coordinates by 1000")
        return Notice("out_of_range", f"{text}; change these, or set sensor_pose if the sensor is not at the origin")
    return Notice("outside_crop_box", f"no point in range lies in crop_box {list(params.crop_box)}; check its frame")


def taken_for_map(sensor: FloatArray) -> Notice:
    """Return a notice that a cloud far from the origin is looked at from above, at `sensor` (3,), metres."""
    place = ", ".join(f"{value:.6g}" for value in sensor)
    return Notice(
        "taken_for_map",
        "the points lie far from the origin and close together, as in a map: max_range is not applied, and they are "
        f"seen from above, ({place}); set sensor_pose to where the sensor was",
    )


def doubtful_support(support: Support, sensor_known: bool, rows_left: int) -> list[Notice]:
    """Return a notice where the place of the sensor or the support plane is doubtful.

    Parameters
    ----------
    support : Support
        The plane, seen from the sensor at the origin.
    sensor_known : bool
        Whether the place of the sensor was given.
    rows_left : int
        How many points are in front of the plane.
    """
    judged = support.judged
    if judged is None:
        return []
    advice = "check sensor_pose" if sensor_known else "set sensor_pose"
    if judged.offset < IN_PLANE:
        text = (
            f"a plane with {100 * judged.share:.0f} % of the points passes {100 * judged.offset:.1f} cm from the "
            f"sensor, which is probably elsewhere; if the clouds are in another frame than the sensor's, {advice}"
        )
        return [Notice("sensor_in_plane", text)]
    if support.plane is None:
        unseen = (
            f"things stand on the far side of a plane with {100 * judged.share:.0f} % of the points"
            if judged.carries_beneath
            else f"{100 * judged.hidden:.0f} % of the points lie behind a plane with {100 * judged.share:.0f} % of them"
        )
        text = (
            f"{unseen}, where the sensor could not see them, so the plane stays; if the clouds are in another frame "
            f"than the sensor's, {advice}"
        )
        return [Notice("behind_plane", text)]
    if judged.before < FEW <= judged.behind:
        text = (
            f"{100 * judged.before:.1f} % of the points lie in front of the largest plane, {100 * judged.behind:.0f} % "
            f"behind it; if the clouds are in another frame than the sensor's, {advice}; else set remove_floor to false"
        )
        return [Notice("behind_plane", text)]
    if rows_left == 0:
        return [Notice("only_plane", "all points lie on the support plane; set remove_floor to false to keep it")]
    return []


def no_regions(seg: Segmentation) -> list[Notice]:
    """Return a notice why points were left but no region, if that is so."""
    if len(seg.regions) or not len(seg.point_labels):
        return []
    if seg.filtered.scene is not None:
        text = (
            f"no object: nothing in front of the support is both as large as object_min_area = "
            f"{seg.params.object_min_area:g} m² and as surely a thing as min_confidence = "
            f"{seg.params.min_confidence:g}; lower these to see what is there"
        )
        return [Notice("no_regions", text)]
    sizes = np.bincount(seg.components.root, weights=seg.filtered.weight)
    merges = seg.params.output == "regions" and seg.params.small_regions == "merge"
    text = (
        f"all {int(np.sum(sizes))} points lie in regions of fewer than min_region_size = {seg.params.min_region_size} "
        f"points, the largest of {int(np.max(sizes))}{', and stay below it when merged' if merges else ''}"
    )
    normals = seg.features.normals
    lost = 0.0 if normals is None else float(np.isnan(normals[:, 0]).mean())
    if lost > 0.5:
        return [Notice("no_regions", f"{text}; {100 * lost:.0f} % have no normal: raise the radius of normals")]
    return [Notice("no_regions", f"{text}; lower it, or raise the radius of the filtration")]
