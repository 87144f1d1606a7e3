# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``python -m topo_region_seg.offline.demo``: the node and a player in two processes, connected over DDS."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import NoReturn

from topo_region_seg.offline.cli import status


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demonstration; return the exit status: 0 done, 1 failed, 2 wrong usage, 130 interrupted."""
    parser = argparse.ArgumentParser("python -m topo_region_seg.offline.demo", description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("demo_output"), help="folder for the results")
    args = parser.parse_args(argv)
    try:
        from topo_region_seg.offline.bags import BagError
        from topo_region_seg.offline.demo.process import DemoError
        from topo_region_seg.offline.demo.run import run
    except ImportError as error:
        print(f"demo: {error}; get it with: pip install '.[ros,demo]'", file=sys.stderr)
        return status.USAGE
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        return status.DONE if run(args.output) else status.FAILED
    except (DemoError, BagError, OSError) as error:
        print(f"demo: {error}", file=sys.stderr)
        return status.FAILED
    except KeyboardInterrupt:
        return status.INTERRUPTED


def _interrupt(number: int, frame: FrameType | None) -> NoReturn:
    """Handle SIGTERM like Ctrl-C, so that the child processes end."""
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main())
