# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 node: thin glue around the pipeline; the only place that imports rclpy."""
