# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""ROS domains that nobody else on this machine uses, so that two test runs do not hear each other."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import product

BASES = range(1, 50, 2)
NEIGHBOR = 50
"""A run has its domain, and those `NEIGHBOR` and `NEIGHBOR` + 1 higher; up to 101 is safe."""
PORT_BASE, DOMAIN_GAIN = 7400, 250  # of the RTPS specification: where the ports of a domain begin
DISCOVERY = (0, 10)
"""Ports of a domain where its participants listen: all of them, and the first alone, where discovery is local."""
LAST = DOMAIN_GAIN - 1  # the last port of a domain, which no participant takes


@contextmanager
def free_domain() -> Iterator[int]:
    """Hold a domain, and its neighbors, until the end; a run that dies gives them back.

    Held is the last port of the domain: it is of the network namespace, as the domain is. A domain where any ROS
    process listens is not taken.
    """
    start = os.getpid() % len(BASES)
    for base in (*BASES[start:], *BASES[:start]):
        with ExitStack() as held:
            try:
                held.enter_context(_bound(base, LAST))
                for domain, offset in product((base, base + NEIGHBOR, base + NEIGHBOR + 1), DISCOVERY):
                    _bound(domain, offset).close()
            except OSError:
                continue
            yield base
            return
    raise RuntimeError(f"every ROS domain from {BASES[0]} to {BASES[-1]} is in use")


def _bound(domain: int, offset: int) -> socket.socket:
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        found.bind(("", PORT_BASE + DOMAIN_GAIN * domain + offset))
    except OSError:
        found.close()
        raise
    return found
