# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of a run, as text; test_report_browser.py looks at it in a browser."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image
from report_maker import ATTACKS, SIM, hostile_page, sim_page

from topo_region_seg.data import Cloud
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.cli.report import chosen_frames
from topo_region_seg.offline.cli.status import ToolError
from topo_region_seg.offline.report.bars import summarized
from topo_region_seg.offline.report.content import (
    LARGEST_PICTURE,
    PICTURE_BYTES,
    _view,
    evenly,
    in_region_colors,
    points_a_frame,
)
from topo_region_seg.offline.report.markup import Table, environment
from topo_region_seg.offline.report.pictures import data_uri, outlined, small_view
from topo_region_seg.offline.report.points import BYTES_A_POINT, packed_points
from topo_region_seg.offline.report.sections import lead
from topo_region_seg.offline.runs.barcodes import Bars, barcodes_of
from topo_region_seg.offline.runs.record import RunRecord
from topo_region_seg.offline.runs.run import RunFrame, open_run
from topo_region_seg.params import Params


class Elements(HTMLParser):
    """What a page consists of."""

    def __init__(self, source):
        super().__init__()
        self.found, self.blocks, self.words, self._block = [], {}, [], None
        self.feed(source)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.found.append((tag, attributes))
        self._block = attributes.get("id", "") if tag in ("script", "style") else None

    def handle_endtag(self, tag):
        if tag in ("script", "style"):
            self._block = None

    def handle_data(self, data):
        if self._block is None:
            self.words.append(data)
        elif self._block:
            self.blocks[self._block] = json.loads(data)


@pytest.fixture(scope="module")
def sim(tmp_path_factory):
    return sim_page(tmp_path_factory.mktemp("sim"), "--frames", "0,4")


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    return hostile_page(tmp_path_factory.mktemp("hostile"))


def test_the_page_shows_what_the_run_holds(sim):
    run = open_run(sim.with_suffix(".mcap"))
    page = Elements(sim.read_text(encoding="utf-8"))
    data = page.blocks["run"]
    assert [frame["regions"] for frame in data["frames"]] == [frame.regions for frame in run.record.frames]
    assert list(data["charts"]) == ["regions", "time", "quality"]
    assert {name for name in page.blocks if name != "run"} == {"points-0", "points-4", "bars-0", "bars-4"}
    assert sum(tag == "img" for tag, _ in page.found) == 6 * 3  # input, regions and truth
    assert all(attributes["alt"] for tag, attributes in page.found if tag == "img")
    words = " ".join(page.words)
    for name, value in run.params.as_dict().items():
        assert name in words and (str(value).lower() if isinstance(value, bool) else str(value)) in words
    for version in run.record.versions.values():
        assert version in words
    first, sensor = run.record.frames[0], run.record.sensor
    assert f"{100 * first.classes['support'] / first.points:.1f} % support" in words
    assert all(text in words for text in (sensor.pixels_text, sensor.noise_text, sensor.steps_text))


@pytest.mark.parametrize(
    ("changed", "kind"),
    [
        ({}, "regions"),
        ({"output": "supervoxels", "seed_spacing": 0.05}, "supervoxels"),
        ({"output": "objects"}, "objects"),
        ({"track_regions": True}, "regions"),
        ({"max_radius": 0.03}, "regions"),
    ],
)
def test_the_page_begins_with_what_the_labels_are_and_what_is_not_default(changed, kind):
    words = lead(RunRecord("bag", "/points", [], [], False, False, [], {}), Params(**changed))
    assert f"Labels are of {kind}." in words
    for name, value in changed.items():
        assert f"{name} = {str(value).lower()}" in words
    assert ("defaults:" in words) is bool(changed)
    assert "min_region_size" not in words


