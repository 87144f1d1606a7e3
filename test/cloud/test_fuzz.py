# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Arbitrary messages: decoding gives a cloud or the one documented error, soon, in little memory, without a trace.

FUZZ_CASES sets how many are tried; `make fuzz` tries many and then lets atheris look for more.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from fuzz.structure import BYTES_PER_POINT, MAX_POINTS, decode_keeps_its_promise, make_message
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from places import TEST

CASES = int(os.environ.get("FUZZ_CASES", "1000"))
RANDOM_CASES = 6 * CASES

pytestmark = pytest.mark.timeout(max(180, CASES // 20))


@given(data=st.data())
@settings(max_examples=CASES, deadline=None, suppress_health_check=list(HealthCheck))
def test_generated_messages(data: st.DataObject) -> None:
    def number(low: int, high: int) -> int:
        return data.draw(st.integers(low, high))

    def fill(size: int) -> bytes:
        start = data.draw(st.binary(max_size=32))
        return (start or b"\0") * (size // max(1, len(start)) + 1)

    decode_keeps_its_promise(make_message(number, lambda size: fill(size)[:size]))


def test_random_messages() -> None:
    rng = np.random.default_rng(7)

    def number(low: int, high: int) -> int:
        return int(rng.integers(low, high, endpoint=True))

    accepted = sum(decode_keeps_its_promise(make_message(number, rng.bytes)) for _ in range(RANDOM_CASES))
    assert 0.05 < accepted / RANDOM_CASES < 0.95, "the messages are all good or all bad: they try nothing"


def test_memory_follows_the_accepted_size_not_the_claimed_one() -> None:
    rng = np.random.default_rng(8)

    def number(low: int, high: int) -> int:
        return int(rng.integers(low, high, endpoint=True))

    made = [make_message(number, rng.bytes) for _ in range(300)]
    tracemalloc.start()
    try:
        for msg in made:
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            decode_keeps_its_promise(msg)
            peak = tracemalloc.get_traced_memory()[1] - before
            # The message's own text, kept for comparison, is a few bytes for each of data.
            assert peak < 2 * BYTES_PER_POINT * MAX_POINTS + 16 * len(msg.data) + 400 * len(msg.fields) + 200_000
    finally:
        tracemalloc.stop()


def test_coverage_guided_target_runs(tmp_path: Path) -> None:
    pytest.importorskip("atheris", reason="atheris is not installed: pip install '.[fuzz]'")
    target = TEST / "fuzz" / "fuzz_decode.py"
    run = subprocess.run(
        [sys.executable, str(target), "-runs=500", "-seed=1"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(target.parent.parent.parent)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert "Done 500" in run.stdout + run.stderr
