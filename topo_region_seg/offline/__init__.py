# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The desk: recordings, evaluation, reports and the command line; a robot imports none of it."""
