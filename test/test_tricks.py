# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The program that measures the tricks of the kernels: its stages run, and what it replaces is there."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from places import ROOT

sys.path.append(str(ROOT))  # last, so that an installed copy of the package is the one that is tested

from benchmarks import recordings
from benchmarks.tricks import stages
from benchmarks.tricks.forms import FORMS
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.recording import camera_cloud, make_header

TAKE_ON_ALL = """
from benchmarks.tricks import constants, forms
for name in forms.FORMS:
    forms.take_on(name, {})
for choice in (*constants.BY_TIME, *constants.BY_CLOCK, *constants.BY_QUALITY):
    forms.take_on("", {choice.constant: choice.values[0]})
"""


@pytest.fixture(scope="module")
def one_frame() -> recordings.Frame:
    frame = simulate(tabletop(3), Camera.kinect(320, 240), 3)
    return recordings.Frame("a frame", camera_cloud(make_header(0, "camera"), frame.cloud), frame.labels)


@pytest.mark.parametrize("stage", stages.STAGES)
def test_a_stage_runs(stage, one_frame, monkeypatch, warm_kernels) -> None:
    monkeypatch.setattr(recordings, "frames", lambda: (one_frame,))
    stages.STAGES[stage]()()


def test_forms_and_constants_replace_what_is_there() -> None:
    assert {stage for form in FORMS.values() for stage in form.stages} <= set(stages.STAGES)
    command, env = [sys.executable, "-c", TAKE_ON_ALL], {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
