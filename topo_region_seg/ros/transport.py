# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Shared memory that a cloud fits into.

Fast DDS sends to other processes of the machine through half a megabyte, so that a cloud of 640x480 points waits some
twenty times for its reader; a tenth of a second passes and frames are lost on the way.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, MutableMapping
from pathlib import Path

from topo_region_seg.ros.dead_segments import remove_dead_segments

PROFILES = Path(__file__).with_name("fastdds.xml")
"""Settings of Fast DDS, also installed as share/topo_region_seg/config/fastdds.xml."""
SEGMENT = 32 << 20
"""Size of the segment that they ask for, bytes."""
VARIABLES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")
"""What names the file: to Jazzy's Fast DDS 2, which knows no other, and to Kilted's Fast DDS 3, which warns of it."""
FAST_DDS_3 = "libfastdds.so*"
TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
IN_FOLDER = ("DEFAULT_FASTRTPS_PROFILES.xml", "DEFAULT_FASTDDS_PROFILES.xml")
SHARED_MEMORY = Path("/dev/shm")


def fast_dds(environment: MutableMapping[str, str] | None = None) -> bool:
    """Whether the middleware is Fast DDS, as it is unless ``RMW_IMPLEMENTATION`` names another one."""
    chosen = (os.environ if environment is None else environment).get("RMW_IMPLEMENTATION")
    return not chosen or chosen.startswith("rmw_fastrtps")


def prepare_fast_dds() -> list[str]:
    """Make room and use :data:`PROFILES` before the middleware starts; return what is to be said of it."""
    if not fast_dds():
        return []
    notes = []
    count, size = remove_dead_segments(SHARED_MEMORY)
    if count:
        notes.append(f"removed {count} segment(s) of dead processes from {SHARED_MEMORY}, {size / 1e6:.0f} MB")
    if (reason := use_shared_memory_for_clouds()) is not None:
        notes.append(f"transports of Fast DDS left as they are: {reason}")
    return notes


def use_shared_memory_for_clouds(environment: MutableMapping[str, str] | None = None) -> str | None:
    """Let the middleware that this process starts next use :data:`PROFILES`; harmless with others than Fast DDS.

    Parameters
    ----------
    environment : mapping, optional
        The environment to change; this process's unless given.

    Returns
    -------
    str or None
        Why that was not done, None if it was.
    """
    environment = os.environ if environment is None else environment
    for name in (*VARIABLES, TRANSPORTS):
        if environment.get(name):
            return f"{name} is set"
    for name in IN_FOLDER:
        if Path(name).exists():
            return f"{Path(name).absolute()} is there"
    try:
        room = os.statvfs(SHARED_MEMORY)
    except OSError as error:
        return f"{SHARED_MEMORY}: {error.strerror}"
    # What does not fit ends the process with SIGBUS when it is first written.
    if (free := room.f_bavail * room.f_frsize) < 2 * SEGMENT:
        return (
            f"{SHARED_MEMORY} has {free >> 20} MB left, less than {2 * SEGMENT >> 20}; "
            "end processes that use it, or start the container with --shm-size=512m"
        )
    environment[profiles_variable(environment)] = str(PROFILES)
    return None


def profiles_variable(environment: Mapping[str, str] | None = None) -> str:
    """Return the variable that names the file to the Fast DDS that is installed."""
    environment = os.environ if environment is None else environment
    prefixes = [*filter(None, environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)), sys.prefix]
    return VARIABLES[any(any(Path(prefix, "lib").glob(FAST_DDS_3)) for prefix in prefixes)]
