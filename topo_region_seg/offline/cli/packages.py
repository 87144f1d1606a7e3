# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Python packages that only pip brings: a robot that was set up with rosdep and colcon does not have them."""

from __future__ import annotations

import importlib.util

PIP_NAMES = {
    "jinja2": "jinja2",
    "lz4": "lz4",
    "lzf": "python-neo-lzf",
    "matplotlib": "matplotlib",
    "mcap": "mcap",
    "PIL": "pillow",
    "pypcd4": "pypcd4",
    "rich": "rich",
    "rosbags": "rosbags",
    "yaml": "PyYAML",
    "zstandard": "zstandard",
}
"""What pip calls the packages that the commands import."""


def missing_package(error: ImportError) -> str | None:
    """Return one line that says which package is missing and how to get it; None if `error` has another reason."""
    module = (error.name or "").partition(".")[0]
    if module not in PIP_NAMES or _is_installed(module):
        return None
    name = PIP_NAMES[module]
    others = sorted(pip for module, pip in PIP_NAMES.items() if not _is_installed(module))
    line = f"the Python package {name} is not installed; get it with: pip install {name}"
    return line if others == [name] else f"{line} (for all commands: pip install {' '.join(others)})"


def _is_installed(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError):
        return False
