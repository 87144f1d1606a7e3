# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The recording that a replay writes."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from topo_region_seg.cloud.layout import Warn
from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.topics import OUTPUTS
from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags.clouds import POINT_CLOUD, cdr
from topo_region_seg.offline.bags.image_topics import base_name
from topo_region_seg.offline.bags.images import ImageTopic
from topo_region_seg.offline.bags.records import Record, Topic
from topo_region_seg.offline.bags.types import bag_types
from topo_region_seg.offline.bags.writer import BagWriter
from topo_region_seg.offline.cli.status import ToolError
from topo_region_seg.offline.runs.record import MEDIA_TYPE, RECORD_NAME, RunRecord
from topo_region_seg.segmentation import Segmentation

ALWAYS = ("labeled_points", "region_count")
ON_REQUEST = tuple(output.name for output in OUTPUTS if output.name not in ALWAYS)


def asked_for(names: Sequence[str], everything: bool) -> tuple[str, ...]:
    """Return the outputs that ``--also`` names, with or without a slash; all of them where everything is asked for.

    Raises
    ------
    ToolError
        There is no such output.
    """
    wanted = [name.strip().removeprefix("/") for text in names for name in text.split(",")]
    for name in wanted:
        if name not in (*ALWAYS, *ON_REQUEST):
            raise ToolError(f"--also {name}: no such output; choose from {', '.join(ON_REQUEST)}")
    return ON_REQUEST if everything else tuple(wanted)


def input_topic(topic: Topic) -> str:
    """Return the topic that recorded clouds are written to: their own, or one beside that of depth images."""
    return f"{base_name(topic.name).rpartition('/')[0]}/points" if isinstance(topic, ImageTopic) else topic.name


class ReplayOutput:
    """Writes what the node would publish.

    Parameters
    ----------
    path : Path or None
        File or folder to write; None writes nothing.
    also : collection of str
        Outputs to write beside the labeled points and the number of regions; names of :data:`ON_REQUEST`.
    input_topic : str or None
        Also write the recorded clouds, on this topic.
    compression : str
        Compression of the chunks: lz4 keeps up with the segmentation on two cores, zstd does not.
    """

    def __init__(
        self,
        path: Path | None,
        *,
        also: Collection[str] = (),
        input_topic: str | None,
        compression: str = "lz4",
    ) -> None:
        self._outputs = [output for output in OUTPUTS if output.name in ALWAYS or output.name in also]
        self._input_topic = input_topic
        self._types = bag_types()
        topics = {f"/{output.name}": output.kind for output in self._outputs}
        if input_topic in topics:
            raise ToolError(f"--with-input: {input_topic} is also the name of a result; leave out --with-input")
        self._writer = BagWriter(path, compression=compression) if path else None
        if self._writer:
            for name, kind in ({input_topic: POINT_CLOUD} if input_topic else {}).items() | topics.items():
                self._writer.add_topic(name, kind)

    def write(self, record: Record, msg: Any, cloud: Cloud, seg: Segmentation, warn: Warn) -> None:
        """Write the results of one cloud with the log time of the recorded one."""
        if self._writer is None:
            return
        answer = Answer(msg, cloud, seg, warn=warn)
        results = {f"/{output.name}": output.make(self._types, answer) for output in self._outputs}
        if self._input_topic:
            self._writer.write(self._input_topic, record.log_time, cdr(record))
        for topic, result in results.items():
            if result is not None:
                self._writer.write(topic, record.log_time, result)

    def describe(self, record: RunRecord) -> None:
        """Attach the record of the run."""
        if self._writer:
            self._writer.attach(RECORD_NAME, MEDIA_TYPE, record.to_json().encode())

    def __enter__(self) -> ReplayOutput:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._writer:
            self._writer.__exit__(kind, error, trace)
