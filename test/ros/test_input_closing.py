# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What happens to the clouds that are on their way when the input closes, without a network."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: pip install '.[ros]' or source ROS 2")

from sensor_msgs.msg import PointCloud2

from topo_region_seg.ros.feed import Feed
from topo_region_seg.ros.input import Input
from topo_region_seg.ros.log import ReasonLog
from topo_region_seg.ros.statistics import Statistics


def node() -> MagicMock:
    made = MagicMock()
    made.resolve_topic_name.return_value = "/points"
    made.get_publishers_info_by_topic.return_value = []
    made._parameter_overrides = {}
    return made


def info(number: int) -> dict[str, Any]:
    return {"source_timestamp": number, "received_timestamp": 0, "publication_sequence_number": number}


@pytest.mark.parametrize("waiting", [0, 1, 3])
def test_a_cloud_that_waits_when_the_input_closes_is_counted_as_dropped(waiting: int) -> None:
    statistics, began, go = Statistics(), threading.Event(), threading.Event()

    def process(frame: Any) -> None:
        began.set()
        assert go.wait(10)
        statistics.processed({}, 1.0, 1.0, points=1, regions=1, stamp="")

    camera = node()
    log = ReasonLog(SimpleNamespace(warning=print), lambda: 0.0)
    source = Input(Feed(camera, log, statistics=statistics), process, "reliable")
    receive = camera.create_subscription.call_args.args[2]
    receive(PointCloud2(), info(0))
    assert began.wait(10)
    for number in range(1, 1 + waiting):
        receive(PointCloud2(), info(number))
    threading.Timer(0.05, go.set).start()
    assert source.close(10)
    now = statistics.snapshot()
    assert (now.received, now.processed, now.dropped) == (1 + waiting, 1, waiting)
    camera.destroy_subscription.assert_called_once_with(camera.create_subscription.return_value)
