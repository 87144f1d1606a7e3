# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The course of the demonstration."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path
from typing import Any

from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.demo.process import DemoError, Process
from topo_region_seg.offline.demo.report import draw, write_summary
from topo_region_seg.offline.demo.shows import SHOWS, Show
from topo_region_seg.offline.demo.witness import CLOUDS, LABELED, TOPICS, Answer, Witness
from topo_region_seg.offline.simulation.recording import START, write_recording
from topo_region_seg.ros.listener import Listener

START_TIMEOUT = 170.0  # seconds; the node's first start on a machine compiles the kernels
PATIENCE = 4.0  # seconds without a word after which something is said, or no more is awaited
MARK = ".topo_region_seg_demo"  # tells a folder of earlier results from one that only has the same name


def run(output: Path) -> bool:
    """Show every recording and leave the results in `output`; return whether all went well.

    Raises
    ------
    DemoError
        A process died, or no cloud was labeled.
    """
    start = time.monotonic()
    prepare(output)
    _say("two recordings through the node, over DDS: 15 s, and a minute more where the kernels are not compiled yet")
    # A domain of its own on this machine alone: robots nearby are not disturbed.
    domain = 1 + os.getpid() % 100
    recordings = [_show(show, output, domain) for show in SHOWS]
    seconds = time.monotonic() - start
    write_summary(output / "summary.json", seconds, recordings)
    _tell_results(output, recordings, seconds)
    return all(recording["same_offline"] for recording in recordings)


def prepare(output: Path) -> None:
    """Make an empty folder for the results; only one that an earlier run made is emptied."""
    if output.exists():
        if not (output / MARK).is_file() and (not output.is_dir() or any(output.iterdir())):
            raise DemoError(f"{output}: holds something else; remove it or give another --output")
        shutil.rmtree(output)
    (output / "logs").mkdir(parents=True)
    (output / MARK).touch()


def _show(show: Show, output: Path, domain: int) -> dict[str, Any]:
    """Play one recording to a node of its own; return its entry of the summary."""
    _say(f"\n{show.name}: {show.title}")
    settings = [word for name, value in show.params.items() for word in ("-p", f"{name}:={str(value).lower()}")]
    ros = ["--ros-args", "-r", f"points:={CLOUDS}", *settings]
    _say(f"  starting   region_segmentation_node {' '.join(ros)}")
    node = Process("the node", ["topo_region_seg.ros.node", *ros], output / "logs" / f"{show.name}_node.log", domain)
    with node:
        # The recording is made while the node starts.
        recording, labeled = output / f"{show.name}.mcap", output / f"{show.name}_labeled.mcap"
        frames = list(show.frames())
        write_recording(recording, frames, period=1.0 / show.hz)
        with Witness(labeled, _tell) as witness, Listener(TOPICS, domain, witness) as listener:
            _wait_for(listener, node)
            play = ["play", str(recording), "--topic", CLOUDS, "--remap-to", CLOUDS, "--hz", f"{show.hz:g}"]
            _say(f"  playing    topo_region_seg {' '.join(play)}")
            _say(f"  {'frame':>20}{'points':>10}{'labeled':>10}{'regions':>9}{'ms':>8}  from a cloud to its labels")
            command = ["topo_region_seg.offline.cli.main", *play, "--wait-for", "2", "--wait-timeout", "60"]
            log = output / "logs" / f"{show.name}_play.log"
            with Process("the player", command, log, domain) as player:
                _listen(listener, witness, node, player, len(frames))
        if witness.last is None:
            raise DemoError(f"the node labeled none of {len(frames)} clouds; the end of its log:\n{node.tail()}")
    found = draw(show, _cloud_at(frames, witness.last.stamp, show.hz), witness.last.labels, output)
    files = {"recording": recording.name, "labeled": labeled.name, **found.pop("files")}
    facts = {"name": show.name, "title": show.title, "params": show.params, "files": files}
    return {**facts, "frames_sent": len(frames), **found, **witness.summary()}


def _wait_for(listener: Listener, node: Process) -> None:
    """Wait until the node publishes, that is, until its kernels are loaded."""

    def ready() -> bool:
        node.check()
        return listener.publishers(LABELED) > 0

    if listener.spin(ready, PATIENCE):
        return
    _say("  waiting    for the node: its first start on a machine compiles the kernels, up to a minute ...")
    if not listener.spin(ready, START_TIMEOUT):
        raise DemoError(f"the node was not ready after {START_TIMEOUT:g} s; the end of its log:\n{node.tail()}")


def _listen(listener: Listener, witness: Witness, node: Process, player: Process, count: int) -> None:
    """Listen until all clouds are answered, or until no more answers are to be expected."""

    def done() -> bool:
        node.check()
        player.check(ended_is_fine=True)
        return len(witness.answers) >= count

    while player.running and not done():
        listener.spin(lambda: done() or not player.running, PATIENCE)
    # A slow machine drops clouds for newer ones, so that not all are answered.
    while not done():
        before = len(witness.answers)
        if not listener.spin(lambda: len(witness.answers) > before, PATIENCE):  # noqa: B023 - called in this round only
            return


def _cloud_at(frames: list[tuple[Cloud, LabelArray]], stamp: int, hz: float) -> Cloud:
    """Return the played cloud of a stamp in nanoseconds."""
    cloud, _ = frames[round((stamp - START) * 1e-9 * hz)]
    return cloud


def _tell(answer: Answer) -> None:
    ms = "" if answer.ms is None else f"{answer.ms:8.0f}"
    _say(f"  {answer.stamp:>20}{answer.points:>10,}{answer.labeled:>10,}{answer.regions:>9}{ms}")


def _tell_results(output: Path, recordings: list[dict[str, Any]], seconds: float) -> None:
    _say("")
    for entry in recordings:
        same = "same" if entry["same_offline"] else "OTHER"
        median = "?" if entry["ms_median"] is None else f"{entry['ms_median']:.0f}"
        _say(
            f"{entry['name']}: {entry['frames_labeled']} of {entry['frames_sent']} frames labeled, {entry['regions']} "
            f"regions, {median} ms; {same} labels as without ROS"
        )
        for what, name in entry["files"].items():
            _say(f"  {what:<13}{output / name}")
    _say(f"figures: {output / 'summary.json'}; logs: {output / 'logs'}; {seconds:.0f} s in all")


def _say(text: str) -> None:
    print(text, flush=True)
