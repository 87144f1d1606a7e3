# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Minutes of trouble for one running node, to see whether it loses, leaks or miscounts anything.

``python -m benchmarks.soak --minutes 10`` sends VGA clouds at 30 Hz, one in fifty of them malformed, with bursts,
changes of parameters (valid and not), publishers that come and go, and a full lifecycle cycle every minute. With
``--input depth`` it sends depth and color images, a restarted camera has another size, and transforms get lost and
come back. It writes its part of ``docs/soak.md`` and a JSON file beside the other results; the exit status is 0 if
every promise was kept.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.machine import describe
from benchmarks.soak_client import SoakClient
from benchmarks.soak_frames import SIZES, bad_frames, good_frames
from benchmarks.soak_process import NodeUnderWatch
from benchmarks.soak_report import markdown, verdict, with_part

ROOT = Path(__file__).resolve().parent.parent
BAD_ONE_IN = 50
BURST = 15
"""Clouds without a pause between them."""
WITHOUT = 10
"""Frames that come while there is no transform."""
SETTLE = 1.5
"""Seconds without clouds, so that what was sent is processed."""
DOMAIN = 97

SETTINGS: tuple[dict[str, Any], ...] = (
    {"max_radius": 0.03},
    {"angle_threshold": 8.0, "color_threshold": 12.0},
    {"features": "normals"},
    {"voxel_size": 0.004, "normal_radius": 0.015},
    {"max_radius": 0.02, "angle_threshold": 5.0, "color_threshold": 10.0, "features": "color+normals"},
    {"voxel_size": 0.002, "normal_radius": 0.01},
)
INVALID: tuple[dict[str, Any], ...] = (
    {"max_radius": float("nan")},
    {"max_radius": -1.0},
    {"min_range": 11.0},
    {"features": "colour"},
)


class Soak:
    """The plan: what happens when, and the counts of what was done."""

    def __init__(self, client: SoakClient, watch: NodeUnderWatch, hz: float, kind: str) -> None:
        self._client = client
        self._watch = watch
        self._hz = hz
        self._kind = kind
        self._sizes = [good_frames(kind, size) for size in (SIZES if kind == "depth" else SIZES[:1])]
        self._good, self._bad = self._sizes[0], bad_frames(kind)
        self.due: set[int] = set()
        self._random = random.Random(1)
        self._sent = 0
        self.done = {"good": 0, "malformed": 0, "bursts": 0, "parameter sets": 0, "refused sets": 0}
        self.done |= {"publisher restarts": 0, "lifecycle cycles": 0}
        if kind == "depth":
            self.done |= {"other sizes": 0, "times without transforms": 0}

    def run(self, seconds: float) -> float:
        """Send clouds for so long, with everything that the plan holds in between; return the clouds a second."""
        plan = {self._parameters: 5.0, self._burst: 11.0, self._restart_publisher: 23.0, self._cycle: 60.0}
        if self._kind == "depth":
            plan[self._lose_transforms] = 31.0
            self._client.place_camera(known=True)
        start = time.monotonic()
        due = {action: start + (period if period < 60 else min(period, seconds / 2)) for action, period in plan.items()}
        self._client.connect()
        self._send_alone()
        sending = 0.0
        next_cloud = time.monotonic()
        while (now := time.monotonic()) < start + seconds:
            for action, period in plan.items():
                if now >= due[action]:
                    due[action] = now + period
                    action()
                    next_cloud = time.monotonic()
            began = time.monotonic()
            self._send()
            self._watch.sample(every=2.0)
            next_cloud = max(next_cloud + 1.0 / self._hz, began)
            time.sleep(max(0.0, next_cloud - time.monotonic()))
            sending += time.monotonic() - began
        self._send_alone()
        return self._sent / sending if sending else 0.0

    def _send(self, due: bool = True) -> None:
        """Send the next frame; `due` says whether it has to be answered if it is a good one."""
        self._sent += 1
        bad = self._sent % BAD_ONE_IN == 0
        self.done["malformed" if bad else "good"] += 1
        if due and not bad:
            self.due.add(self._sent)
        self._client.send(self._sent, self._random.choice(self._bad if bad else self._good))

    def _send_alone(self) -> None:
        """Send a cloud that surely arrives: from a publisher's first and last the node learns what it missed."""
        time.sleep(SETTLE)
        self._send()
        time.sleep(SETTLE)
        self._watch.sample_idle()

    def _burst(self) -> None:
        for _ in range(BURST):
            self._send(due=False)
        self.done["bursts"] += 1

    def _lose_transforms(self) -> None:
        """Have no transform for a second, then have them again."""
        self._send_alone()
        self._client.place_camera(known=False)
        time.sleep(0.2)
        for _ in range(WITHOUT):
            self._send(due=False)
            time.sleep(1.0 / WITHOUT)
        self._client.place_camera(known=True)
        self._send_alone()
        self.done["times without transforms"] += 1

    def _parameters(self) -> None:
        count = self.done["parameter sets"]
        if not self._client.set_parameters(SETTINGS[count % len(SETTINGS)]):
            raise RuntimeError(f"a valid set of parameters was refused: {SETTINGS[count % len(SETTINGS)]}")
        if self._client.set_parameters(INVALID[count % len(INVALID)]):
            raise RuntimeError(f"an invalid set of parameters was taken: {INVALID[count % len(INVALID)]}")
        self.done["parameter sets"] += 1
        self.done["refused sets"] += 1

    def _restart_publisher(self) -> None:
        self._send_alone()
        self._client.disconnect()
        time.sleep(0.5)
        self.done["publisher restarts"] += 1
        if len(self._sizes) > 1:
            self._good = self._sizes[self.done["publisher restarts"] % len(self._sizes)]
            self.done["other sizes"] += 1
        self._client.connect()
        self._send_alone()

    def _cycle(self) -> None:
        self._send_alone()
        for transition in ("deactivate", "cleanup", "configure", "activate"):
            self._client.change_state(transition)
        self._client.wait_until_matched()
        self._send_alone()
        self.done["lifecycle cycles"] += 1


