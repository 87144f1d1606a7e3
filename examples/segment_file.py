# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Segment a .pcd or .ply file and write it with labels: segment_file.py CLOUD OUTPUT.

Needs `pip install .`; the command `topo_region_seg segment` does the same and more.
"""

import sys

import topo_region_seg as trs
from topo_region_seg.cloud.files import read_cloud, write_labeled_cloud


def main(source: str, target: str) -> None:
    """Print the largest regions, and write the cloud with a field `label`."""
    params = trs.Params()  # max_radius=0.02 sets the scale, in metres
    cloud = read_cloud(source, max_points=params.max_points)
    seg = trs.Pipeline(params).run(cloud)
    print(f"{len(cloud)} points, {len(seg.regions)} regions at a scale of {1e3 * seg.scale:.1f} mm")
    for index in range(min(5, len(seg.regions))):
        region = seg.regions[index]
        x, y, z = region.centroid
        print(f"region {region.label}: {region.size} points around ({x:.3f}, {y:.3f}, {z:.3f}) m")
    write_labeled_cloud(target, cloud, seg.labels)
    print(f"wrote {target}")


if __name__ == "__main__":
    main(*sys.argv[1:])
