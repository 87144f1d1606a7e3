# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which frame of a run belongs to which cloud of another recording, where several have the same stamp."""

from __future__ import annotations

from collections import Counter

from topo_region_seg.offline.runs.record import RunRecord


class StampCounts:
    """How many clouds of each stamp a run has read.

    Parameters
    ----------
    record : RunRecord
        The run's record.
    """

    def __init__(self, record: RunRecord) -> None:
        self._frames = Counter(frame.stamp for frame in record.frames)
        self._rejected = Counter(rejection.stamp for rejection in record.rejected)

    def clouds(self, stamp: float) -> int:
        """Return the number of clouds of a stamp (s), rejected ones included."""
        return self._frames[stamp] + self._rejected[stamp]

    def ordered(self, stamp: float) -> bool:
        """Whether the frames of a stamp (s) are in the order of its clouds without a gap: none of them was rejected."""
        return not self._rejected[stamp]
