# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A file that is never asked for more than it holds, whatever its damaged records claim."""

from __future__ import annotations

import os
from io import BufferedReader, FileIO
from pathlib import Path


class BoundedFile(BufferedReader):
    """A file open for reading, whose lengths and places may be those of a damaged record.

    A plain file takes memory for all that a read asks for, before it looks at what is there: a flipped bit of a length
    ends in a MemoryError or an OverflowError. Here reads end, and places lie, at the end of the file.

    Parameters
    ----------
    path : Path
        The file.

    Attributes
    ----------
    length : int
        Of the file when it was opened, bytes.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(FileIO(path))
        self.length = os.fstat(self.fileno()).st_size

    def read(self, size: int | None = -1, /) -> bytes:
        """Read `size` bytes, or as many as are left; all of them where it is negative or None."""
        left = max(0, self.length - self.tell())
        return super().read(left if size is None or size < 0 else min(size, left))

    def seek(self, target: int, whence: int = os.SEEK_SET, /) -> int:
        """Move to a place, or to the end of the file where that lies beyond it."""
        return super().seek(min(target, self.length), whence)
