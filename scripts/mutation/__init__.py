# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Wrong changes made to the package one at a time, to see whether the tests notice."""