def test_lines_leave_something_of_small_patches():
    view = np.arange(40 * 40).reshape(40, 40)
    image = np.full((40, 40, 3), 200, np.uint8)
    rows, columns = np.divmod(view, 40)
    small, large = ((1 + rows // side * 40 + columns // side).ravel().astype(np.uint32) for side in (4, 20))
    names = dict.fromkeys(range(2000), "")
    assert np.asarray(outlined(image, small, view, names)).min() == 100
    assert np.asarray(outlined(image, large, view, names)).min() == 0


def test_the_quality_is_that_of_the_evaluation(sim, tmp_path):
    out = tmp_path / "quality.json"
    assert main(["evaluate", str(SIM), "--json", str(out)]) == 0
    wanted = [frame["wov"] for frame in json.loads(out.read_text())["frames"]]
    series = Elements(sim.read_text(encoding="utf-8")).blocks["run"]["charts"]["quality"]["series"]
    assert next(line["values"] for line in series if line["name"] == "WOv") == pytest.approx(wanted, abs=6e-4)


def test_a_page_refers_to_nothing_outside(sim, hostile):
    for path in (sim, hostile):
        for tag, attributes in Elements(path.read_text(encoding="utf-8")).found:
            assert tag not in ("link", "iframe", "object", "embed", "base", "form")
            for name in ("src", "href", "srcset", "action", "data"):
                value = attributes.get(name) or "#"
                assert value.startswith(("#", "data:image/webp;base64,")), (tag, value)


def test_the_policy_allows_the_scripts_and_styles_of_the_page_and_nothing_else(sim, hostile):
    for path in (sim, hostile):
        source = path.read_text(encoding="utf-8")
        (content,) = (
            attributes["content"]
            for tag, attributes in Elements(source).found
            if tag == "meta" and attributes.get("http-equiv") == "Content-Security-Policy"
        )
        rules = {name: values for name, *values in (rule.split() for rule in content.split(";"))}
        assert rules.pop("default-src") == ["'none'"]
        assert rules.pop("base-uri") == ["'none'"] and rules.pop("form-action") == ["'none'"]
        assert rules.pop("img-src") == ["data:"]
        for kind, tag in (("script-src", "script"), ("style-src", "style")):
            there = re.findall(rf"<{tag}>(.*?)</{tag}>", source, re.DOTALL)
            digests = (hashlib.sha256(text.encode("utf-8")).digest() for text in there)
            assert sorted(rules.pop(kind)) == sorted(f"'sha256-{base64.b64encode(d).decode()}'" for d in digests)
        assert not rules
        assert "style=" not in re.sub(r"<script.*?</script>", "", source, flags=re.DOTALL), "the policy forbids it"


def test_nothing_in_a_recording_becomes_markup(sim, hostile):
    honest, attacked = (Elements(path.read_text(encoding="utf-8")) for path in (sim, hostile))
    known = {(tag, name) for tag, attributes in honest.found for name in attributes}
    assert {(tag, name) for tag, attributes in attacked.found for name in attributes} - known == set()
    assert {tag for tag, _ in attacked.found} - {tag for tag, _ in honest.found} == set()
    scripts = [attributes for tag, attributes in attacked.found if tag == "script"]
    assert len([script for script in scripts if "type" not in script]) == 5
    words = "".join(attacked.words)
    for attack in ATTACKS[:-1]:
        assert attack in words  # shown, as text
    assert "\\u202e\\u2028\\u0000" in words


def rendered(template, **values):
    return environment().from_string('{% import "pieces.html" as pieces %}' + template).render(**values)


@pytest.mark.parametrize("value", [*ATTACKS, "<", "&amp;", "\ud800", "]]>", "–"])
def test_text_is_safe_anywhere(value):
    page = Elements(
        rendered('<p title="{{ x }}">{{ x }}</p>{{ pieces.data_block("x", {x: x}) }}', x=value).replace("\ud800", "?")
    )
    assert [tag for tag, _ in page.found] == ["p", "script"]
    assert set(page.found[0][1]) == {"title"}
    assert list(page.blocks) == ["x"]


def test_tables_keep_cells_apart():
    page = Elements(rendered("{{ pieces.table(x) }}", x=Table("<c>", ["a", "b"], [["<td>", 1], ["x", None]])))
    assert sum(tag == "td" for tag, _ in page.found) == 2
    assert "<td>" in page.words


def test_recorded_barcodes_are_those_computed(tmp_path):
    for name, options in (("plain", []), ("all", ["--all"])):
        main(["replay", str(SIM), "-o", str(tmp_path / f"{name}.mcap"), *options])
    computed = barcodes_of(open_run(tmp_path / "plain.mcap"), {1, 3})
    recorded = barcodes_of(open_run(tmp_path / "all.mcap"), {1, 3})
    assert sorted(computed) == sorted(recorded) == [1, 3]
    for index in (1, 3):
        assert computed[index].computed and not recorded[index].computed
        np.testing.assert_allclose(computed[index].death, recorded[index].death, rtol=1e-6)
        np.testing.assert_array_equal(computed[index].label, recorded[index].label)


def test_a_barcode_summed_up_loses_no_bar():
    rng = np.random.default_rng(3)
    death = np.append(rng.uniform(0, 0.02, 500), [np.inf] * 5)
    label = np.append(rng.integers(0, 4, 500), [1, 2, 3, 3, 0]).astype(np.uint32)
    found = summarized(Bars(death, label, computed=False), 0.02)
    assert sum(found["histogram"]) == 500
    assert (found["total"], found["forever"], found["region_count"]) == (505, 5, 3)
    assert found["regions"] == [[1, None], [2, None], [3, None]]
    assert [bar[0] for bar in found["longest"]] == np.round(1e3 * np.sort(death[:500])[::-1][:30], 3).tolist()


def test_a_region_that_dies_shows_its_longest_bar():
    bars = Bars(np.array([0.001, 0.004, 0.002, np.inf]), np.array([1, 1, 2, 2], np.uint32), computed=True)
    assert summarized(bars, 0.02)["regions"] == [[1, 4.0], [2, None]]


def unpacked(values, kind):
    return np.frombuffer(base64.b64decode(values), kind)


def test_packed_points_are_points_of_the_cloud():
    rng = np.random.default_rng(5)
    xyz = (rng.uniform(-0.2, 0.2, (5000, 3)) + [0, 0, 1]).astype(np.float32)
    xyz[::7] = np.nan
    labels = rng.integers(1, 9, 5000).astype(np.uint32)
    rgb = rng.integers(0, 256, (5000, 3), dtype=np.uint8)
    packed = packed_points(Cloud(xyz, rgb, 1, 5000), rgb, labels, None, 1000)
    assert packed["count"] == 1000 and packed["total"] == np.isfinite(xyz).all(axis=1).sum()
    local = (unpacked(packed["xyz"], "<u2").reshape(-1, 3) / 65535 * 2 - 1) * packed["extent"]
    rows = {tuple(color): row for row, color in enumerate(rgb)}
    found = [rows[tuple(color)] for color in unpacked(packed["rgb"], np.uint8).reshape(-1, 3)]
    # A rotation and a shift: distances between the points are kept, to the step of 16 bits.
    for a, b in ((0, 1), (5, 900), (17, 333)):
        wanted = np.linalg.norm(xyz[found[a]] - xyz[found[b]])
        assert np.linalg.norm(local[a] - local[b]) == pytest.approx(wanted, abs=1e-4)
    np.testing.assert_array_equal(unpacked(packed["label"], "<u2"), labels[found])


@pytest.mark.parametrize("points", [0, 1, 2])
def test_clouds_of_hardly_any_points_are_packed(points):
    xyz = np.zeros((points, 3), np.float32)
    xyz[:, 2] = 1.0
    rgb = np.zeros((points, 3), np.uint8)
    assert packed_points(Cloud(xyz, rgb, 1, points), rgb, np.ones(points, np.uint32), None, 10)["count"] == points


@pytest.mark.parametrize("budget", [2_000, 8_000, 60_000])
def test_a_picture_keeps_to_its_budget(budget):
    noise = Image.fromarray(np.random.default_rng(0).integers(0, 256, (300, 400, 3), dtype=np.uint8))
    uri = data_uri(noise, budget)
    assert len(uri) <= budget
    with Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2]))) as picture:
        assert picture.width / picture.height == pytest.approx(4 / 3, rel=0.05)


