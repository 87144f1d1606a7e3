# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Any scale cut from one filtration, against a new run that ends there."""

from __future__ import annotations

import pickle
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import homogeneous_edges, partition, random_points
from places import ROOT

import topo_region_seg as trs
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message
from topo_region_seg.steps.scales.search import scale_with_kept_regions, scale_with_merged_regions

RECORDINGS = {
    "simulated": ROOT / "bags" / "tabletop_sim",
    "labelled": ROOT.parent / "shared" / "data" / "bags" / "tabletop_labelled",
}
FRAMES = {"simulated": (0,), "labelled": (0, 7)}


def small_cloud(seed: int, n: int) -> trs.Cloud:
    """Points at 0.8 m whose colors the criterion tells apart in part."""
    points = random_points(seed, n)
    rng = np.random.default_rng(seed)
    rgb = (120 + 60 * rng.integers(0, 2, (n, 1)) + rng.integers(-12, 13, (n, 3))).astype(np.uint8)
    return trs.Cloud(points.xyz + np.array([0.0, 0.0, 0.8]), rgb, 1, n)


def frames(name: str) -> Iterator[trs.Cloud]:
    with open_bag(RECORDINGS[name]) as reader:
        topic = cloud_topic(reader)
        for number, record in enumerate(reader.messages([topic.name])):
            if number in FRAMES[name]:
                yield decode(decode_message(record, topic), max_points=10_000_000)


def assert_same(cut: trs.Segmentation, new: trs.Segmentation) -> None:
    """Assert that labels and regions are the same to the last bit, and that the components would be."""
    np.testing.assert_array_equal(cut.labels, new.labels)
    for name, column in vars(new.regions).items():
        if name != "persistence":  # goes up to the end of the filtration
            np.testing.assert_array_equal(vars(cut.regions)[name], column, err_msg=name)
    np.testing.assert_array_equal(cut.barcode.label, new.barcode.label)
    assert_same_components(cut.components.cut(new.params.max_radius), new.components)


def assert_same_components(cut: trs.Components, new: trs.Components) -> None:
    for name, column in vars(new).items():
        np.testing.assert_array_equal(vars(cut)[name], column, err_msg=name)


def counts_of(components: trs.Components, radius: float) -> int:
    return len(np.unique(components.cut(radius).root))


def fractions() -> st.SearchStrategy[float]:
    return st.floats(1e-3, 1.0)


