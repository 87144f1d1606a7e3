# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The same requests to both revisions, and what came of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from revision_comparison.configurations import CORE, LAYOUTS, SPECIAL, STREAMS, Configuration
from revision_comparison.differences import differences
from revision_comparison.inputs import SIMULATED_BAG, inputs, recorded, recordings, stored
from revision_comparison.recording import LAYOUTS as LAYOUT_TOPICS
from revision_comparison.recording import messages, write_layouts
from revision_comparison.revisions import RevisionError, Worker

SHOWN = 6


@dataclass(frozen=True)
class Outcome:
    """One configuration on one input; `problems` is empty where the results are the same."""

    name: str
    compared: int
    problems: list[str]

    def line(self) -> str:
        """Return what is printed."""
        if not self.problems:
            return f"equal    {self.name} ({self.compared} arrays)"
        more = len(self.problems) - SHOWN
        return f"DIFFERS  {self.name}: {'; '.join(self.problems[:SHOWN])}" + (f"; {more} more" if more > 0 else "")


class Comparison:
    """Gives both revisions the same work; `folder` takes the files between them."""

    def __init__(self, base: Worker, present: Worker, folder: Path) -> None:
        self._workers = base, present
        self._folder = folder

    def start(self) -> None:
        """Compile the kernels of both revisions, or load them."""
        problems = self._failures([{"do": "start"}, {"do": "start"}])
        if problems:
            raise RevisionError("; ".join(problems))

    def clouds(self, data: Path, *, quick: bool) -> Iterator[Outcome]:
        """Segment every cloud in every configuration."""
        for cloud in inputs(data, quick=quick):
            path = stored(cloud, self._folder)
            for configuration in (*CORE, *(SPECIAL if cloud.special and not (quick and " " in cloud.name) else ())):
                if cloud.rgb is not None or not configuration.needs_color:
                    request = {"do": "segment", "cloud": str(path), "params": configuration.params}
                    yield self._outcome(f"{cloud.name}: {configuration.name}", request, "arrays", "npz")
            path.unlink()

    def replays(self, data: Path, *, quick: bool) -> Iterator[Outcome]:
        """Replay every recording, and one of several layouts of points."""
        for bag in recordings(data, quick=quick):
            for configuration in STREAMS:
                yield self._replayed(bag, None, configuration)
        layouts = self._folder / "layouts"
        write_layouts(layouts, list(recorded(SIMULATED_BAG))[:2])
        for topic in LAYOUT_TOPICS:
            for configuration in LAYOUTS:
                yield self._replayed(layouts, topic, configuration)

    def _replayed(self, bag: Path, topic: str | None, configuration: Configuration) -> Outcome:
        request = {"do": "replay", "bag": str(bag), "topic": topic, "params": configuration.params}
        name = f"replay {bag.stem}{topic or ''}: {configuration.name}"
        return self._outcome(name, request, "output", "mcap")

    def _outcome(self, name: str, request: dict[str, Any], key: str, suffix: str) -> Outcome:
        """Let both work at once, and compare the files that they write."""
        files = [self._folder / f"{side}.{suffix}" for side in ("base", "present")]
        for file in files:
            file.unlink(missing_ok=True)
        errors = self._failures([{**request, key: str(file)} for file in files])
        if errors:
            return Outcome(name, 0, errors)
        base, present = (messages(file) if suffix == "mcap" else _arrays(file) for file in files)
        return Outcome(name, len(base), differences(base, present) if base else ["there is nothing to compare"])

    def _failures(self, requests: list[dict[str, Any]]) -> list[str]:
        """Let both work at once; return what failed."""
        for worker, request in zip(self._workers, requests, strict=True):
            worker.send(request)
        answers = [worker.receive() for worker in self._workers]
        sides = zip(("before", "now"), answers, strict=True)
        return [f"fails {side}: {answer['error']}" for side, answer in sides if "error" in answer]


def _arrays(path: Path) -> dict[str, Any]:
    with np.load(path) as arrays:
        return dict(arrays)
