# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What several test files share."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from ros_domains import free_domain
from strict_skips import pytest_addoption, pytest_configure

__all__ = ["pytest_addoption", "pytest_configure"]

if TYPE_CHECKING:
    from ros_harness import Client, NodeProcess


@pytest.fixture(scope="session")
def warm_kernels() -> None:
    """Kernels compiled into the cache, so that the processes that a test starts need not wait for them."""
    from topo_region_seg.pipeline import warm_up

    warm_up()


@pytest.fixture(scope="session")
def ros_domain(warm_kernels: None) -> Iterator[int]:
    """A ROS domain of this run alone, on this machine alone, with every message field checked.

    The domains 50 and 51 higher belong to it, too.
    """
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"
    with free_domain() as domain:
        yield domain


@pytest.fixture(autouse=True)
def transports_as_before() -> Iterator[None]:
    """What a command that is run inside of this process sets for Fast DDS ends with the test."""
    names = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")
    set_before = [name for name in names if name in os.environ]
    yield
    for name in names:
        if name not in set_before:
            os.environ.pop(name, None)


@pytest.fixture(scope="module")
def client(ros_domain: int, node: NodeProcess) -> Iterator[Client]:
    """A client of the test file's fixture `node`, connected to it."""
    from ros_harness import Client

    client = Client(ros_domain)
    client.wait_for_node()
    yield client
    client.close()


@pytest.fixture
def default_parameters(client: Client) -> Iterator[None]:
    """Default parameters again after the test."""
    yield
    client.reset_parameters()