@given(
    st.integers(0, 2**32 - 1),
    st.integers(0, 400),
    fractions(),
    st.sampled_from(["color+normals", "color", "normals"]),
    st.sampled_from(["merge", "remove"]),
    st.integers(1, 40),
    st.sampled_from([0.0, 0.004]),
    st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_a_cut_is_a_new_run(
    seed: int, n: int, part: float, features: str, small: str, size: int, voxel: float, at_a_death: bool
) -> None:
    cloud = small_cloud(seed, n)
    params = trs.Params(
        max_radius=0.03,
        remove_floor=False,
        voxel_size=voxel,
        features=features,
        small_regions=small,
        min_region_size=size,
        normal_radius=0.03,
        angle_threshold=20.0,
    )
    seg = trs.Pipeline(params).run(cloud)
    radius = max(part * params.max_radius, 1e-6)
    deaths = np.unique(seg.components.death[np.isfinite(seg.components.death) & (seg.components.death >= 1e-6)])
    if at_a_death and len(deaths):
        radius = float(deaths[int(part * (len(deaths) - 1))])
    new = trs.Pipeline(params.replace(max_radius=radius)).run(cloud)
    assert_same(seg.cut(radius), new)
    assert_same(trs.Pipeline(params.replace(radius=radius)).run(cloud), new)


@pytest.mark.parametrize("name", RECORDINGS)
@pytest.mark.parametrize("small", ["merge", "remove"])
def test_a_cut_of_a_real_frame_is_a_new_run(name: str, small: str) -> None:
    if not RECORDINGS[name].exists():
        pytest.skip(f"{RECORDINGS[name]} is not there")
    params = trs.Params(max_radius=0.02, small_regions=small)
    for cloud in frames(name):
        seg = trs.Pipeline(params).run(cloud)
        for radius in (0.003, 0.0071, 0.013, params.max_radius):
            assert_same(seg.cut(radius), trs.Pipeline(params.replace(max_radius=radius)).run(cloud))


@given(st.integers(0, 2**32 - 1), st.integers(1, 200), fractions())
@settings(max_examples=60, deadline=None)
def test_components_of_a_scale_are_those_of_its_graph(seed: int, n: int, part: float) -> None:
    points, params = random_points(seed, n), trs.Params(max_radius=0.03)
    whole = trs.persistent_components(points.xyz, points.lab, points.normals, params)
    radius = part * params.max_radius
    pairs, lengths = homogeneous_edges(points, params)
    np.testing.assert_array_equal(whole.cut(radius).root, partition(n, pairs[lengths <= radius]))
    for point in np.flatnonzero(np.isfinite(whole.death))[:10]:
        then = partition(n, pairs[lengths <= whole.death[point]])
        assert whole.parent[point] == then[point]
    lasting = np.isinf(whole.death)
    np.testing.assert_array_equal(whole.parent[lasting], np.flatnonzero(lasting))


@given(st.integers(0, 2**32 - 1), st.integers(1, 200), st.integers(-1, 210))
@settings(max_examples=60, deadline=None)
def test_components_by_their_number(seed: int, n: int, wanted: int) -> None:
    points, params = random_points(seed, n), trs.Params(max_radius=0.03)
    whole = trs.persistent_components(points.xyz, points.lab, points.normals, params)
    cut = whole.cut(regions=wanted)
    most = counts_of(whole, 0.0)
    assert len(np.unique(cut.root)) >= min(wanted, most)
    if cut.max_radius < params.max_radius:
        assert counts_of(whole, float(np.nextafter(cut.max_radius, 1.0))) < min(wanted, most)


@given(st.integers(0, 2**32 - 1), st.integers(1, 250), st.integers(0, 30), st.integers(1, 12))
@settings(max_examples=40, deadline=None)
def test_regions_by_their_number_where_small_ones_are_removed(seed: int, n: int, wanted: int, size: int) -> None:
    """Exactly the largest scale with as many, or with the most: against all scales, one after the other."""
    params = trs.Params(
        max_radius=0.03, remove_floor=False, voxel_size=0.0, features="color", small_regions="remove"
    ).replace(min_region_size=size)
    seg = trs.Pipeline(params).run(small_cloud(seed, n))
    radii, counts = all_scales(seg)
    enough = np.flatnonzero(counts >= min(wanted, counts.max()))
    cut = seg.cut(regions=wanted)
    assert cut.scale == radii[enough[-1]]
    assert len(cut.regions) == counts[enough[-1]]


@given(st.integers(0, 2**32 - 1), st.integers(1, 150), st.integers(0, 20), st.integers(2, 12))
@settings(max_examples=30, deadline=None)
def test_regions_by_their_number_where_small_ones_are_merged(seed: int, n: int, wanted: int, size: int) -> None:
    """The largest scale with as many large components, or with the most: each of them is a region."""
    params = trs.Params(max_radius=0.03, remove_floor=False, voxel_size=0.0, features="color", min_region_size=size)
    seg = trs.Pipeline(params).run(small_cloud(seed, n))
    radii, _ = all_scales(seg.cut(params.max_radius), count=False)
    roots = [seg.components.cut(float(radius)).root for radius in radii]
    counts = np.array([np.count_nonzero(np.bincount(root) >= size) for root in roots])
    enough = np.flatnonzero(counts >= min(wanted, counts.max()))
    cut = seg.cut(regions=wanted)
    assert cut.scale == radii[enough[-1]]
    assert len(cut.regions) >= counts[enough[-1]]
    root = roots[enough[-1]]
    large = [cut.labels[root == one] for one in np.flatnonzero(np.bincount(root) >= size)]
    assert len({labels[0] for labels in large if (labels == labels[0]).all() and labels[0] > 0}) == len(large)


@given(st.integers(0, 2**32 - 1), st.integers(1, 150), st.integers(1, 20), st.integers(2, 12))
@settings(max_examples=40, deadline=None)
def test_no_scale_below_one_with_enough_large_components_is_tried(seed: int, n: int, wanted: int, size: int) -> None:
    points = random_points(seed, n)
    whole = trs.persistent_components(points.xyz, points.lab, points.normals, trs.Params(max_radius=0.03))
    weight = np.ones(n, np.int64)
    tried: list[float] = []

    def large_at(radius: float) -> int:
        return int(np.count_nonzero(np.bincount(whole.cut(radius).root) >= size))

    def count_at(radius: float) -> int:
        tried.append(radius)
        return max(1, large_at(radius))

    found = scale_with_merged_regions(whole, weight, size, wanted, count_at)
    kept = scale_with_kept_regions(whole, weight, size, wanted)
    if large_at(kept) >= wanted:
        assert found >= kept and all(radius > kept for radius in tried)
        assert len(tried) <= 2 * np.log2(n + 2) + 2


def all_scales(seg: trs.Segmentation, *, count: bool = True) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """The largest of the scales that are alike, for all that differ, and the number of regions at each."""
    deaths = np.unique(seg.components.death)
    deaths = deaths[np.isfinite(deaths) & (deaths > 0.0)]
    radii = np.append(np.nextafter(deaths, 0.0), seg.params.max_radius)
    return radii, np.array([len(seg.cut(float(radius)).regions) for radius in radii if count])


def test_a_cut_can_be_cut_again_and_sent() -> None:
    seg = trs.Pipeline(trs.Params(max_radius=0.03, remove_floor=False, min_region_size=5)).run(small_cloud(1, 400))
    small = seg.cut(0.005)
    assert small.params.radius == 0.005 and small.params.max_radius == 0.03
    assert len(small.regions) > len(seg.regions)
    np.testing.assert_array_equal(small.cut(0.03).labels, seg.labels)
    sent = pickle.loads(pickle.dumps(small))
    np.testing.assert_array_equal(sent.cut(0.01).labels, seg.cut(0.01).labels)
    assert small.barcode.max_radius == 0.03
    np.testing.assert_array_equal(small.barcode.death, seg.barcode.death)


@pytest.mark.parametrize("radius", [0.0, -0.01, 0.0201, float("nan"), float("inf")])
def test_scales_out_of_range_are_refused(radius: float) -> None:
    seg = trs.Pipeline(trs.Params(max_radius=0.02, remove_floor=False)).run(small_cloud(0, 50))
    with pytest.raises(
        ValueError, match=rf"radius is {radius}, must be above 0 and at most the filtration's last scale, 0.02"
    ):
        seg.cut(radius)
    if radius != 0.0:
        with pytest.raises(ValueError, match=r"must be between 0 and max_radius, 0\.02"):
            seg.components.cut(radius)


def test_one_of_scale_and_number_is_needed() -> None:
    seg = trs.Pipeline(trs.Params(max_radius=0.02, remove_floor=False)).run(small_cloud(0, 50))
    for what in (seg, seg.components):
        with pytest.raises(ValueError, match="give either radius or regions"):
            what.cut()
        with pytest.raises(ValueError, match="give either radius or regions"):
            what.cut(0.01, regions=3)


def test_a_scale_beyond_the_filtration_is_refused_with_both_values() -> None:
    with pytest.raises(trs.ParameterError, match=r"radius \(0.03\) is greater than max_radius \(0.02\)"):
        trs.Params(max_radius=0.02, radius=0.03)
