# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The node as a robot uses it: what it drops, how late it is, and what it takes of the machine."""
