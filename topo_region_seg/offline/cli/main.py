# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The command ``topo_region_seg`` and its list of subcommands."""

from __future__ import annotations

import argparse
import importlib
import signal
import sys
import traceback
from collections.abc import Iterable, Sequence
from typing import Any, NoReturn

import topo_region_seg
from topo_region_seg.offline.cli import status
from topo_region_seg.offline.cli.packages import missing_package
from topo_region_seg.offline.cli.status import ToolError
from topo_region_seg.parameter_table import ParameterError

COMMANDS = {
    "inspect": "show what is in a recording: topics, layouts, spacing and noise; and suggest parameters",
    "segment": "segment one cloud file (.pcd, .ply) and print its regions",
    "replay": "segment every cloud of a recording, dropping none, and write the results",
    "evaluate": "measure how well the regions of recorded clouds match known objects",
    "sweep": "try every combination of parameter values on recordings, and show the best",
    "report": "show a run on one HTML page: charts, pictures, barcodes and points in 3D",
    "compare": "show what changed between two runs; fail beyond given limits, for continuous integration",
    "play": "publish recorded clouds in ROS, as a camera would",
    "compile": "compile all kernels into their cache, so that nothing that starts later has to",
}
"""Every subcommand is the module of its name, with `add_arguments(parser)` and `run(args)`, which gives the status."""


class _Parser(argparse.ArgumentParser):
    """Reports wrong usage in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(status.USAGE, f"{self.prog}: error: {message}; see {self.prog} --help\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    ros_arguments: list[str] = []
    if "--ros-args" in arguments:  # what `ros2 run` and launch files append
        split = arguments.index("--ros-args")
        arguments, ros_arguments = arguments[:split], arguments[split:]
    chosen = next((word for word in arguments if not word.startswith("-")), "")
    try:
        parser = build_parser([chosen] if chosen in COMMANDS else [])
        args = parser.parse_args(arguments)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else status.USAGE
    except ImportError as error:
        return _failed(chosen, error, debug="--debug" in arguments)
    if args.command is None:
        parser.print_help()
        return status.USAGE
    args.ros_arguments = ros_arguments
    return _run(args)


def build_parser(complete: Iterable[str] = COMMANDS) -> argparse.ArgumentParser:
    """Return the parser of all subcommands.

    Parameters
    ----------
    complete : iterable of str
        Subcommands that get their arguments too. Those of the others are not needed to run these, and the packages
        that they import may be missing.
    """
    complete = set(complete)
    parser = _Parser(
        prog="topo_region_seg",
        description="Region segmentation of RGB-D point clouds by topological persistence.",
        epilog="exit status: 0 done; 1 some frames failed; 2 wrong usage or input; "
        "3 the input is cut short, but all complete messages were processed",
    )
    parser.add_argument("--version", action="version", version=f"topo_region_seg {topo_region_seg.__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=_Parser)
    for name, summary in COMMANDS.items():
        command = commands.add_parser(
            name,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS)
        if name in complete:
            _module(name).add_arguments(command)
    return parser


def _module(command: str) -> Any:
    return importlib.import_module(f"topo_region_seg.offline.cli.{command}")


def _run(args: argparse.Namespace) -> int:
    """Run one command; every error ends in one line."""
    try:
        return int(_module(args.command).run(args))
    except KeyboardInterrupt:
        print(f"topo_region_seg {args.command}: interrupted", file=sys.stderr)
        return status.INTERRUPTED
    except BrokenPipeError:  # the reader of a pipe, such as `head`, has seen enough
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        sys.stderr.close()
        return status.FAILED
    except Exception as error:
        return _failed(args.command, error, debug=args.debug)


def _failed(command: str, error: Exception, *, debug: bool) -> int:
    """Say in one line why a command failed; returns the exit status."""
    name = f"topo_region_seg {command}"
    if debug:
        traceback.print_exception(error)
    if isinstance(error, ImportError) and (line := missing_package(error)):
        print(f"{name}: error: {line}", file=sys.stderr)
        return status.USAGE
    if isinstance(error, _expected()):
        print(f"{name}: error: {error}", file=sys.stderr)
        return getattr(error, "status", status.USAGE)
    where = traceback.extract_tb(error.__traceback__)[-1]
    reason = " ".join(f"{type(error).__name__}: {error}".split())
    print(
        f"{name}: internal error: {reason} ({where.filename}:{where.lineno}); --debug shows the traceback",
        file=sys.stderr,
    )
    return status.FAILED


def _expected() -> tuple[type[Exception], ...]:
    """Return the classes of errors whose message is for the user.

    Those in modules that need further packages are left out where these modules were not loaded: nothing raised them.
    """
    homes = {"topo_region_seg.cloud.files": "CloudFileError", "topo_region_seg.offline.bags.records": "BagError"}
    loaded = [getattr(sys.modules[home], name) for home, name in homes.items() if home in sys.modules]
    return (ToolError, ParameterError, *loaded)


if __name__ == "__main__":
    sys.exit(main())
