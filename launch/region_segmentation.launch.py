# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Start the region segmentation beside a camera driver or with a recording, and RViz on request.

ros2 launch topo_region_seg region_segmentation.launch.py input:=/camera/depth/color/points rviz:=true
ros2 launch topo_region_seg region_segmentation.launch.py bag:=recording.mcap
"""

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import EqualsSubstitution, LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = "topo_region_seg"


def view(_context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """RViz, or a word where it is not installed: an action that fails would leave the nodes behind without a launch."""
    try:
        get_package_prefix("rviz2")
    except PackageNotFoundError:
        return [LogInfo(msg="rviz:=true, but rviz2 is not installed; the node runs without: install ros-jazzy-rviz2")]
    return [
        Node(
            package="rviz2",
            executable="rviz2",
            namespace=LaunchConfiguration("namespace"),
            arguments=["-d", LaunchConfiguration("rviz_config"), "-f", LaunchConfiguration("fixed_frame")],
            parameters=[{"use_sim_time": LaunchConfiguration("use_sim_time")}],
            output="screen",
        )
    ]


def generate_launch_description() -> LaunchDescription:
    share = FindPackageShare(PACKAGE)
    default_parameters = PathJoinSubstitution([share, "config", "region_segmentation.yaml"])
    default_view = PathJoinSubstitution([share, "rviz", "region_segmentation.rviz"])
    namespace = LaunchConfiguration("namespace")
    bag = LaunchConfiguration("bag")
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="namespace of the node and its topics"),
            DeclareLaunchArgument("params_file", default_value=default_parameters, description="YAML file"),
            DeclareLaunchArgument("input", default_value="points", description="topic of the clouds to segment"),
            DeclareLaunchArgument("log_level", default_value="info", description="debug, info, warn, error or fatal"),
            DeclareLaunchArgument("use_sim_time", default_value="false", description="true = time comes from /clock"),
            DeclareLaunchArgument("bag", default_value="", description="recording to play; empty = a camera runs"),
            DeclareLaunchArgument("rviz", default_value="false", description="true = start RViz (package rviz2)"),
            DeclareLaunchArgument("rviz_config", default_value=default_view, description="what RViz shows"),
            DeclareLaunchArgument(
                "fixed_frame", default_value="camera_depth_optical_frame", description="frame_id of the clouds"
            ),
            Node(
                package=PACKAGE,
                executable="region_segmentation_node",
                name="region_segmentation",
                namespace=namespace,
                parameters=[LaunchConfiguration("params_file"), {"use_sim_time": LaunchConfiguration("use_sim_time")}],
                remappings=[("points", LaunchConfiguration("input"))],
                ros_arguments=["--log-level", LaunchConfiguration("log_level")],
                output="screen",
                emulate_tty=True,
            ),
            Node(
                package=PACKAGE,
                executable="topo_region_seg",
                namespace=namespace,
                arguments=["play", bag, "--remap-to", LaunchConfiguration("input")],
                condition=UnlessCondition(EqualsSubstitution(bag, "")),
                output="screen",
            ),
            OpaqueFunction(function=view, condition=IfCondition(LaunchConfiguration("rviz"))),
        ]
    )
