# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth and color images find each other by stamp, whatever the order in which they come."""

from __future__ import annotations

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st

from topo_region_seg.cloud.pairing import ROOM, Pair, Pairing

MS = 1_000_000
PERIOD = 33 * MS


def run(events: list[tuple[str, int]], room: int = ROOM) -> tuple[list[Pair[int, int]], list[int]]:
    """Feed ("d" or "c", stamp); the stamps are the images. Return what came out, and after how many events each."""
    pairing: Pairing[int, int] = Pairing(room)
    out: list[Pair[int, int]] = []
    when: list[int] = []
    for place, (kind, stamp) in enumerate(events):
        new = pairing.add_depth(stamp, stamp) if kind == "d" else pairing.add_color(stamp, stamp)
        assert len(pairing) <= room
        out += new
        when += [place] * len(new)
    rest = pairing.flush()
    return out + rest, when + [len(events)] * len(rest)


def partners(pairs: list[Pair[int, int]]) -> dict[int, int | None]:
    return {pair.depth: pair.color for pair in pairs}


@st.composite
def interleaved(draw: st.DrawFn, depths: list[int], colors: list[int], lag: int) -> list[tuple[str, int]]:
    """Either stream in its order, neither more than `lag` images ahead of the other."""
    events, d, c = [], 0, 0
    while d < len(depths) or c < len(colors):
        may_depth = d < len(depths) and (d - c < lag or c == len(colors))
        may_color = c < len(colors) and (c - d < lag or d == len(depths))
        if may_depth and (not may_color or draw(st.booleans())):
            events.append(("d", depths[d]))
            d += 1
        else:
            events.append(("c", colors[c]))
            c += 1
    return events


@given(data=st.data(), n=st.integers(1, 20), offset=st.integers(-16, 16))
@settings(max_examples=200, deadline=None)
def test_equal_streams_are_paired_whole_and_in_order(data: st.DataObject, n: int, offset: int) -> None:
    """Color is early or late by less than half a period, and comes up to five images sooner or later."""
    depths = [PERIOD * number for number in range(1, n + 1)]
    colors = [stamp + offset * MS for stamp in depths]
    pairs, _ = run(data.draw(interleaved(depths, colors, 5)))
    assert [pair.depth for pair in pairs] == depths
    assert [pair.color for pair in pairs] == colors
    assert all(pair.apart is not None and abs(pair.apart - abs(offset) * 1e-3) < 1e-9 for pair in pairs)


@given(data=st.data(), n=st.integers(3, 20))
@settings(max_examples=200, deadline=None)
def test_the_exact_partner_goes_before_a_nearer_arrival(data: st.DataObject, n: int) -> None:
    """A color camera of twice the rate: every second image is exact, the others are half a period away."""
    depths = [2 * PERIOD * number for number in range(1, n + 1)]
    colors = [PERIOD * number for number in range(2, 2 * n + 1)]
    events = []
    for depth in depths:
        before = [("c", depth - PERIOD)] if depth - PERIOD in colors else []
        both = [("d", depth), ("c", depth)]
        events += before + (both if data.draw(st.booleans()) else both[::-1])
    pairs, _ = run(events)
    assert partners(pairs) == {depth: depth for depth in depths}


@given(data=st.data())
@settings(max_examples=300, deadline=None)
def test_every_depth_image_comes_out_once_and_never_with_a_color_from_afar(data: st.DataObject) -> None:
    stamps = st.lists(st.integers(-(10**10), 10**10), max_size=30)
    depths, colors = data.draw(stamps), data.draw(stamps)
    room = data.draw(st.integers(1, 4))
    pairs, _ = run(data.draw(interleaved(depths, colors, 40)), room)
    assert [pair.depth for pair in pairs] == depths
    steps = sorted(b - a for a, b in itertools.pairwise(depths) if b > a)
    reach = max([*steps, PERIOD + MS]) / 2
    for pair in pairs:
        if pair.color is not None:
            assert pair.color in colors and abs(pair.color - pair.depth) <= reach


def test_a_pair_of_equal_stamps_comes_out_at_once() -> None:
    events = [("d", PERIOD), ("c", PERIOD), ("c", 2 * PERIOD), ("d", 2 * PERIOD)]
    assert run(events)[1] == [1, 3]


def test_a_color_that_is_late_by_less_than_half_a_period_comes_out_when_it_is_there() -> None:
    events = [(kind, number * PERIOD + late) for number in range(1, 5) for kind, late in (("d", 0), ("c", 10 * MS))]
    pairs, when = run(events)
    assert when == [1, 3, 5, 7] and all(pair.color == pair.depth + 10 * MS for pair in pairs)


def test_a_color_that_is_early_by_less_than_half_a_period_keeps_no_depth_image_waiting() -> None:
    events = [(kind, number * PERIOD - early) for number in range(1, 6) for kind, early in (("c", 10 * MS), ("d", 0))]
    pairs, when = run(events)
    assert when[2:] == [5, 7, 9], "once the period is known"
    assert all(pair.color == pair.depth - 10 * MS for pair in pairs)


def test_half_a_period_is_the_limit() -> None:
    for late, paired in ((16, True), (17, False)):
        events = [("d", number * PERIOD) for number in range(1, 4)] + [("c", 3 * PERIOD + late * MS)]
        assert (run(events)[0][-1].color is not None) == paired


def test_what_has_no_partner_says_how_far_the_nearest_is() -> None:
    (alone,) = run([("d", 0)])[0]
    assert (alone.color, alone.apart) == (None, None)
    pairs, _ = run([("c", 0), ("d", 400 * MS), ("d", 400 * MS + PERIOD)])
    assert pairs[0].color is None and pairs[0].apart is not None and abs(pairs[0].apart - 0.4) < 1e-9


def test_no_more_wait_than_there_is_room_for() -> None:
    pairs, when = run([("d", number * PERIOD) for number in range(12)], room=4)
    assert when == [4, 5, 6, 7, 8, 9, 10, 11, 12, 12, 12, 12]
    assert all(pair.color is None for pair in pairs)


def test_a_camera_without_a_clock_is_paired_by_arrival() -> None:
    pairing: Pairing[str, str] = Pairing()
    found = []
    for kind, image in ("d1", "c1", "d2", "c2", "c3", "d3"):
        new = pairing.add_depth(0, image) if kind == "d" else pairing.add_color(0, image)
        found += [(pair.depth, pair.color) for pair in new]
    assert found == [("1", "1"), ("2", "1"), ("3", "3")], "the last color to come counts"


def test_a_recording_that_starts_over_loses_nothing() -> None:
    once = [event for number in range(1, 6) for event in (("d", number * PERIOD), ("c", number * PERIOD))]
    pairs, _ = run(once * 3)
    assert [pair.color for pair in pairs] == [number * PERIOD for number in range(1, 6)] * 3
