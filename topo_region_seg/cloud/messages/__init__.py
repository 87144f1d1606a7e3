# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Segmentation -> messages: one code for what the node publishes and what a replay records."""
