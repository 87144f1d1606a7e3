#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Coverage-guided fuzzing of the PointCloud2 decoder with atheris: `make fuzz`, or

python test/fuzz/fuzz_decode.py -max_total_time=600
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import atheris

with atheris.instrument_imports(include=["topo_region_seg"]):
    from fuzz.structure import decode_keeps_its_promise, make_message


def one_input(data: bytes) -> None:
    """Decode the message that atheris's bytes stand for."""
    provider = atheris.FuzzedDataProvider(data)

    def fill(size: int) -> bytes:
        given = provider.ConsumeBytes(size)
        return given + bytes(size - len(given))

    decode_keeps_its_promise(make_message(provider.ConsumeIntInRange, fill))


if __name__ == "__main__":
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()
