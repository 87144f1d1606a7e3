# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels are given again, the longest unused first, and what tracking keeps does not grow with their number."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from topo_region_seg.beyond.tracking import labels, tracker
from topo_region_seg.beyond.tracking.labels import LARGEST, LabelPool
from topo_region_seg.beyond.tracking.tracker import Tracker
from topo_region_seg.beyond.tracking.tracks import Tracks
from topo_region_seg.data import Cloud, RegionTable, SegmentationWarning
from topo_region_seg.growth import growth_of_regions
from topo_region_seg.params import Params
from topo_region_seg.segmentation import Segmentation

PARAMS = Params(track_regions=True)
MEMORY = 10
"""Frames, as docs/tracking.md promises."""
HELD = PARAMS.replace(hold_regions=True)


def stripes(things: Iterable[int], params: Params = PARAMS, points: int = 4) -> tuple[Cloud, Segmentation]:
    """Return an image whose regions are things, each at a place and of a color of its own, `points` points each."""
    names = np.array(list(things), np.int64)
    n = len(names)
    xyz = np.repeat(np.column_stack([names * 1.0, np.zeros(n), np.ones(n)]), points, axis=0)
    label = np.repeat(np.arange(1, n + 1), points).astype(np.uint32)
    ids = np.arange(n * points)
    table = RegionTable(
        label=np.arange(1, n + 1, dtype=np.uint32),
        size=np.full(n, points),
        centroid=xyz[::points],
        minimum=xyz[::points],
        maximum=xyz[::points],
        mean_lab=np.full((n, 3), 50.0),
        mean_normal=np.full((n, 3), np.nan),
        persistence=np.zeros(n),
        confidence=np.full(n, np.nan),
    )
    seg: Any = Segmentation(
        labels=label,
        regions=table,
        point_labels=label,
        index=ids,
        features=None,  # type: ignore[arg-type]
        plane=None,
        params=params,
        scale=0.02,
        filtered=SimpleNamespace(xyz=xyz, sensor=np.zeros(3), growth=growth_of_regions(params)),  # type: ignore[arg-type]
    )
    return Cloud(xyz, None, 1, len(xyz)), seg


@dataclass
class Ledger:
    """The rule in the plainest form: which label each thing has, and since when all others are free."""

    largest: int

    def __post_init__(self) -> None:
        self.free = deque(range(1, self.largest + 1))
        self.known: dict[int, tuple[int, int]] = {}  # thing: label, frames lost

    def follow(self, things: list[int]) -> list[int]:
        lost = sorted((-n - 1, label, thing) for thing, (label, n) in self.known.items() if thing not in things)
        wanted = sum(thing not in self.known for thing in things)
        for n, label, thing in lost:
            self.known[thing] = (label, -n)
            if -n > MEMORY or len(self.free) < wanted:
                del self.known[thing]
                self.free.append(label)
        found, beyond = [], self.largest
        for thing in things:
            if thing not in self.known and self.free:
                self.known[thing] = (self.free.popleft(), 0)
            if thing in self.known:
                self.known[thing] = (self.known[thing][0], 0)
                found.append(self.known[thing][0])
            else:
                beyond += 1
                found.append(beyond)
        return found


@given(st.lists(st.lists(st.integers(0, 11), unique=True, max_size=7), max_size=40), st.sampled_from([5, 8, 12, 30]))
@settings(max_examples=150, deadline=None)
@pytest.mark.filterwarnings("ignore::topo_region_seg.data.SegmentationWarning")
def test_labels_follow_the_rule(stream: list[list[int]], largest: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(labels, "LARGEST", largest)
        patch.setattr(tracker, "LARGEST", largest)
        followed, ledger = Tracker(), Ledger(largest)
        for stamp, things in enumerate(stream):
            done = followed.follow(*stripes(things), stamp)
            assert done.regions.label.tolist() == ledger.follow(things)


def test_patches_out_of_sight_are_forgotten_and_their_labels_are_free() -> None:
    """Unlike regions: a patch that comes back where one was gets a label of its own, and nothing waits for it."""
    for output, same in (("regions", True), ("supervoxels", False)):
        followed, seen = Tracker(), []
        for stamp, things in enumerate(([1, 2, 3], [1, 3], [1, 2, 3])):
            done = followed.follow(*stripes(things, PARAMS.replace(output=output)), stamp)
            seen.append(done.regions.label.tolist())
        assert seen == [[1, 2, 3], [1, 3], [1, 2 if same else 4, 3]]


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 30_000)), max_size=30))
@settings(deadline=None)
def test_the_pool_is_a_queue_of_all_labels(steps: list[tuple[bool, int]]) -> None:
    pool, free, taken = LabelPool(), deque(range(1, LARGEST + 1)), deque[int]()
    for take, count in steps:
        if take:
            count = min(count, len(free))
            found = pool.take(count).tolist()
            assert found == [free.popleft() for _ in range(count)]
            taken.extend(found)
        else:
            back = [taken.popleft() for _ in range(min(count, len(taken)))]
            pool.give_back(np.array(back, np.uint32))
            free.extend(back)
        assert len(pool) == len(free)
    with pytest.raises(ValueError, match="are free"):
        pool.take(len(free) + 1)


