# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Recorded bytes -> messages of rosbags, of ROS 1 and ROS 2."""

from __future__ import annotations

from typing import Any

from topo_region_seg.cloud.layout import CloudFormatError
from topo_region_seg.offline.bags.records import Record
from topo_region_seg.offline.bags.types import typestore


def recorded_cdr(record: Record) -> bytes:
    """Return the CDR bytes of a message, converted where the recording is of ROS 1.

    Raises
    ------
    CloudFormatError
        The bytes are no ROS 1 message of its type, or the encoding is neither (`undecodable`).
    """
    if record.encoding == "cdr":
        return record.data
    if record.encoding != "ros1":
        raise CloudFormatError("undecodable", f"encoding {record.encoding!r} is neither cdr nor ros1")
    try:
        return bytes(typestore().ros1_to_cdr(record.data, record.type))
    except Exception as error:  # any byte may be wrong, so any conversion may fail
        raise _undecodable(record.type, error) from error


def decode_record(record: Record) -> Any:
    """Return the message of a record.

    Raises
    ------
    CloudFormatError
        The bytes are no message of its type (`undecodable`).
    """
    data = recorded_cdr(record)
    try:
        return typestore().deserialize_cdr(data, record.type)
    except Exception as error:  # as above
        raise _undecodable(record.type, error) from error


def _undecodable(kind: str, error: Exception) -> CloudFormatError:
    reason = " ".join(str(error).split()) or type(error).__name__
    return CloudFormatError("undecodable", f"not a serialized {kind}: {reason}")
