# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Means in place of points, for sensors that deliver more of them than are needed, or than can be dealt with."""
