# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole pipeline and the Python API."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import topo_region_seg as trs
from topo_region_seg.data import SegmentationWarning
from topo_region_seg.offline.simulation import Camera, SimulatedFrame, simulate, tabletop


@pytest.fixture(scope="module")
def frame() -> SimulatedFrame:
    return simulate(tabletop(3), Camera.kinect(320, 240), seed=3)


@pytest.fixture(scope="module")
def segmentation(frame: SimulatedFrame) -> trs.Segmentation:
    return trs.Pipeline().run(frame.cloud)


def test_every_point_has_its_label(frame: SimulatedFrame, segmentation: trs.Segmentation) -> None:
    labels = segmentation.labels
    assert labels.shape == (len(frame.cloud),)
    assert labels.dtype == np.uint32
    assert (labels[~np.isfinite(frame.cloud.xyz).all(axis=1)] == 0).all()
    assert (labels[segmentation.index] > 0).all()
    sizes = np.bincount(labels)[1:]
    np.testing.assert_array_equal(sizes, segmentation.regions.size)
    assert (np.diff(sizes) <= 0).all()
    assert sizes.min() >= segmentation.params.min_region_size


def test_the_table_is_gone_and_objects_stay(frame: SimulatedFrame, segmentation: trs.Segmentation) -> None:
    assert segmentation.plane is not None
    truth, labels = frame.labels, segmentation.labels
    assert (labels[(truth > 0) & (truth < 10)] == 0).mean() > 0.98
    assert (labels[truth >= 20] > 0).mean() > 0.85


def test_the_barcode_is_that_of_the_components(segmentation: trs.Segmentation) -> None:
    barcode = segmentation.barcode
    assert len(barcode) == len(segmentation.index)
    assert (barcode.birth == 0.0).all()
    np.testing.assert_array_equal(barcode.death, segmentation.components.death)
    assert np.isinf(barcode.death).sum() == len(np.unique(segmentation.components.root))
    np.testing.assert_array_equal(barcode.label, segmentation.labels[segmentation.index])


def test_shuffled_points_get_the_same_labels(frame: SimulatedFrame, segmentation: trs.Segmentation) -> None:
    order = np.random.default_rng(0).permutation(len(frame.cloud))
    assert frame.cloud.rgb is not None
    shuffled = trs.segment(frame.cloud.xyz[order], frame.cloud.rgb[order])
    np.testing.assert_array_equal(shuffled.labels, segmentation.labels[order])


def test_threads_may_share_a_pipeline(frame: SimulatedFrame, segmentation: trs.Segmentation) -> None:
    pipeline = trs.Pipeline()
    with ThreadPoolExecutor(4) as pool:
        for result in pool.map(pipeline.run, [frame.cloud] * 6):
            np.testing.assert_array_equal(result.labels, segmentation.labels)


@pytest.mark.parametrize("voxel_size", [0.004, 0.02])
def test_thinning_labels_every_input_point(frame: SimulatedFrame, voxel_size: float) -> None:
    params = trs.Params(
        voxel_size=voxel_size, min_region_size=1, normal_radius=0.03, max_radius=0.04, color_threshold=50.0
    )
    thinned, full = trs.Pipeline(params).run(frame.cloud), trs.Pipeline(params.replace(voxel_size=0.0)).run(frame.cloud)
    assert len(thinned.index) < len(full.index)
    np.testing.assert_array_equal(thinned.labels > 0, full.labels > 0)
    np.testing.assert_array_equal(np.bincount(thinned.labels)[1:], thinned.regions.size)


@pytest.mark.parametrize("features", ["color+normals", "color", "normals"])
def test_features_are_computed_as_needed(frame: SimulatedFrame, features: str) -> None:
    seg = trs.segment(frame.cloud.xyz, frame.cloud.rgb, trs.Params(features=features))
    assert (seg.features.lab is None) == (features == "normals")
    assert (seg.features.normals is None) == (features == "color")
    assert len(seg.regions) > 0


def test_color_is_needed_unless_the_features_do_without(frame: SimulatedFrame) -> None:
    with pytest.raises(trs.MissingColorError, match="set features to 'normals'"):
        trs.segment(frame.cloud.xyz)
    assert len(trs.segment(frame.cloud.xyz, params=trs.Params(features="normals")).regions) > 0


@pytest.mark.parametrize("n", [0, 1, 2, 5])
@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0, 0.7])
def test_tiny_and_invalid_clouds(n: int, value: float) -> None:
    seg = trs.segment(np.full((n, 3), value), np.zeros((n, 3), np.uint8))
    valid = value == 0.7 and n > 0
    np.testing.assert_array_equal(seg.labels, np.full(n, int(valid)))
    assert len(seg.regions) == int(valid)


def test_organized_arrays_and_bad_shapes(frame: SimulatedFrame, segmentation: trs.Segmentation) -> None:
    assert frame.cloud.rgb is not None
    image = (240, 320, 3)
    seg = trs.segment(frame.cloud.xyz.reshape(image), frame.cloud.rgb.reshape(image))
    np.testing.assert_array_equal(seg.labels, segmentation.labels)
    with pytest.raises(ValueError, match="must be"):
        trs.segment(np.zeros((4, 2)))
    with pytest.raises(ValueError, match="must be uint8"):
        trs.segment(np.zeros((4, 3)), np.zeros((4, 3)))


def test_importing_is_light() -> None:
    heavy = "{'numba', 'scipy', 'rclpy', 'rosbags', 'mcap', 'matplotlib', 'rich'}"
    code = f"import sys, topo_region_seg; print(sorted({heavy} & set(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_values_without_effect_are_named_once(frame: SimulatedFrame) -> None:
    told: list[tuple[str, str]] = []
    pipeline = trs.Pipeline(trs.Params(output="objects", max_radius=0.03, seed_spacing=0.1))
    first = pipeline.run(frame.cloud, lambda *notice: told.append(notice))
    pipeline.run(frame.cloud, lambda *notice: told.append(notice))
    text = "parameters without effect with output = objects: max_radius = 0.03, seed_spacing = 0.1"
    assert told == [("no_effect", text)]
    assert [notice.text for notice in first.notices] == [text]
    with pytest.warns(SegmentationWarning, match="parameters without effect"):
        trs.segment(frame.cloud.xyz, frame.cloud.rgb, trs.Params(seed_spacing=0.1))
