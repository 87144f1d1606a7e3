# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Make the recording ``bags/tabletop_sim`` again, and with --expected the results expected of it."""

from __future__ import annotations

import argparse
import hashlib
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import decode_message
from topo_region_seg.offline.simulation import Camera, PartNumbers, SimulatedFrame, orbit, simulate, tabletop
from topo_region_seg.offline.simulation.recording import CLOUD_TOPIC, write_recording
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

HERE = Path(__file__).resolve().parent
BAG = HERE / "tabletop_sim"
EXPECTED = HERE / "tabletop_sim_expected.json"
SCENE, FRAMES, SIZE = 7, 6, (320, 240)
PERIOD = 0.2  # seconds


def frames() -> Iterator[SimulatedFrame]:
    """Yield the frames of the recording: one scene, seen from a camera that moves around the table."""
    scene, numbers = tabletop(SCENE), PartNumbers()
    for number, camera in enumerate(orbit(Camera.kinect(*SIZE), FRAMES)):
        yield simulate(scene, camera, seed=number, numbers=numbers)


def results(bag: Path) -> list[dict[str, Any]]:
    """Segment every cloud of the recording with the default parameters."""
    pipeline = Pipeline(Params())
    found = []
    with open_bag(bag) as reader:
        topic = next(topic for topic in reader.topics if topic.name == CLOUD_TOPIC)
        for record in reader.messages([CLOUD_TOPIC]):
            message = decode_message(record, topic)
            seg = pipeline.run(decode(message, max_points=pipeline.params.max_points))
            found.append(
                {
                    "stamp": f"{message.header.stamp.sec}.{message.header.stamp.nanosec:09d}",
                    "points": len(seg.labels),
                    "labeled": int(np.count_nonzero(seg.labels)),
                    "regions": len(seg.regions),
                    "sizes": seg.regions.size.tolist(),
                    "sha256": hashlib.sha256(seg.labels.astype("<u4").tobytes()).hexdigest(),
                }
            )
    return found


def main() -> None:
    """Write the recording, or the expected results of the one that is there."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--expected", action="store_true", help="write only the expected results")
    if not parser.parse_args().expected:
        if BAG.exists():
            shutil.rmtree(BAG)
        count = write_recording(BAG, ((frame.cloud, frame.labels) for frame in frames()), period=PERIOD)
        size = sum(file.stat().st_size for file in BAG.iterdir())
        print(f"{BAG}: {count} frames, {size / 1e6:.1f} MB")
    found = {"params": Params().as_dict(), "frames": results(BAG)}
    EXPECTED.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(f"{EXPECTED}: " + ", ".join(f"{frame['regions']} regions" for frame in found["frames"]))


if __name__ == "__main__":
    main()
