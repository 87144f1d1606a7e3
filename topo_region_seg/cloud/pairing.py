# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth and color images of a camera paired by stamp: the exact one first, else the nearest within half a period.

Images of either kind come in the order of their stamps, but some may be late or missing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import median
from typing import Generic, TypeVar

D = TypeVar("D")
C = TypeVar("C")

ROOM = 8
"""Images of each kind that are kept while their partners may still come: a quarter of a second at 30 Hz."""
USUAL_PERIOD = 1_000_000_000 // 30
"""Time between depth images, nanoseconds, until it is known."""
KNOWN_STEPS = 9


@dataclass(frozen=True)
class Pair(Generic[D, C]):
    """What became of a depth image.

    Parameters
    ----------
    depth : D
        The image.
    color : C or None
        Its partner, None if it has none.
    apart : float or None
        Seconds between its stamp and that of the nearest color image, paired or not; None if there was none.
    """

    depth: D
    color: C | None
    apart: float | None


class _Stream:
    """The steps between the stamps of a stream, nanoseconds; those back or of nothing do not count."""

    def __init__(self) -> None:
        self.newest: int | None = None
        self._steps: deque[int] = deque(maxlen=KNOWN_STEPS)

    def note(self, stamp: int) -> None:
        if self.newest is not None and stamp > self.newest:
            self._steps.append(stamp - self.newest)
        self.newest = stamp

    @property
    def usual(self) -> float:
        return median(self._steps) if self._steps else USUAL_PERIOD

    @property
    def shortest(self) -> int:
        return min(self._steps, default=0)


class Pairing(Generic[D, C]):
    """Pair images as they come; every depth image is handed out once, in the order of arrival.

    A depth image waits while an exact partner, or a nearer one, may still come; the oldest is handed out when more than
    `room` wait. Stamps are nanoseconds.
    """

    def __init__(self, room: int = ROOM) -> None:
        self._room = room
        self._waiting: deque[tuple[int, D]] = deque()
        self._colors: deque[tuple[int, C]] = deque(maxlen=room)
        self._depth_stream, self._color_stream = _Stream(), _Stream()

    def __len__(self) -> int:
        """Return how many depth images wait."""
        return len(self._waiting)

    @property
    def period(self) -> float:
        """Usual time between depth images, seconds."""
        return self._depth_stream.usual * 1e-9

    def add_depth(self, stamp: int, image: D) -> list[Pair[D, C]]:
        """Take a depth image; return those that are decided now."""
        self._depth_stream.note(stamp)
        self._waiting.append((stamp, image))
        return [*self._beyond_room(), *self._decided()]

    def add_color(self, stamp: int, image: C) -> list[Pair[D, C]]:
        """Take a color image; return the depth images that are decided now."""
        self._color_stream.note(stamp)
        self._colors.append((stamp, image))
        return self._decided()

    def flush(self) -> list[Pair[D, C]]:
        """Return all depth images that wait, as nothing more comes."""
        return [self._hand_out() for _ in range(len(self._waiting))]

    def _beyond_room(self) -> Iterator[Pair[D, C]]:
        while len(self._waiting) > self._room:
            yield self._hand_out()

    def _decided(self) -> list[Pair[D, C]]:
        places = [place for place, (stamp, _) in enumerate(self._waiting) if self._is_decided(stamp)]
        # Those before the last one would come too late after it.
        return [self._hand_out() for _ in range(places[-1] + 1 if places else 0)]

    def _is_decided(self, stamp: int) -> bool:
        nearest = self._nearest(stamp)
        if nearest is None:
            return False
        off = stamp - nearest[0]
        if off == 0:
            return True
        if abs(off) > self._reach:
            return False
        newest = self._color_stream.newest
        no_other_comes = newest is not None and newest > stamp
        next_is_farther = 2 * off < self._color_stream.shortest
        return no_other_comes or next_is_farther

    def _nearest(self, stamp: int) -> tuple[int, C] | None:
        """Return the color image whose stamp is nearest, the last to come of several."""
        return min(reversed(self._colors), key=lambda color: abs(color[0] - stamp), default=None)

    @property
    def _reach(self) -> float:
        return self._depth_stream.usual / 2

    def _hand_out(self) -> Pair[D, C]:
        stamp, image = self._waiting.popleft()
        nearest = self._nearest(stamp)
        if nearest is None:
            return Pair(image, None, None)
        off = abs(nearest[0] - stamp)
        return Pair(image, nearest[1] if off <= self._reach else None, off * 1e-9)
