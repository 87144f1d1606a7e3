# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``python -m topo_region_seg``: the command line."""

from __future__ import annotations

import sys

from topo_region_seg.offline.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
