# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured is what was made; what is suggested can be used, and follows the spacing and the noise."""

from __future__ import annotations

import dataclasses
import json
import struct
from pathlib import Path
from typing import Any

import clouds
import numpy as np
import pytest
import yaml
from bag_maker import CLOUD, SECOND, chunks_of, cloud_entries, count_entry, damage, write_folder, write_mcap, write_ros1
from places import ROOT
from rosbags.rosbag2 import StoragePlugin
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.cli.inspect_text import SHOWN_LAYOUTS
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.cli.parameters import read_parameter_file
from topo_region_seg.offline.inspection.points import point_figures
from topo_region_seg.offline.inspection.suggest import Advice, suggest
from topo_region_seg.offline.inspection.summary import summarize
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.params import Params

SIMULATED = ROOT / "bags" / "tabletop_sim"
LABELED = ROOT.parent / "shared" / "data" / "bags" / "tabletop_labelled"


def wall(spacing: float, noise: float, *, distance: float = 1.0, side: int = 120, seed: int = 0) -> Cloud:
    """A wall seen squarely, on a square grid, with depth noise, in gray with a little color noise."""
    random = np.random.default_rng(seed)
    line = (np.arange(side) - side / 2) * spacing
    x, y = (grid.ravel() for grid in np.meshgrid(line, line))
    xyz = np.column_stack([x, y, distance + random.normal(0.0, noise, x.size)]).astype(np.float32)
    rgb = random.normal(128.0, 4.0, (len(xyz), 3)).clip(0, 255).astype(np.uint8)
    return Cloud(xyz, rgb, side, side)


def advice_for(cloud: Cloud) -> Advice:
    found = suggest([cloud], [point_figures(cloud)])
    assert found is not None
    return found


def run(*arguments: object, status: int = 0) -> None:
    assert main(["inspect", *(str(argument) for argument in arguments)]) == status


def inspected(bag: Path, folder: Path, *arguments: str, status: int = 0) -> dict[str, Any]:
    run(bag, "--json", folder / "i.json", *arguments, status=status)
    return dict(json.loads((folder / "i.json").read_text()))


# --- measuring ---


@pytest.mark.parametrize(("spacing", "noise"), [(0.002, 0.0002), (0.002, 0.0005), (0.004, 0.0)])
def test_spacing_and_noise_are_those_that_were_made(spacing: float, noise: float) -> None:
    summary = summarize([point_figures(wall(spacing, noise))])
    assert summary is not None
    # The nearest of four neighbors on the grid, moved apart in depth.
    steps = np.abs(np.random.default_rng(1).normal(0.0, noise * np.sqrt(2.0), (100_000, 4))).min(axis=1)
    assert summary.spacing == pytest.approx(np.median(np.hypot(spacing, steps)), rel=0.05)
    assert summary.noise == pytest.approx(noise, rel=0.1, abs=1e-7)


def test_invalid_points_are_counted_and_not_measured() -> None:
    cloud = wall(0.002, 0.0)
    xyz = cloud.xyz.copy()
    xyz[:1440] = np.nan
    xyz[1440:2880] = 0.0
    summary = summarize([point_figures(Cloud(xyz, cloud.rgb, 120, 120))])
    assert summary is not None
    assert (summary.invalid, summary.zeros) == pytest.approx((0.2, 0.1))
    assert summary.range[1] >= 1.0
    assert summarize([point_figures(Cloud(np.full((9, 3), np.nan), None, 1, 9))]) is None


def test_bands_follow_the_distance() -> None:
    near, far = wall(0.001, 0.0), wall(0.003, 0.0, distance=3.0)
    cloud = Cloud(np.concatenate([near.xyz, far.xyz]), None, 1, 2 * len(near))
    summary = summarize([point_figures(cloud)])
    assert summary is not None
    spacings = [band.spacing for band in summary.bands]
    assert spacings[0] == pytest.approx(0.001, rel=0.01) and spacings[-1] == pytest.approx(0.003, rel=0.01)
    assert summary.bands[0].near < 1.01 and summary.bands[-1].far > 3.0


def test_the_noise_is_that_of_a_plane_fit_with_three_degrees_of_freedom_less() -> None:
    """25 points a fit: their scatter, over 22, has a known median where nothing but noise bends the plane."""
    random = np.random.default_rng(0)
    xyz = np.column_stack([random.uniform(-1.0, 1.0, (100_000, 2)), 1.0 + random.normal(0.0, 1e-4, 100_000)])
    summary = summarize([point_figures(Cloud(xyz, None, 1, len(xyz)))])
    assert summary is not None
    assert summary.noise == pytest.approx(1e-4 * np.sqrt(chi2.median(22) / 22), rel=0.012)


