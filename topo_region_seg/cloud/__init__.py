# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The edges: sensor_msgs/PointCloud2 both ways, PCD and PLY files, messages, colors of labels."""
