# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Header stamps: as seconds, and pairing what has equal ones.

Some drivers stamp every cloud alike, as with 0. Messages of equal stamps are then paired in the order in which they
were recorded: the first with the first, the second with the second.
"""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Iterable


def seconds(stamp: int) -> float:
    """Return nanoseconds as seconds; equal stamps give equal seconds."""
    return stamp // 10**9 + stamp % 10**9 * 1e-9


def ordinals(stamps: Iterable[float]) -> list[tuple[float, int]]:
    """Return each stamp with the number of equal ones before it."""
    seen: Counter[float] = Counter()
    found = []
    for stamp in stamps:
        found.append((stamp, seen[stamp]))
        seen[stamp] += 1
    return found


class StampQueue:
    """Places of a sequence by stamp; those of equal stamps are taken in order.

    Parameters
    ----------
    stamps : iterable of float
        Seconds.
    """

    def __init__(self, stamps: Iterable[float]) -> None:
        self._places: dict[float, deque[int]] = defaultdict(deque)
        for place, stamp in enumerate(stamps):
            self._places[stamp].append(place)

    def take(self, stamp: float) -> int | None:
        """Return the next place of a stamp; None if there is none left."""
        places = self._places.get(stamp)
        return places.popleft() if places else None
