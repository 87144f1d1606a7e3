# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The steps of the demonstration."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path
from typing import Any

from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.demo.answers import CLOUDS, LABELED, TOPICS, Answer, AnswerRecorder
from topo_region_seg.offline.demo.process import DemoError, Process
from topo_region_seg.offline.demo.recordings import RECORDINGS, DemoRecording
from topo_region_seg.offline.demo.report import draw, write_summary
from topo_region_seg.offline.simulation.recording import START, write_recording
from topo_region_seg.ros.listener import Listener

START_TIMEOUT = 170.0  # seconds; the node's first start on a machine compiles the kernels
PATIENCE = 4.0  # seconds of silence before a message is printed, or before waiting ends
MARK = ".topo_region_seg_demo"  # marks a folder as results of an earlier run, which may be deleted


def run(output: Path) -> bool:
    """Run the node on every recording and write the results to `output`; return whether all labels are right.

    Raises
    ------
    DemoError
        A process died, or no cloud was labeled.
    """
    start = time.monotonic()
    prepare(output)
    _print("two recordings through the node, over DDS: 15 s, and a minute more if the kernels must be compiled")
    # A separate domain on this machine only, so that robots nearby are not disturbed.
    domain = 1 + os.getpid() % 100
    recordings = [_run(recording, output, domain) for recording in RECORDINGS]
    seconds = time.monotonic() - start
    write_summary(output / "summary.json", seconds, recordings)
    _print_results(output, recordings, seconds)
    return all(recording["same_offline"] for recording in recordings)


def prepare(output: Path) -> None:
    """Create an empty folder for the results; existing files are removed only if an earlier run wrote them."""
    if output.exists():
        if not (output / MARK).is_file() and (not output.is_dir() or any(output.iterdir())):
            raise DemoError(f"{output}: contains other files; remove it or give another --output")
        shutil.rmtree(output)
    (output / "logs").mkdir(parents=True)
    (output / MARK).touch()


def _run(demo: DemoRecording, output: Path, domain: int) -> dict[str, Any]:
    """Play one recording to a new node; return its entry of the summary."""
    _print(f"\n{demo.name}: {demo.title}")
    settings = [word for name, value in demo.params.items() for word in ("-p", f"{name}:={str(value).lower()}")]
    ros = ["--ros-args", "-r", f"points:={CLOUDS}", *settings]
    _print(f"  starting   region_segmentation_node {' '.join(ros)}")
    node = Process("the node", ["topo_region_seg.ros.node", *ros], output / "logs" / f"{demo.name}_node.log", domain)
    with node:
        # The node starts while the recording is made.
        recording, labeled = output / f"{demo.name}.mcap", output / f"{demo.name}_labeled.mcap"
        frames = list(demo.frames())
        write_recording(recording, frames, period=1.0 / demo.hz)
        with AnswerRecorder(labeled, _print_answer) as recorder, Listener(TOPICS, domain, recorder) as listener:
            _wait_for(listener, node)
            play = ["play", str(recording), "--topic", CLOUDS, "--remap-to", CLOUDS, "--hz", f"{demo.hz:g}"]
            _print(f"  playing    topo_region_seg {' '.join(play)}")
            _print(f"  {'frame':>20}{'points':>10}{'labeled':>10}{'regions':>9}{'ms':>8}  from a cloud to its labels")
            command = ["topo_region_seg.offline.cli.main", *play, "--wait-for", "2", "--wait-timeout", "60"]
            log = output / "logs" / f"{demo.name}_play.log"
            with Process("the player", command, log, domain) as player:
                _listen(listener, recorder, node, player, len(frames))
        if recorder.last is None:
            raise DemoError(f"the node labeled none of {len(frames)} clouds; the end of its log:\n{node.tail()}")
    found = draw(demo, _cloud_at(frames, recorder.last.stamp, demo.hz), recorder.last.labels, output)
    files = {"recording": recording.name, "labeled": labeled.name, **found.pop("files")}
    facts = {"name": demo.name, "title": demo.title, "params": demo.params, "files": files}
    return {**facts, "frames_sent": len(frames), **found, **recorder.summary()}


def _wait_for(listener: Listener, node: Process) -> None:
    """Wait until the node publishes, which is when its kernels are loaded."""

    def ready() -> bool:
        node.check()
        return listener.publishers(LABELED) > 0

    if listener.spin(ready, PATIENCE):
        return
    _print("  waiting    for the node: its first start on a machine compiles the kernels (up to a minute) ...")
    if not listener.spin(ready, START_TIMEOUT):
        raise DemoError(f"the node was not ready after {START_TIMEOUT:g} s; the end of its log:\n{node.tail()}")


def _listen(listener: Listener, recorder: AnswerRecorder, node: Process, player: Process, count: int) -> None:
    """Listen until all clouds are answered, or until no more answers arrive."""

    def done() -> bool:
        node.check()
        player.check(ended_is_fine=True)
        return len(recorder.answers) >= count

    while player.running and not done():
        listener.spin(lambda: done() or not player.running, PATIENCE)
    # On a slow machine newer clouds replace older ones, so not all are answered.
    while not done():
        before = len(recorder.answers)
        if not listener.spin(lambda: len(recorder.answers) > before, PATIENCE):  # noqa: B023 - called in this round only
            return


def _cloud_at(frames: list[tuple[Cloud, LabelArray]], stamp: int, hz: float) -> Cloud:
    """Return the played cloud of a stamp in nanoseconds."""
    cloud, _ = frames[round((stamp - START) * 1e-9 * hz)]
    return cloud


def _print_answer(answer: Answer) -> None:
    ms = "" if answer.ms is None else f"{answer.ms:8.0f}"
    _print(f"  {answer.stamp:>20}{answer.points:>10,}{answer.labeled:>10,}{answer.regions:>9}{ms}")


def _print_results(output: Path, recordings: list[dict[str, Any]], seconds: float) -> None:
    _print("")
    for entry in recordings:
        same = "same" if entry["same_offline"] else "DIFFERENT"
        median = "?" if entry["ms_median"] is None else f"{entry['ms_median']:.0f}"
        _print(
            f"{entry['name']}: {entry['frames_labeled']} of {entry['frames_sent']} frames labeled, {entry['regions']} "
            f"regions, {median} ms; {same} labels as without ROS"
        )
        for what, name in entry["files"].items():
            _print(f"  {what:<13}{output / name}")
    _print(f"figures: {output / 'summary.json'}; logs: {output / 'logs'}; {seconds:.0f} s in total")


def _print(text: str) -> None:
    print(text, flush=True)
