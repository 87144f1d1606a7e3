# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that are cut short, damaged or have no index: every whole message that is still in them.

Libraries give up at the first damaged byte, so the formats are walked here: MCAP records and chunks, sqlite3 pages and
ROS 1 records. Nothing that a file claims about sizes is trusted.
"""
