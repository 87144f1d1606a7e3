# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames of very many points, in which one pixel in four stands for the others."""

from __future__ import annotations

import numpy as np
import pytest
from frames import box, looking, on_table

from topo_region_seg.beyond.objects import lattice
from topo_region_seg.beyond.objects.lattice import labels_of_all, on_lattice
from topo_region_seg.offline.simulation import Camera
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.segmentation import Segmentation

OBJECTS = Params(output="objects")
FRAME = looking(Camera.kinect(320, 240), on_table(box(0.0, 0.0), box(0.15, 0.25), box(-0.1, -0.25)))


def segmented(monkeypatch: pytest.MonkeyPatch, many: int, **changes: object) -> Segmentation:
    monkeypatch.setattr(lattice, "MANY", many)
    monkeypatch.setattr(lattice, "WIDE", 1.0)
    return Pipeline(OBJECTS.replace(**changes)).run(FRAME.cloud)


def test_objects_are_nearly_those_of_all_pixels(monkeypatch: pytest.MonkeyPatch) -> None:
    every, some = segmented(monkeypatch, 10**9), segmented(monkeypatch, 0)
    assert every.filtered.scene is not None and every.filtered.scene.stands_for is None
    assert len(every.regions) == len(some.regions) == 3
    assert np.mean(every.labels == some.labels) > 0.995
    assert not np.array_equal(every.components.root, some.components.root)


def test_each_pixel_has_the_normal_of_one_beside_it_on_the_lattice(monkeypatch: pytest.MonkeyPatch) -> None:
    every, some = segmented(monkeypatch, 10**9), segmented(monkeypatch, 0)
    scene, rows, width = some.filtered.scene, some.index, FRAME.width
    assert scene is not None and scene.stands_for is not None
    by = scene.stands_for[rows].astype(int) - 1
    own = on_lattice(rows, width)
    np.testing.assert_array_equal(by[own], rows[own])
    known = by >= 0
    assert known.mean() > 0.99 and on_lattice(by[known], width).all()
    assert np.abs(by[known] % width - rows[known] % width).max() == 1
    assert np.abs(by[known] // width - rows[known] // width).max() == 1
    normals, full = some.features.normals, every.features.normals
    assert normals is not None and full is not None
    np.testing.assert_array_equal(normals[own], full[own])
    of_pixel = dict(zip(rows[own].tolist(), normals[own], strict=True))
    expected = np.array([of_pixel[p] for p in by[known].tolist()])
    np.testing.assert_array_equal(normals[known], expected)
    assert np.isnan(normals[~known]).all()


def test_labels_are_those_of_the_pixels_that_stand_for_others(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = segmented(monkeypatch, 0).filtered.scene
    assert scene is not None and scene.stands_for is not None
    label = np.arange(1, len(scene.classes) + 1, dtype=np.int32)
    np.testing.assert_array_equal(labels_of_all(scene, label), scene.stands_for)


def test_all_pixels_are_looked_at_where_few_lie_within_a_radius(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lattice, "MANY", 0)
    for changes in ({"object_normal_radius": 0.003}, {"object_radius": 0.003}):
        seg = Pipeline(OBJECTS.replace(**changes)).run(FRAME.cloud)
        assert seg.filtered.scene is not None and seg.filtered.scene.stands_for is None
