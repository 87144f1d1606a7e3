# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""True labels: bodies of the background, and parts of objects that keep their numbers over the frames of a stream."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from topo_region_seg.data import IntArray, LabelArray

OBJECT_BASE = 20
PARTS = 10  # labels of an object

Part = tuple[int, int]
"""Number of the piece of an object's surface, and of the connected part of it that is seen, from the largest."""


class PartNumbers:
    """The numbers, 0 to 9, that the parts of each object have had; keep one for all frames of a stream."""

    def __init__(self) -> None:
        self._known: dict[int, dict[Part, int]] = {}

    def of(self, number: int, parts: list[Part]) -> list[int]:
        """Return the numbers of an object's parts: those they had; new ones get what is free, in the order given.

        Where none is free, new parts get the number of what has been out of sight for longest, and the last number if
        all are in sight.
        """
        had = self._known.get(number, {})
        seen = {part: had[part] for part in parts if part in had}
        unseen = {part: own for part, own in had.items() if part not in seen}
        free = [own for own in range(PARTS) if own not in had.values()]
        for part in parts:
            if part in seen:
                continue
            if not free and unseen:
                free = [unseen.pop(next(iter(unseen)))]
            seen[part] = free.pop(0) if free else PARTS - 1
        self._known[number] = {**unseen, **seen}
        return [seen[part] for part in parts]


def true_labels(
    owner: IntArray, piece: IntArray, background: int, shape: tuple[int, int], numbers: PartNumbers
) -> LabelArray:
    """Label the background bodies and the connected pieces of the objects' faces.

    Parameters
    ----------
    owner : (N,) int64
        Body that each pixel sees; -1 for none.
    piece : (N,) int64
        What piece of the body's surface it sees. Where several pixels of one are not connected, they are several parts.
    background : int
        How many of the bodies, the first ones, are background.
    shape : (int, int)
        Height and width of the image.
    numbers : PartNumbers
        What the parts were called before. Those of an object are numbered from the largest when it is seen first; of
        more than ten, the smallest share the last label.
    """
    labels = np.where(owner < background, owner + 1, 0).astype(np.uint32)
    for number in np.unique(owner[owner >= background]).tolist():
        mine = owner == number
        parts = np.zeros(shape, dtype=np.int64)
        pieces: list[int] = []
        for face in np.unique(piece[mine]).tolist():
            connected, count = ndimage.label((mine & (piece == face)).reshape(shape))
            parts[connected > 0] = connected[connected > 0] + len(pieces)
            pieces += [face] * count
        found = parts.ravel()[mine]
        order = np.argsort(-np.bincount(found)[1:], kind="stable").tolist()
        seen: dict[int, int] = {}
        names: list[Part] = []
        for row in order:
            face = pieces[row]
            names.append((face, seen.get(face, 0)))
            seen[face] = names[-1][1] + 1
        rank = np.empty(len(order) + 1, dtype=np.uint32)
        rank[[1 + row for row in order]] = numbers.of(number, names)
        labels[mine] = OBJECT_BASE + PARTS * (number - background) + rank[found]
    return labels