@pytest.mark.parametrize("points", range(1, 4))
def test_clouds_of_hardly_any_points_are_measured(points: int) -> None:
    xyz = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.3, 1.0]])[:points]
    found = point_figures(Cloud(xyz, None, 1, points))
    assert (found.points, found.valid, len(found.distance)) == (points, points, points)
    np.testing.assert_array_equal(found.spacing, [0.3] * 3 if points == 3 else [np.nan] * points)
    assert np.isnan(found.noise).all()


# --- suggesting ---


def reasons(cloud: Cloud) -> tuple[Params, dict[str, str]]:
    advice = advice_for(cloud)
    return advice.params(), {suggestion.name: suggestion.reason for suggestion in advice.suggestions}


@pytest.mark.parametrize("noise", [0.0, 0.0008, 0.0026, 0.004, 0.02])
@pytest.mark.parametrize("spacing", [0.001, 0.002, 0.01])
def test_each_reason_is_that_of_its_value(spacing: float, noise: float) -> None:
    """A wall that is too small for a support plane."""
    default = Params()
    params, why = reasons(wall(spacing, noise, side=int(0.24 / spacing) if spacing < 0.01 else 40))
    thinned = "every second one is enough" in why["voxel_size"]
    assert (params.voxel_size > 0.0) is thinned
    left = int(why["voxel_size"].partition(" points")[0].replace(",", ""))
    assert thinned is (left > 20_000)
    apart = 1e-3 * float(why["voxel_size"].partition("segment, ")[2].partition(" mm")[0])
    assert apart > 0.99 * spacing, "noise sets points further apart"
    if thinned:
        assert params.voxel_size == pytest.approx(np.sqrt(2.0) * apart, rel=0.15)
    step = max(apart, params.voxel_size)
    assert 1.8 * step <= params.normal_radius <= 12.0 * step
    twice = why["max_radius"].startswith("twice normal_radius")
    assert twice is (params.max_radius == 2.0 * params.normal_radius)
    assert params.max_radius >= 2.0 * params.normal_radius
    wide = why["floor_distance"].startswith("4 times the depth noise")
    assert wide is (params.floor_distance > default.floor_distance)
    assert why["angle_threshold"].startswith("the default") is (params.angle_threshold == default.angle_threshold)
    differ = float(why["normal_radius"].partition("less than ")[2].partition(" deg")[0])
    assert (params.angle_threshold == default.angle_threshold) is (differ <= default.angle_threshold + 0.05)
    if params.angle_threshold < 30.0:
        assert differ <= params.angle_threshold + 0.05
    distance = np.quantile(np.linalg.norm(wall(spacing, noise).xyz, axis=1), 0.005)
    assert params.min_range < distance and params.max_range > 0.9


def test_lengths_are_far_enough_for_sparse_points_and_never_beyond_their_bounds() -> None:
    for spacing in (1e-5, 3e-4, 0.05, 0.4, 3.0):
        cloud = wall(spacing, 0.0, distance=max(0.3, 40 * spacing), side=40)
        params, why = reasons(cloud)
        assert params.max_radius <= 10.0 and params.normal_radius <= 1.0
        if not why["max_radius"].startswith("twice"):
            assert params.max_radius >= min(2.0 * params.normal_radius, 10.0)
            assert why["max_radius"].endswith("spacings")


def test_what_lies_beyond_half_of_max_radius_apart_is_left_out() -> None:
    """A floor seen from a height: the spacing grows with the distance."""
    angle, around = (grid.ravel() for grid in np.meshgrid(np.linspace(0.05, 1.2, 150), np.linspace(-0.6, 0.6, 150)))
    reach = 0.5 / np.tan(angle)
    xyz = np.column_stack([reach * np.sin(around), np.full(angle.size, 0.5), reach * np.cos(around)])
    params, why = reasons(Cloud(xyz.astype(np.float32), None, 150, 150))
    assert "apart, half of max_radius" in why["max_range"]
    assert params.min_range < params.max_range < np.linalg.norm(xyz, axis=1).max()


def test_lengths_grow_with_the_cloud() -> None:
    cloud = wall(0.0025, 0.0004, distance=1.0)
    small = advice_for(cloud).params()
    large = advice_for(Cloud(cloud.xyz * 10, cloud.rgb, 120, 120)).params()
    for name in ("normal_radius", "max_radius", "max_range"):
        assert getattr(large, name) == pytest.approx(10 * getattr(small, name), rel=0.1)
    assert large.min_region_size == small.min_region_size


