# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Colors for labels: far apart in CIELAB, also as red-green blind people see them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

UNLABELED = (48, 48, 48)
_CYCLE = """
0069ff 00ff00 bf2a00 ea40aa 6ad480 40bfff aa5555 bfaa40
9540bf ff95bf 5595ff 00eaff 80ff6a 40802a aaeabf 805580
ea6a55 ff4080 aa00ea 409580 d480d4 aabf15 eaeaaa bf8000
aad46a 00bf95 0095aa d455d4 809555 8055aa 15ea40 ff2a40
6ad4d4 d400d4 2ad4ff 55aaff ff9500 aa406a ffd455 bf55ea
bf402a bfaa6a ea9595 bf1580 00ffff bf15aa 00956a 40ead4
ffaa80 40ff80 bf6a40 bf6a15 bf956a aa5595 6a80ff d495d4
6ad4aa ff6abf 156ad4 55bfaa 00d455 d4556a 955540 95d495
"""
"""sRGB, most distinct first: each is far from all before it, from white and from the gray of unlabeled points.

The distance of two colors is the smaller of their CIE76 difference and 1.8 times that under protan and deutan vision
(Machado, Oliveira and Fernandes, 2009, severity 1). The table is frozen, so that a label keeps its color over versions.
"""
_PALETTE = np.array([UNLABELED, *(tuple(bytes.fromhex(color)) for color in _CYCLE.split())], dtype=np.uint8)
_PALETTE.flags.writeable = False
SIZE = len(_PALETTE) - 1


def colors(labels: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Return a color for every label; equal labels get equal colors.

    Parameters
    ----------
    labels : (N,) integers
        Labels of points; 0 means no region and is dark gray. The colors repeat after ``SIZE`` labels.

    Returns
    -------
    (N, 3) uint8
        8-bit sRGB.
    """
    wanted = np.asarray(labels).astype(np.uint32, copy=False)
    index = (wanted - np.uint32(1)) & np.uint32(SIZE - 1)
    index += np.uint32(1)
    index *= wanted != 0
    # Rows of 3 bytes taken as one item each: several times as quick as indexing an (n, 3) table.
    table = _PALETTE.view("V3").ravel()
    rows: npt.NDArray[np.uint8] = table.take(index, mode="clip").view(np.uint8)
    return rows.reshape(*wanted.shape, 3)


def palette() -> npt.NDArray[np.uint8]:
    """Return the table of colors, (SIZE + 1, 3) uint8: row 0 for unlabeled points, then the cycle."""
    return _PALETTE
