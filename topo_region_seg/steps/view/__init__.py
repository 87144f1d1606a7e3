# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What the frame itself tells of the sensor: the image grid, the spacing of the points and their noise."""