def test_noise_widens_the_normals_and_then_the_threshold() -> None:
    quiet, noisy, wild = (advice_for(wall(0.002, noise)).params() for noise in (0.0, 0.0008, 0.02))
    assert quiet.normal_radius < noisy.normal_radius <= wild.normal_radius
    assert quiet.angle_threshold == noisy.angle_threshold == Params().angle_threshold < wild.angle_threshold
    assert wild.floor_distance > Params().floor_distance


def test_dense_clouds_are_thinned_and_sparse_ones_are_not() -> None:
    # Less than floor_min_extent wide: not taken for the support plane.
    dense, sparse = advice_for(wall(0.001, 0.0, side=200)), advice_for(wall(0.002, 0.0, side=100))
    assert dense.params().voxel_size == pytest.approx(0.0015) and sparse.params().voxel_size == 0.0


def test_without_color_only_normals_are_compared() -> None:
    cloud = wall(0.002, 0.0)
    assert advice_for(Cloud(cloud.xyz, None, 120, 120)).params().features == "normals"
    gray = np.full((len(cloud), 3), 90, np.uint8)
    assert advice_for(Cloud(cloud.xyz, gray, 120, 120)).params().features == "normals"
    assert advice_for(cloud).params().features == "color+normals"


def test_color_noise_raises_the_threshold() -> None:
    cloud = wall(0.002, 0.0)
    rgb = np.random.default_rng(0).integers(0, 256, (len(cloud), 3)).astype(np.uint8)
    assert advice_for(cloud).params().color_threshold == Params().color_threshold
    assert advice_for(Cloud(cloud.xyz, rgb, 120, 120)).params().color_threshold > Params().color_threshold


def test_hostile_clouds_get_parameters_or_none() -> None:
    random = np.random.default_rng(0)
    for xyz in (
        np.zeros((0, 3)),
        np.ones((1, 3)),
        np.ones((500, 3)),
        np.column_stack([np.linspace(0.1, 1.0, 500)] * 3),
        random.normal(0.0, 1e20, (500, 3)),
        random.normal(0.0, 1e-20, (500, 3)),
        random.normal(0.0, 500.0, (500, 3)),
    ):
        cloud = Cloud(xyz.astype(np.float32), None, 1, len(xyz))
        found = suggest([cloud], [point_figures(cloud)])
        if found is not None:
            found.params()


# --- the command ---


def test_kinds_of_recordings(tmp_path: Path) -> None:
    entries = [*cloud_entries(3), count_entry()]
    plain = inspected(write_mcap(tmp_path / "a.mcap", entries), tmp_path)
    assert (plain["storage"], plain["files"], plain["compression"]) == ("mcap", 1, ["zstd chunks"])
    assert (plain["start"], plain["duration"]) == (1.0, 2.0)
    assert plain["topics"][1] == {"name": "/count", "type": "std_msgs/msg/UInt32", "count": 1}
    clouds = plain["clouds"]["/camera/points"]
    assert (clouds["count"], clouds["rate"], clouds["stamps_out_of_order"]) == (3, 1.0, 0)
    (layout,) = clouds["layouts"]
    assert (layout["width"], layout["height"], layout["clouds"]) == (32, 24, 3)
    assert layout["fields"][0] == "x f32 at 0" and layout["fields"][3].startswith("rgb ")
    for path, kind in (
        (write_folder(tmp_path / "m", entries, StoragePlugin.MCAP), "mcap"),
        (write_folder(tmp_path / "s", entries, StoragePlugin.SQLITE3), "sqlite3"),
        (write_ros1(tmp_path / "a.bag", entries), "ROS 1 bag"),
    ):
        other = inspected(path, tmp_path)
        assert (other["storage"], other["start"], other["duration"]) == (kind, 1.0, 2.0)
        assert other["clouds"]["/camera/points"]["measured"] == clouds["measured"]
        assert other["clouds"]["/camera/points"]["suggested"] == clouds["suggested"]


