# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What ``compare_revisions.py`` is made of: inputs, configurations, a worker for each revision, the comparison."""