def size_of(thing: object, seen: set[int]) -> int:
    """Return the bytes of an object and of all that it holds."""
    if id(thing) in seen:
        return 0
    seen.add(id(thing))
    if isinstance(thing, np.ndarray):
        return thing.nbytes + (size_of(thing.base, seen) if thing.base is not None else 0)
    inner: list[object] = list(vars(thing).values()) if hasattr(thing, "__dict__") else []
    if isinstance(thing, dict):
        inner += [*thing.keys(), *thing.values()]
    elif isinstance(thing, list | tuple | set | deque):
        inner += list(thing)
    return sys.getsizeof(thing) + sum(size_of(one, seen) for one in inner)


def test_what_is_kept_does_not_grow_with_the_labels_given() -> None:
    """All supervoxels of all frames are new: far more of them than there are labels."""
    followed, sizes, used, last = Tracker(), [], set(), 0
    for stamp in range(3_000):
        done = followed.follow(*stripes(range(stamp * 40, stamp * 40 + 40)), stamp)
        if stamp > MEMORY:
            sizes.append(size_of(followed, set()))
        used |= set(done.regions.label.tolist())
        last = int(done.labels.max())
    assert max(sizes) < 1.01 * min(sizes)
    assert used == set(range(1, LARGEST + 1)) and last <= LARGEST


def test_more_regions_than_labels_at_once() -> None:
    followed, notices = Tracker(), []
    cloud, seg = stripes(range(LARGEST + 3), points=1)
    first = followed.follow(cloud, seg, 0.0, warn=lambda code, text: notices.append((code, text)))
    assert first.regions.label.tolist() == list(range(1, LARGEST + 4))
    assert [code for code, _ in notices] == [notice.code for notice in first.notices] == ["labels_short"]
    assert "the 3 smallest new ones" in notices[0][1]
    # Those without a label of their own are not known again; those with one keep it.
    cloud, seg = stripes([LARGEST + 2, 7, *range(100_000, 100_010)], points=1)
    again = followed.follow(cloud, seg, 1.0)
    assert again.regions.label[1] == 8 and not again.notices
    # What is lost gives way, that with the smallest label first, as all have been lost for as long.
    assert again.regions.label[[0, *range(2, 12)]].tolist() == [1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12]
    with pytest.warns(SegmentationWarning, match="labels_short"):
        Tracker().follow(*stripes(range(LARGEST + 1), points=1), 0.0)


def test_what_holding_keeps_does_not_grow_either() -> None:
    followed, sizes = Tracker(), []
    for stamp in range(200):
        cloud, seg = stripes(range(stamp * 40, stamp * 40 + 40), HELD)
        image = replace(cloud, height=40, width=4)
        followed.follow(image, seg, stamp)
        if stamp > MEMORY:
            sizes.append(size_of(followed, set()))
    assert max(sizes) < 1.01 * min(sizes)


def test_regions_in_sight_are_expected_a_step_farther_and_lost_ones_where_they_were() -> None:
    def at(place: float) -> Any:
        return replace(stripes([0])[1].regions, centroid=np.array([[place, 0.0, 1.0]]))

    label, same, none = np.ones(1, np.uint32), np.zeros(1, np.int64), np.full(1, -1)
    moved = Tracks.none().seen(at(0.0), label, none).seen(at(0.03), label, same)
    assert moved.expected_centers()[0, 0] == pytest.approx(0.06)
    hidden = moved.lost_since(none).lost_since(none)
    assert hidden.lost.tolist() == [2]
    assert hidden.expected_centers()[0, 0] == pytest.approx(0.03)
    back = hidden.seen(at(0.09), label, same)  # two frames not seen, so three steps
    assert back.expected_centers()[0, 0] == pytest.approx(0.11)
