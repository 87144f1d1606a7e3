# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A process that times stages with one form of the kernels, a line of standard input at a time."""

from __future__ import annotations

import json
import sys

from benchmarks.child import MARK
from benchmarks.tricks import forms
from benchmarks.tricks.race import LEAST_SECONDS, least_ms


def main() -> None:
    """Take the form on, then time the stage that each line names."""
    task = json.loads(sys.argv[1])
    forms.take_on(task["form"], task["constants"])
    # Only now, as the kernels take up what they find when they are imported.
    from benchmarks.tricks.stages import STAGES

    works = {stage: STAGES[stage]() for stage in task["stages"]}
    for work in works.values():
        work()
    by_clock = task["by_clock"]
    repeats = {
        stage: max(1, round(1e3 * LEAST_SECONDS / max(least_ms(work, 3, by_clock=by_clock), 0.01)))
        for stage, work in works.items()
    }
    print(MARK + "true", flush=True)
    for line in sys.stdin:
        stage = line.strip()
        print(MARK + json.dumps(least_ms(works[stage], repeats[stage], by_clock=by_clock)), flush=True)


if __name__ == "__main__":
    main()
