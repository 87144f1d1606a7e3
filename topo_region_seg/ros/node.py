# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The executable `region_segmentation_node`: arguments, signals and exit status."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Sequence

from topo_region_seg.parameter_table import ParameterError
from topo_region_seg.ros.memory import keep_freed_memory
from topo_region_seg.ros.transport import use_shared_memory_for_clouds

DESCRIPTION = "Segment colored point clouds into persistent regions: a ROS 2 lifecycle node."
USAGE = "region_segmentation_node [--ros-args -p NAME:=VALUE --params-file FILE -r points:=TOPIC --log-level LEVEL ...]"


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until a signal ends it; return the exit status: 0 done, 2 wrong usage."""
    argv = list(sys.argv if args is None else args)
    try:
        import rclpy
        from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
        from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
        from rclpy.utilities import remove_ros_args
    except ImportError as error:
        print(f"{error}: source a ROS 2 installation, or pip install 'topo_region_seg[ros]'", file=sys.stderr)
        return 2
    parser = argparse.ArgumentParser("region_segmentation_node", USAGE, DESCRIPTION)
    own_settings = use_shared_memory_for_clouds()
    try:
        parser.parse_args(remove_ros_args(argv)[1:])
        rclpy.init(args=argv)
    except (rcl.RCLInvalidROSArgsError, rcl.UnknownROSArgsError) as error:
        parser.error(_reason(error))
    except rcl.RCLError as error:
        # Such as an SROS2 keystore without this enclave.
        print(_reason(error), file=sys.stderr)
        return 2

    from topo_region_seg.ros.region_segmentation import RegionSegmentation

    keep_freed_memory()
    node = None
    try:
        node = RegionSegmentation()
        if own_settings is not None:
            node.get_logger().info(f"transports of Fast DDS left as they are: {own_settings}")
        node.autostart()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        executor.spin()
    except ParameterError as error:
        rclpy.logging.get_logger("region_segmentation").fatal(str(error))
        return 2
    except rcl.RCLError as error:
        if node is not None:
            raise
        # Such as a middleware built without security, or an enclave with broken certificates.
        rclpy.logging.get_logger("region_segmentation").fatal(_reason(error))
        return 2
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        # A terminal and a launcher may both send the signal; the second must not tear the cleaning up.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _reason(error: Exception) -> str:
    # Without the places in rcl's source that follow it, on one line.
    return " ".join(str(error).split(", at /")[0].split())


if __name__ == "__main__":
    sys.exit(main())
