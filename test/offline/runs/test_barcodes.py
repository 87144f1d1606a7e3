# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The bars of a run's frames have the labels that its points have."""

from __future__ import annotations

import numpy as np
import pytest
from bag_maker import CLOUD, SECOND, write_mcap

from topo_region_seg.offline.cli.main import main
from topo_region_seg.offline.runs.barcodes import barcodes_of
from topo_region_seg.offline.runs.run import open_run
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.recording import CLOUD_TOPIC, camera_cloud, make_header

FRAMES = {0, 1, 2}


@pytest.mark.parametrize("options", [[], ["--all"]], ids=["computed", "recorded"])
def test_bars_have_the_labels_of_a_tracked_run(options, tmp_path):
    # Every scene is another one, so that labels move on from frame to frame.
    seen = [simulate(tabletop(seed), Camera.kinect(160, 120), seed).cloud for seed in (1, 5, 9)]
    entries = [
        (CLOUD_TOPIC, CLOUD, i * SECOND, camera_cloud(make_header(i * SECOND, "camera"), cloud))
        for i, cloud in enumerate(seen, start=1)
    ]
    bag, out = write_mcap(tmp_path / "in.mcap", entries), tmp_path / "run.mcap"
    assert main(["replay", str(bag), "-o", str(out), "--set", "track_regions=true", *options]) == 0
    run = open_run(out)
    labels = {frame.index: frame.labels for frame in run.frames()}
    found = barcodes_of(run, FRAMES)
    assert set(found) == set(labels) == FRAMES
    for index, bars in found.items():
        assert bars.computed == (not options)
        assert set(bars.label.tolist()) - {0} == set(labels[index].tolist()) - {0}
    assert max(labels[2]) > len(np.unique(labels[2]))  # labels of the last frame do not count from 1


def test_a_source_of_other_clouds_gives_no_barcode(tmp_path):
    cloud = simulate(tabletop(1), Camera.kinect(80, 60), 1).cloud
    other = simulate(tabletop(1), Camera.kinect(96, 72), 1).cloud
    header = make_header(SECOND, "camera")
    bag, wrong = (
        write_mcap(tmp_path / name, [(CLOUD_TOPIC, CLOUD, SECOND, camera_cloud(header, given))])
        for name, given in (("in.mcap", cloud), ("wrong.mcap", other))
    )
    assert main(["replay", str(bag), "-o", str(tmp_path / "run.mcap")]) == 0
    run = open_run(tmp_path / "run.mcap")
    assert set(barcodes_of(run, {0})) == {0}
    assert barcodes_of(run, {0}, wrong) == {}