def main(argv: Sequence[str] | None = None) -> int:
    """Run the soak test; return 0 if every promise was kept, else 1."""
    parser = argparse.ArgumentParser("python -m benchmarks.soak", description=__doc__.split("\n")[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--input", choices=("points", "depth"), default="points", help="what the camera sends")
    parser.add_argument("--hz", type=float, default=30.0, help="clouds a second")
    parser.add_argument("--json", type=Path, default=ROOT / "benchmarks" / "results" / "soak.json")
    parser.add_argument(
        "--page", type=Path, default=ROOT / "docs" / "soak.md", help="the part of this input is written"
    )
    args = parser.parse_args(argv)
    depth = args.input == "depth"
    parameters = ("input:=depth", "base_frame:=base_link") if depth else ()
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    with (
        tempfile.TemporaryDirectory() as folder,
        NodeUnderWatch(DOMAIN, Path(folder) / "node.log", *parameters) as watch,
    ):
        client = SoakClient(DOMAIN, args.input)
        try:
            client.wait_for_node()
            soak = Soak(client, watch, args.hz, args.input)
            reached = soak.run(60.0 * args.minutes)
            figures = client.final_figures()
        finally:
            client.close()
        status = watch.stop(signal.SIGINT)
        log = watch.log
    result = {
        "machine": describe(),
        "minutes": args.minutes,
        "input": args.input,
        "hz": {"wanted": args.hz, "reached": round(reached, 1)},
        "done": soak.done,
        "node": figures,
        "latency_ms": client.latencies(),
        "service_ms": client.service_times(),
        "labels_received": len(client.answered),
        "due": len(soak.due),
        "due_and_answered": len(soak.due & client.answered),
        "process": watch.summary(),
        "exit_status": status,
        "tracebacks": log.count("Traceback"),
        "log_lines": log.count("\n"),
    }
    result["verdict"] = verdict(result)
    args.json.parent.mkdir(parents=True, exist_ok=True)
    args.json.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    page = args.page.read_text(encoding="utf-8") if args.page.exists() else ""
    args.page.write_text(with_part(page, result), encoding="utf-8")
    print(markdown(result))
    if not all(kept for _, kept, _ in result["verdict"]):
        print(log[-4000:], file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