def test_regions_are_told_apart_without_color():
    labels = np.repeat(np.array([1, 2, 3, 0], np.uint32), 60 * 60).reshape(4, 60, 60)
    labels = np.concatenate([np.concatenate(labels[:2], axis=1), np.concatenate(labels[2:], axis=1)])
    view = np.arange(labels.size).reshape(labels.shape)
    gray = np.asarray(outlined(np.full((*labels.shape, 3), 128, np.uint8), labels.reshape(-1), view).convert("L"))
    assert (gray[:, 59] == 0).all() and (gray[59] == 0).all()  # outlines
    for row, column in ((30, 30), (30, 90), (90, 30)):
        assert gray[row - 8 : row + 8, column - 8 : column + 8].max() > 200  # numbers
    assert (gray[62:118, 62:118] == 128).all()  # none where there is no region


def test_views_show_all_points_and_no_more():
    picture = np.full((100, 200), -1)
    picture[20:80, 50:150] = np.arange(6000).reshape(60, 100)
    assert small_view(picture, 480).shape == (60, 100)
    assert small_view(picture, 50).shape == (30, 50)
    assert small_view(np.full((10, 20), -1), 480).shape == (10, 20)


def test_truth_takes_the_color_of_the_region_that_covers_it(sim):
    frame = next(open_run(sim.with_suffix(".mcap")).frames())
    truth = np.where(frame.labels == 2, 20, np.where(frame.labels == 1, 30, 1)).astype(np.uint32)
    found = in_region_colors(frame, truth)
    assert (found[frame.labels == 2] == 2).all() and (found[frame.labels == 1] == 1).all()
    assert (found[frame.labels > 2] == 0).all()


