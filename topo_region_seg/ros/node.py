# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The executable `region_segmentation_node`: arguments, signals and exit status."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from topo_region_seg.ros.ending import Ending

DESCRIPTION = "Segment colored point clouds into persistent regions: a ROS 2 lifecycle node."
USAGE = "region_segmentation_node [--ros-args -p NAME:=VALUE --params-file FILE -r points:=TOPIC --log-level LEVEL ...]"
NAME = "region_segmentation"
DONE, FAILED, WRONG_USAGE = 0, 1, 2


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until a signal ends it; return the exit status: 0 done, 1 its start failed, 2 wrong usage.

    Imports come after the signals are taken: they last longer than many a start is left in peace.
    """
    ending = Ending()
    argv = list(sys.argv if args is None else args)
    try:
        import rclpy
        from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
        from rclpy.signals import SignalHandlerOptions
    except ImportError as error:
        print(f"{error}: source a ROS 2 installation, or pip install 'topo_region_seg[ros]'", file=sys.stderr)
        return WRONG_USAGE
    _check_usage(argv)
    from topo_region_seg.ros import region_segmentation  # noqa: F401  # most of the time of the start
    from topo_region_seg.ros.log import unwritable_folder
    from topo_region_seg.ros.transport import prepare_fast_dds

    notes = prepare_fast_dds()
    ros_arguments = argv
    if (reason := unwritable_folder()) is not None:
        ros_arguments = [*argv, "--ros-args", "--disable-external-lib-logs"]
        notes.append(f"no log file is written ({reason}); set ROS_LOG_DIR to a folder that can be written to")
    try:
        rclpy.init(args=ros_arguments, signal_handler_options=SignalHandlerOptions.NO)
    except (rcl.RCLInvalidROSArgsError, rcl.UnknownROSArgsError, rcl.RCLError) as error:
        # Such as a parameter file that is not there, or an SROS2 keystore without this enclave.
        print(f"region_segmentation_node: error: {_one_line(error)}", file=sys.stderr)
        return WRONG_USAGE
    ending.by(rclpy.get_default_context().try_shutdown)
    try:
        return _run(argv, notes, ending)
    except Exception:
        if ending.requested.is_set():
            return DONE  # in many ways rclpy says that its context has gone
        raise
    finally:
        rclpy.try_shutdown()


def _check_usage(argv: Sequence[str]) -> None:
    import argparse

    from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
    from rclpy.utilities import remove_ros_args

    parser = argparse.ArgumentParser("region_segmentation_node", USAGE, DESCRIPTION)
    try:
        parser.parse_args(remove_ros_args(argv)[1:])
    except (rcl.RCLInvalidROSArgsError, rcl.UnknownROSArgsError) as error:
        parser.error(_one_line(error))


def _run(argv: Sequence[str], notes: Sequence[str], ending: Ending) -> int:
    from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
    from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
    from rclpy.logging import get_logger

    from topo_region_seg.parameter_table import ParameterError
    from topo_region_seg.ros.memory import keep_freed_memory
    from topo_region_seg.ros.parameter_files import files_without_effect
    from topo_region_seg.ros.region_segmentation import RegionSegmentation

    keep_freed_memory()
    try:
        node = RegionSegmentation()
    except (ParameterError, rcl.RCLError) as error:
        # RCLError: such as a middleware built without security, or an enclave with broken certificates.
        if ending.requested.is_set():
            raise
        get_logger(NAME).fatal(_one_line(error))
        return WRONG_USAGE
    try:
        for text in notes:
            node.get_logger().info(text)
        for text in files_without_effect(argv, node.get_fully_qualified_name()):
            node.get_logger().warning(text)
        node.autostart()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        executor.spin()
    except ExternalShutdownException:
        pass
    finally:
        node.destroy_node()
    return FAILED if node.start_failed else DONE


def _one_line(error: Exception) -> str:
    # Without the places in rcl's source that follow it.
    return " ".join(str(error).split(", at /")[0].split())


if __name__ == "__main__":
    sys.exit(main())
