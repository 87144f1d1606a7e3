# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Where things are that several test files read."""

from __future__ import annotations

from pathlib import Path

TEST = Path(__file__).resolve().parent
ROOT = TEST.parent
SIMULATED = ROOT / "bags" / "tabletop_sim"
"""The recording that the project ships."""
SHARED = ROOT.parent / "shared" / "data"
"""Real recordings, for development and CI only; tests that need them skip where they are absent."""