@pytest.mark.parametrize(
    ("budget", "side"), [(60_000, 480), (9_000, 480), (8_900, 400), (5_000, 320), (4_500, 320), (100, 240)]
)
def test_pictures_get_smaller_with_their_budget(budget, side):
    """By area: a picture of half the side needs a quarter of the bytes."""
    rows, columns = np.mgrid[0:600, 0:800]
    xyz = np.column_stack([0.001 * columns.ravel(), 0.001 * rows.ravel(), np.ones(rows.size)])
    labels = np.ones(rows.size, np.uint32)
    frame = RunFrame(0, None, None, Cloud(xyz, None, 600, 800), labels)
    assert max(_view(frame, budget).shape) == side


@pytest.mark.parametrize("count", [1, 5, 199, 200, 201, 1000])
def test_no_more_frames_are_chosen_than_are_wanted(count):
    for most in (1, 4, 200):
        found = evenly(count, most)
        assert len(found) == min(count, most) == len(set(found)) and found == sorted(found)
        assert found[0] == 0 and (found[-1] == count - 1 or most == 1)
        assert max(np.diff(found), default=1) - min(np.diff(found), default=1) <= 1


def test_frames_are_chosen_evenly():
    assert evenly(12, 4) == [0, 4, 7, 11]
    assert evenly(2, 4) == [0, 1] and evenly(0, 4) == [] and evenly(1, 4) == [0]
    assert chosen_frames("5, 0,5", 6) == [0, 5]


@pytest.mark.parametrize(
    ("asked", "mend"),
    [("0,6", "frames 0 to 5"), ("-1", "frames 0 to 5"), ("x", "write numbers"), ("", "write numbers")],
)
def test_frames_that_are_not_there_are_refused(asked, mend):
    with pytest.raises(ToolError, match=mend):
        chosen_frames(asked, 6)


def test_a_hundred_frames_stay_below_ten_megabytes():
    pictures = 100 * 3 * min(LARGEST_PICTURE, PICTURE_BYTES // 300)
    points = 4 / 3 * 20 * BYTES_A_POINT * points_a_frame(20)
    assert pictures + points < 9e6  # what is left is for charts, tables and barcodes


def test_errors_are_one_line(tmp_path, capsys):
    for arguments in (["report", str(SIM)], ["report", str(tmp_path / "no.mcap")], ["report", str(SIM), "-o", "x.pdf"]):
        assert main(arguments) == 2
        assert capsys.readouterr().err.count("\n") == 1


def test_a_run_without_frames_has_a_page(tmp_path, capsys):
    assert main(["replay", str(SIM), "-o", str(tmp_path / "none.mcap"), "--set", "max_points=10"]) == 1
    assert main(["report", str(tmp_path / "none.mcap")]) == 0
    words = " ".join(Elements((tmp_path / "none.html").read_text(encoding="utf-8")).words)
    assert "too_many_points" in words and "6 rejected" in words


def test_the_numbers_have_the_measures_of_detection_that_the_truth_allows(sim, tmp_path):
    names = ("overlap_f", "precision_50", "recall_50", "false_objects")
    for options, shown in (([], names), (["--partial-truth"], ("recall_50",))):
        page = tmp_path / "page.html"
        assert main(["report", str(sim.with_suffix(".mcap")), "-o", str(page), "--frames", "0", *options]) == 0
        text = page.read_text(encoding="utf-8")
        assert [name for name in names if f'<th scope="row">{name}</th>' in text] == [*shown]
        assert ("on no object" in text) is (not options)
