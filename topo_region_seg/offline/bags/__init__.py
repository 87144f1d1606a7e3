# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings: readers for rosbag2, MCAP and ROS 1 bags, and the writer. They know messages, not regions."""

from topo_region_seg.offline.bags.opening import open_bag
from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Storage, Topic
from topo_region_seg.offline.bags.writer import BagWriter

__all__ = ["BagError", "BagReader", "BagWriter", "Record", "Storage", "Topic", "open_bag"]
