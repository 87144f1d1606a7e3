# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The objects of every cloud of a recording, with labels that last: bag_to_objects.py BAG.

Needs `pip install .`. `topo_region_seg replay BAG --set output=objects --set track_regions=true` does that and more.
"""

import sys

import topo_region_seg as trs
from topo_region_seg.beyond.tracking.tracker import Tracker
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message


def main(bag: str) -> None:
    """Print the objects of each cloud, the largest first."""
    params = trs.Params(output="objects")
    pipeline, tracker = trs.Pipeline(params), Tracker()
    with open_bag(bag) as reader:
        topic = cloud_topic(reader)
        for record in reader.messages([topic.name]):
            message = decode_message(record, topic)
            stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
            cloud = decode(message, max_points=params.max_points)
            seg = tracker.follow(cloud, pipeline.run(cloud), stamp)
            sizes = ", ".join(f"{seg.regions[i].label}: {seg.regions[i].size}" for i in range(len(seg.regions)))
            print(f"{stamp:.1f} s: {len(seg.regions)} objects (label: points): {sizes}")
        for problem in reader.problems:
            print(problem, file=sys.stderr)


if __name__ == "__main__":
    main(*sys.argv[1:])
