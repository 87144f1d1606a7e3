# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The time that a message is of."""

from __future__ import annotations

from typing import Any


def stamp_of(msg: Any) -> int:
    """Return the header stamp of a message, nanoseconds."""
    return int(msg.header.stamp.sec) * 10**9 + int(msg.header.stamp.nanosec)
