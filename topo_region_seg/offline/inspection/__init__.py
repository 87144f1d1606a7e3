# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Measuring clouds without knowing what they show, and the parameters that follow from the measurements."""
