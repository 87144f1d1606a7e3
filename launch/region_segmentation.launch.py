# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Start the region segmentation beside a camera driver or with a recording, and RViz on request.

ros2 launch topo_region_seg region_segmentation.launch.py camera:=realsense rviz:=true
ros2 launch topo_region_seg region_segmentation.launch.py camera:=realsense input:=depth
ros2 launch topo_region_seg region_segmentation.launch.py camera:=realsense camera_name:=front
ros2 launch topo_region_seg region_segmentation.launch.py input:=/camera/depth/color/points
ros2 launch topo_region_seg region_segmentation.launch.py bag:=recording.mcap
"""

from typing import NamedTuple

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import EqualsSubstitution, LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = "topo_region_seg"
DEPTH = "depth"


class Topics(NamedTuple):
    """Where a driver publishes what the node takes: clouds, or depth images with what belongs to them.

    Names that begin with a slash are those of the camera that the driver takes unless it is told another name.
    """

    points: str
    depth: str
    info: str
    color: str


# The names are those that the drivers use unless their own launch files are told otherwise.
CAMERAS = {
    "": Topics("points", "depth/image", "depth/camera_info", "color/image"),
    # Clouds: pointcloud.enable:=true (and pointcloud.ordered_pc:=true for objects). Depth: align_depth.enable:=true.
    "realsense": Topics(
        "/camera/camera/depth/color/points",
        "/camera/camera/aligned_depth_to_color/image_raw",
        "/camera/camera/aligned_depth_to_color/camera_info",
        "/camera/camera/color/image_raw",
    ),
    # Clouds: enable_colored_point_cloud:=true. Both: depth_registration:=true, which aligns the depth to the color.
    "orbbec": Topics(
        "/camera/depth_registered/points",
        "/camera/depth/image_raw",
        "/camera/depth/camera_info",
        "/camera/color/image_raw",
    ),
    # Of zed_wrapper 5; older ones call the color image rgb/image_rect_color. camera_name is zed, as in its examples.
    "zed": Topics(
        "/zed/zed_node/point_cloud/cloud_registered",
        "/zed/zed_node/depth/depth_registered",
        "/zed/zed_node/depth/camera_info",
        "/zed/zed_node/rgb/color/rect/image",
    ),
    # Clouds: rgb_point_cloud:=true. Depth: color_enabled:=true, and the depth in the color camera's view.
    "azure_kinect": Topics("/points2", "/depth_to_rgb/image_raw", "/depth_to_rgb/camera_info", "/rgb/image_raw"),
    # Clouds: PointCloudXyzrgbNode in the namespace /camera. Depth: what that node takes itself, without it.
    "depth_image_proc": Topics(
        "/camera/depth_registered/points",
        "/camera/depth_registered/image_rect",
        "/camera/rgb/camera_info",
        "/camera/rgb/image_rect_color",
    ),
}


def named(topics: Topics, name: str) -> Topics:
    """Return the topics of a camera of another name, which stands in the place of the driver's own, or before it."""
    first = topics.points.split("/")[1] if topics.points.startswith("/") else None
    if not name or first is None:
        return topics
    shared = all(topic.split("/")[1] == first for topic in topics)
    return Topics(*(f"/{name}{topic.removeprefix(f'/{first}') if shared else topic}" for topic in topics))


def nodes(
    context: LaunchContext,
    camera: LaunchConfiguration,
    camera_name: LaunchConfiguration,
    wanted: LaunchConfiguration,
) -> list[LaunchDescriptionEntity]:
    """Return the node with the topics of a camera, and the player with the same."""
    name, given = camera.perform(context), wanted.perform(context)
    if name not in CAMERAS:
        known = ", ".join(filter(None, CAMERAS))
        raise RuntimeError(f"camera:={name}: must be one of {known}; or leave it out and give input:=TOPIC")
    topics = named(CAMERAS[name], camera_name.perform(context))
    if given not in ("points", DEPTH):
        topics = topics._replace(points=given)
    remappings = [
        ("points", topics.points),
        ("depth/image", topics.depth),
        ("depth/camera_info", topics.info),
        ("color/image", topics.color),
    ]
    namespace, bag = LaunchConfiguration("namespace"), LaunchConfiguration("bag")
    settings = {"use_sim_time": LaunchConfiguration("use_sim_time"), **({"input": DEPTH} if given == DEPTH else {})}
    return [
        Node(
            package=PACKAGE,
            executable="region_segmentation_node",
            name="region_segmentation",
            namespace=namespace,
            parameters=[LaunchConfiguration("params_file"), settings],
            remappings=remappings,
            ros_arguments=["--log-level", LaunchConfiguration("log_level")],
            output="screen",
            emulate_tty=True,
        ),
        Node(
            package=PACKAGE,
            executable="topo_region_seg",
            namespace=namespace,
            arguments=["play", bag],
            remappings=remappings,
            condition=UnlessCondition(EqualsSubstitution(bag, "")),
            output="screen",
        ),
    ]


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
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="namespace of the node and its topics"),
            DeclareLaunchArgument("params_file", default_value=default_parameters, description="YAML file"),
            DeclareLaunchArgument(
                "camera",
                default_value="",
                description="driver whose topics are used: realsense, orbbec, zed, azure_kinect or depth_image_proc",
            ),
            DeclareLaunchArgument(
                "camera_name",
                default_value="",
                description="name of that camera, first in its topics; empty = the one that its driver takes",
            ),
            DeclareLaunchArgument(
                "input",
                default_value="points",
                description="points or depth: what is taken of the camera; any other name is a topic of clouds",
            ),
            DeclareLaunchArgument("log_level", default_value="info", description="debug, info, warn, error or fatal"),
            DeclareLaunchArgument("use_sim_time", default_value="false", description="true = time comes from /clock"),
            DeclareLaunchArgument("bag", default_value="", description="recording to play; empty = a camera runs"),
            DeclareLaunchArgument("rviz", default_value="false", description="true = start RViz (package rviz2)"),
            DeclareLaunchArgument("rviz_config", default_value=default_view, description="what RViz shows"),
            DeclareLaunchArgument(
                "fixed_frame", default_value="camera_depth_optical_frame", description="frame_id of the clouds"
            ),
            OpaqueFunction(
                function=nodes, args=[LaunchConfiguration(name) for name in ("camera", "camera_name", "input")]
            ),
            OpaqueFunction(function=view, condition=IfCondition(LaunchConfiguration("rviz"))),
        ]
    )
