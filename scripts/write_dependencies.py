# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Write docs/dependencies.md: what setup.py declares, with the license that each installed package states.

``python scripts/write_dependencies.py``, in an environment that has them all.
"""

from __future__ import annotations

import ast
import importlib.metadata
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "dependencies.md"
HEAD = """\
# Dependencies and their licenses

`python scripts/write_dependencies.py` wrote this from `setup.py` and from what the installed packages
say of themselves.

On a robot only numpy, scipy, numba and the ROS packages of `package.xml` are installed, all from apt; the node imports
nothing else. No dependency is copied into this repository, and none is downloaded while the software runs.

| package | declared as | needed for | license |
|---|---|---|---|
"""
PURPOSES = {
    "": "the tools",
    "ros": "the node without a ROS installation",
    "demo": "`make demo`",
    "dask": "`evaluate` and `sweep` on many cores or machines",
    "bench": "`make bench`",
    "fuzz": "`make fuzz`",
    "test": "`make test`",
    "lint": "`make lint`",
}
ON_A_ROBOT = ("numpy", "scipy", "numba")
# Where a package's metadata hold a whole text or nothing, this is from its repository.
STATED_ELSEWHERE = {
    "ros-jazzy-rclpy": "Apache-2.0",
    "ros-jazzy-rmw-fastrtps-cpp": "Apache-2.0",
    "ros-jazzy-common-interfaces": "Apache-2.0",
    "atheris": "Apache-2.0",
    "gudhi": "MIT, modules that use CGAL GPL-3.0-or-later",
    "colcon-common-extensions": "Apache-2.0",
    "ament-lint-pep257": "Apache-2.0",
    "ament-pycodestyle": "Apache-2.0",
    "ament-xmllint": "Apache-2.0",
    "pycodestyle": "MIT",
}


def declared() -> list[tuple[str, str]]:
    """Return (extra, requirement) for everything that setup.py declares; the extra of install_requires is ""."""
    tree = ast.parse((ROOT / "setup.py").read_text(encoding="utf-8"))
    call = next(
        node for node in ast.walk(tree) if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "setup"
    )
    keywords = {keyword.arg: keyword.value for keyword in call.keywords}
    extras = ast.literal_eval(keywords["extras_require"])
    groups = {"": ast.literal_eval(keywords["install_requires"]), **extras}
    return [(extra, requirement) for extra, requirements in groups.items() for requirement in requirements]


def name_of(requirement: str) -> str:
    """Return the package that a requirement names."""
    match = re.match(r"[\w.-]+", requirement)
    assert match
    return match.group()


def license_of(package: str) -> str:
    """Return the license that the installed package states, or "not installed"."""
    if package in STATED_ELSEWHERE:
        return STATED_ELSEWHERE[package]
    try:
        metadata = importlib.metadata.metadata(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"
    stated = metadata.get("License-Expression") or metadata.get("License") or ""
    classified = [
        line.split(" :: ")[-1] for line in metadata.get_all("Classifier") or [] if line.startswith("License ::")
    ]
    # Some put the whole text into the field.
    if stated and len(stated) < 60 and "\n" not in stated:
        return stated
    return ", ".join(classified) or "see the package"


def page() -> str:
    """Return the text of the page."""
    rows = []
    for extra, requirement in declared():
        name = name_of(requirement)
        purpose = "the node and the tools" if name in ON_A_ROBOT else PURPOSES[extra]
        rows.append(f"| {name} | `{requirement}` | {purpose} | {license_of(name)} |")
    return HEAD + "\n".join(rows) + "\n"


def main() -> int:
    """Write the page; return 1 if some package is not installed, and leave the page as it was."""
    text = page()
    if missing := re.findall(r"\| ([\w.-]+) \|.*not installed", text):
        print(f"not installed, so their licenses are not known: {', '.join(missing)}", file=sys.stderr)
        return 1
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