def test_damaged_and_cut_recordings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = write_mcap(tmp_path / "a.mcap", cloud_entries(4))
    whole = bag.read_bytes()
    start, end = chunks_of(bag)[1]
    damage(bag, (start + end) // 2)
    found = inspected(bag, tmp_path, status=1)
    assert len(found["problems"]) == 1 and f"chunk at byte {start}" in found["problems"][0]
    assert found["clouds"]["/camera/points"]["count"] == 3
    assert f"chunk at byte {start}" in capsys.readouterr().err

    bag.write_bytes(whole[: end + 20])
    found = inspected(bag, tmp_path, status=3)
    assert found["truncated"] and found["clouds"]["/camera/points"]["count"] == 2
    assert "cut short" in capsys.readouterr().out


def test_what_is_odd_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    entries = cloud_entries(4)
    entries[1][3].header.stamp.sec = 0
    entries[2][3].data = entries[2][3].data[:-1]
    entries[3][3].header.frame_id = "other"
    entries += [("/truth", "sensor_msgs/msg/PointCloud2", SECOND, cloud_entries(1)[0][3])]
    entries[-1][3].fields = entries[-1][3].fields[3:]
    run(write_mcap(tmp_path / "a.mcap", entries), status=1)
    shown = capsys.readouterr().out
    assert "1 out of order by their stamps" in shown
    assert "1 unusable: data_too_short" in shown
    assert "frame 'other'" in shown
    assert "no x, y and z, or no valid point" in shown


def test_clouds_in_another_frame_than_the_cameras(tmp_path: Path) -> None:
    frame = simulate(tabletop(1), Camera.kinect(160, 120), 1).cloud
    moved = Rotation.from_euler("xyz", (-2.0, 0.1, 0.3)).apply(frame.xyz.astype(np.float64)) + [-0.8, 0.1, 0.5]
    moved[(frame.xyz == 0.0).all(axis=1)] = np.nan
    for name, xyz in (("camera", frame.xyz), ("base_link", moved)):
        entry = ("/points", CLOUD, SECOND, clouds.message(xyz, frame.rgb, height=frame.height))
        found = inspected(write_mcap(tmp_path / f"{name}.mcap", [entry]), tmp_path)
        told = found["clouds"]["/points"]["notices"]
        assert ("(-0.800, 0.100, 0.500) m" in told.get("camera_found", "")) == (name == "base_link")


def test_the_camera_is_told_or_that_there_is_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = inspected(SIMULATED, tmp_path)["clouds"]["/camera/depth/points"]["sensor"]
    assert found["pixel_rad"] == pytest.approx(1.0 / 262.5, rel=0.05) and 0.9 < found["valid"] < 1.0
    depths, noise = ([entry[name] for entry in found["noise"]] for name in ("depth", "noise"))
    assert depths == sorted(depths) and noise == sorted(noise) and 0.0005 < noise[1] < 0.003
    steps = [1e3 * entry["step"] for entry in found["noise"]]
    assert steps == sorted(steps)  # of a disparity
    told = capsys.readouterr().out
    assert f"camera: pixels 0.218 deg apart, {100 * found['valid']:.1f} % valid; noise" in told
    assert f"steps of depth {steps[0]:.2f} mm at {depths[0]:.2f} m" in " ".join(told.split())
    rng = np.random.default_rng(0)
    entry = ("/points", CLOUD, SECOND, clouds.message(rng.uniform(-1.0, 1.0, (5000, 3)).astype(np.float32), None))
    assert inspected(write_mcap(tmp_path / "around.mcap", [entry]), tmp_path)["clouds"]["/points"]["sensor"] is None
    assert "no image of a camera" in capsys.readouterr().out


def test_fields_of_every_type_and_many_layouts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ["i8", "u8", "i16", "u16", "i32", "u32", "f32", "f64", "datatype 9"]
    entries = cloud_entries(9)
    for number, entry in enumerate(entries):
        entry[3].fields[3] = dataclasses.replace(
            entry[3].fields[3], name="other", datatype=number + 1, count=1 + number % 2
        )
    bag = write_mcap(tmp_path / "a.mcap", entries)
    layouts = inspected(bag, tmp_path)["clouds"]["/camera/points"]["layouts"]
    shown = {layout["fields"][3] for layout in layouts}
    offset = entries[0][3].fields[3].offset
    assert shown == {f"other {name}{'[2]' if n % 2 else ''} at {offset}" for n, name in enumerate(names)}
    out = capsys.readouterr().out
    assert f"and {9 - SHOWN_LAYOUTS} other layouts" in out and out.count("1 times ") == SHOWN_LAYOUTS
    run(write_mcap(tmp_path / "b.mcap", entries[:SHOWN_LAYOUTS]))
    assert "other layouts" not in capsys.readouterr().out
    run(write_mcap(tmp_path / "c.mcap", cloud_entries(2)))
    assert "times" not in capsys.readouterr().out.partition("fields")[0]


def test_topics_are_chosen_where_parameters_are_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = write_mcap(tmp_path / "a.mcap", [*cloud_entries(1, "/left"), *cloud_entries(1, "/right")])
    assert set(inspected(bag, tmp_path)["clouds"]) == {"/left", "/right"}
    assert set(inspected(bag, tmp_path, "--topic", "/right")["clouds"]) == {"/right"}
    capsys.readouterr()
    out = tmp_path / "p.yaml"
    run(bag, "--params-out", out, status=2)
    assert "--topic /left, --topic /right" in capsys.readouterr().err and not out.exists()
    run(bag, "--params-out", out, "--topic", "left")
    assert out.exists()
    run(bag, "--params-out", tmp_path / "p.txt", "--topic", "left", status=2)
    run(bag, "--frames", "0", status=2)
    run(write_mcap(tmp_path / "b.mcap", [count_entry()]))
    assert "no clouds" in capsys.readouterr().out


def test_suggested_file_is_the_nodes_and_can_be_replayed(tmp_path: Path) -> None:
    out = tmp_path / "p.yaml"
    found = inspected(SIMULATED, tmp_path, "--params-out", str(out))
    suggested = {name: s["value"] for name, s in found["clouds"]["/camera/depth/points"]["suggested"].items()}
    assert all(s["reason"] for s in found["clouds"]["/camera/depth/points"]["suggested"].values())
    values = yaml.safe_load(out.read_text())["/**"]["ros__parameters"]
    assert values == suggested == read_parameter_file(out)
    types = {row.name: row.type for row in Params.table()}
    assert {name: type(value) for name, value in values.items()} == {name: types[name] for name in values}
    params = Params.from_mapping(values)
    assert main(["replay", str(SIMULATED), "--params", str(out), "--json", str(tmp_path / "s.json")]) == 0
    summary = json.loads((tmp_path / "s.json").read_text())
    assert summary["params"] == params.as_dict()
    assert all(5 <= frame["regions"] <= 60 for frame in summary["frames"])


@pytest.mark.parametrize(
    "bag",
    [
        SIMULATED,
        pytest.param(LABELED, marks=pytest.mark.skipif(not LABELED.is_dir(), reason="../shared/data/bags is not here")),
    ],
    ids=lambda path: path.name,
)
def test_on_a_tabletop_suggestions_are_as_good_as_the_defaults(bag: Path, tmp_path: Path) -> None:
    from topo_region_seg.cloud.pointcloud2 import decode
    from topo_region_seg.offline.bags.clouds import decode_message
    from topo_region_seg.pipeline import Pipeline

    out = tmp_path / "p.yaml"
    run(bag, "--params-out", out)
    suggested = Params.from_mapping(read_parameter_file(out))
    with open_bag(bag) as reader:
        topics = {topic.name: topic for topic in reader.topics}
        cloud_topic, truth_topic = topics["/camera/depth/points"], topics["/ground_truth/labels"]
        clouds = [decode_message(r, cloud_topic) for r in reader.messages([cloud_topic.name])]
        truths = [decode_message(r, truth_topic) for r in reader.messages([truth_topic.name])]
    scores = []
    for params in (Params(), suggested):
        pipeline = Pipeline(params)
        frames = [
            _overlap(_labels(truth), pipeline.run(decode(msg, max_points=10**6)).labels)
            for msg, truth in zip(clouds, truths, strict=True)
        ]
        scores.append(np.mean(frames))
    assert scores[1] >= scores[0] - 0.02


def _labels(truth: Any) -> np.ndarray[Any, np.dtype[np.uint32]]:
    (offset,) = (f.offset for f in truth.fields if f.name == "label")
    raw, step = bytes(truth.data), truth.point_step
    return np.array([struct.unpack_from("<I", raw, i * step + offset)[0] for i in range(len(raw) // step)], np.uint32)


def _overlap(truth: Any, labels: Any) -> float:
    """Weighted overlap, written out: of each object the region that covers most of it."""
    known = truth > 0
    truth, labels = truth[known], labels[known]
    weighted = total = 0.0
    for segment in np.unique(truth[truth >= 20]):
        inside = truth == segment
        counts = np.bincount(labels[inside], minlength=2)[1:]
        best = 1 + int(np.argmax(counts))
        weighted += inside.sum() * int(np.max(counts)) / (inside | (labels == best)).sum()
        total += inside.sum()
    return weighted / total
