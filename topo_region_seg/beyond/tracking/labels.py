# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The labels that tracked regions get, and when one is given again."""

from __future__ import annotations

import numpy as np

from topo_region_seg.data import LabelArray

LARGEST = 65_535
"""Largest label that is tracked, so that labels fit into 16 bits."""


class LabelPool:
    """The free labels, those that have been free for longest first; at the beginning 1 to LARGEST in this order.

    A label that is given back is given again only after all others that are free.
    """

    def __init__(self) -> None:
        self._ring = np.arange(1, LARGEST + 1, dtype=np.uint16)
        self._first, self._free = 0, LARGEST

    def __len__(self) -> int:
        return self._free

    def take(self, count: int) -> LabelArray:
        """Return the `count` labels that have been free for longest, (count,) uint32.

        Raises
        ------
        ValueError
            If there are not so many.
        """
        if count > self._free:
            raise ValueError(f"{count} labels wanted, {self._free} are free")
        places = (self._first + np.arange(count)) % LARGEST
        self._first = (self._first + count) % LARGEST
        self._free -= count
        return self._ring[places].astype(np.uint32)

    def give_back(self, labels: LabelArray) -> None:
        """Take back labels (K,) that are free from now on; the first of them is given again first."""
        places = (self._first + self._free + np.arange(len(labels))) % LARGEST
        self._ring[places] = labels
        self._free += len(labels)
