# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Pages for tests: of a made recording, and of one whose every name tries to break out of its place."""

from __future__ import annotations

from pathlib import Path

import clouds
from bag_maker import CLOUD, SECOND, write_mcap
from places import SIMULATED

from topo_region_seg.offline.bags import BagWriter, open_bag
from topo_region_seg.offline.bags.clouds import POINT_CLOUD
from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.frames import FrameResult, Rejection
from topo_region_seg.offline.runs.record import MEDIA_TYPE, RECORD_NAME, RunRecord
from topo_region_seg.offline.runs.run import open_run

SIM = SIMULATED
ATTACKS = (
    "</script><script>window.hacked=1</script>",
    '"><img src="http://attack.invalid/x" onerror="window.hacked=1">',
    "' autofocus onfocus=window.hacked=1 '",
    "</title></style><svg onload=window.hacked=1>",
    "<!--<script>",
    "javascript:window.hacked=1",
    "$data ${scripts} \u202e\u2028\x00",
)


def sim_page(folder: Path, *options: str) -> Path:
    """Replay the simulated recording and write its page."""
    run, page = folder / "run.mcap", folder / "run.html"
    if not run.exists():
        assert main(["replay", str(SIM), "-o", str(run)]) == 0
    assert main(["report", str(run), "-o", str(page), *options]) == 0
    return page


def hostile_page(folder: Path) -> Path:
    """Write the page of a run in which topic, frame id, stages, source, versions and reasons are attacks."""
    entries = []
    for i, attack in enumerate(ATTACKS):
        xyz, rgb = clouds.scene()
        message = clouds.message(xyz, rgb, height=48, sec=i)
        message.header.frame_id = attack.replace("\x00", "")
        entries.append((ATTACKS[0], CLOUD, i * SECOND, message))
    bag, plain, run, page = (folder / name for name in ("in.mcap", "plain.mcap", "hostile.mcap", "hostile.html"))
    write_mcap(bag, entries)
    assert main(["replay", str(bag), "-o", str(plain)]) == 0
    with BagWriter(run) as writer, open_bag(plain) as reader:
        writer.add_topic("/labeled_points", POINT_CLOUD)
        for message in reader.messages(["/labeled_points"]):
            writer.write("/labeled_points", message.log_time, message.data)
        writer.attach(RECORD_NAME, MEDIA_TYPE, _hostile(open_run(plain).record).to_json().encode())
    assert main(["report", str(run), "-o", str(page)]) == 0
    return page


def _hostile(record: RunRecord) -> RunRecord:
    stages = dict.fromkeys(ATTACKS, 1.5)
    return RunRecord(
        source=f"/nowhere/{ATTACKS[1]}",
        topic=ATTACKS[0],
        frames=[FrameResult(f.stamp, f.points, f.regions, {**stages, "total": 12.0}) for f in record.frames],
        rejected=[Rejection(1.0, attack, attack) for attack in ATTACKS],
        truncated=True,
        interrupted=True,
        problems=list(ATTACKS),
        params=record.params,
        versions={attack: attack for attack in ATTACKS},
        created=ATTACKS[3],
    )
