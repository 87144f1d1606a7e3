# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Start one region segmentation for each of two cameras, in namespaces of their own.

ros2 launch topo_region_seg two_cameras.launch.py \
  left_input:=/left/depth/color/points right_input:=/right/depth/color/points
ros2 launch topo_region_seg two_cameras.launch.py camera:=realsense left_input:=depth right_input:=depth
ros2 launch topo_region_seg two_cameras.launch.py left_bag:=left.mcap right_bag:=right.mcap rviz:=true
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare

PACKAGE = "topo_region_seg"
SIDES = ("left", "right")


def generate_launch_description() -> LaunchDescription:
    share = FindPackageShare(PACKAGE)
    default_parameters = PathJoinSubstitution([share, "config", "region_segmentation.yaml"])
    default_view = PathJoinSubstitution([share, "rviz", "region_segmentation.rviz"])
    one_camera = PathJoinSubstitution([share, "launch", "region_segmentation.launch.py"])
    entities = [
        DeclareLaunchArgument(
            "camera",
            default_value="",
            description="driver of both cameras: realsense, orbbec, zed, azure_kinect or depth_image_proc",
        ),
        DeclareLaunchArgument("log_level", default_value="info", description="debug, info, warn, error or fatal"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="true = time comes from /clock"),
        DeclareLaunchArgument("rviz", default_value="false", description="true = an RViz for each (package rviz2)"),
        DeclareLaunchArgument("rviz_config", default_value=default_view, description="what each RViz shows"),
    ]
    for side in SIDES:
        entities += [
            DeclareLaunchArgument(f"{side}_namespace", default_value=side, description="namespace of node and topics"),
            DeclareLaunchArgument(
                f"{side}_camera_name", default_value=side, description="name of the camera, first in its topics"
            ),
            DeclareLaunchArgument(
                f"{side}_input",
                default_value="points",
                description="points or depth: what is taken of the camera; or a topic, relative to the namespace",
            ),
            DeclareLaunchArgument(f"{side}_params_file", default_value=default_parameters, description="YAML file"),
            DeclareLaunchArgument(
                f"{side}_bag", default_value="", description="recording to play; empty = a camera runs"
            ),
            DeclareLaunchArgument(
                f"{side}_frame", default_value=f"{side}_depth_optical_frame", description="frame_id of the clouds"
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(one_camera),
                launch_arguments={
                    "namespace": LaunchConfiguration(f"{side}_namespace"),
                    "camera": LaunchConfiguration("camera"),
                    "camera_name": LaunchConfiguration(f"{side}_camera_name"),
                    "input": LaunchConfiguration(f"{side}_input"),
                    "params_file": LaunchConfiguration(f"{side}_params_file"),
                    "bag": LaunchConfiguration(f"{side}_bag"),
                    "fixed_frame": LaunchConfiguration(f"{side}_frame"),
                    "log_level": LaunchConfiguration("log_level"),
                    "use_sim_time": LaunchConfiguration("use_sim_time"),
                    "rviz": LaunchConfiguration("rviz"),
                    "rviz_config": LaunchConfiguration("rviz_config"),
                }.items(),
            ),
        ]
    return LaunchDescription(entities)
