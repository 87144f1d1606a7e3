# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The demonstration: the node and a player over DDS, with pictures and figures as results."""
