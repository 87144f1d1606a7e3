# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The program that made a result: its version and a fingerprint of the code that results depend on."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

from topo_region_seg import __version__

_PACKAGE = Path(__file__).resolve().parents[2]
_CODE = (
    "parameter_table.py",
    "params.py",
    "growth.py",
    "data.py",
    "compiled",
    "steps",
    "beyond",
    "segmentation.py",
    "pipeline.py",
    "cloud",
    "offline/bags",
    "offline/frames.py",
    "offline/stamps.py",
    "offline/evaluation",
)


@lru_cache(maxsize=1)
def program_version() -> str:
    """Return a text such as ``0.1.0+5f2c9a1e``; programs whose results may differ have different ones."""
    digest = hashlib.sha256()
    for name in _CODE:
        path = _PACKAGE / name
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(f"{file.relative_to(_PACKAGE).as_posix()}\0".encode())
            digest.update(file.read_bytes())
    return f"{__version__}+{digest.hexdigest()[:8]}"
