# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Results kept on disk: one file for each recording, set of parameters and version of the program."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from pathlib import Path
from typing import Any

from topo_region_seg.offline.evaluation.results import BagResult
from topo_region_seg.offline.evaluation.source import Source
from topo_region_seg.params import Params

Key = dict[str, Any]
"""Everything that a result depends on, except the machine's speed."""


def default_folder() -> Path:
    """Return the user's cache folder for this program, after the XDG base directory specification."""
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(base).expanduser() / "topo_region_seg" / "evaluation"


def key_of(content: str, truth_content: str, source: Source, params: Params, version: str) -> Key:
    """Return the key of a result; `content` and `truth_content` identify the recordings, whatever their names are."""
    return {
        "content": content,
        "topic": source.topic,
        "truth_content": truth_content,
        "truth_topic": source.truth_topic,
        "recorded": source.recorded,
        "reading": dataclasses.asdict(source.reading),
        "params": params.as_dict(),
        "version": version,
    }


class ResultCache:
    """Results in a folder, which is created for the first one."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def get(self, key: Key, bag: str) -> BagResult | None:
        """Return the result of `key`, with the current name of the recording; None if there is no readable one."""
        try:
            entry = json.loads(self._file(key).read_text(encoding="utf-8"))
            if entry["key"] != key:
                return None
            return BagResult.from_dict({**entry["result"], "bag": bag})
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def put(self, key: Key, result: BagResult) -> None:
        """Keep a result; its file is complete or absent.

        Raises
        ------
        OSError
            It cannot be written.
        """
        file = self._file(key)
        self.folder.mkdir(parents=True, exist_ok=True)
        temporary = file.with_name(f".{file.name}.{os.getpid()}.part")
        try:
            text = json.dumps({"key": key, "result": result.as_dict()}, allow_nan=False)
            temporary.write_text(text, encoding="utf-8")
            os.replace(temporary, file)
        finally:
            temporary.unlink(missing_ok=True)

    def _file(self, key: Key) -> Path:
        name = hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()
        return self.folder / f"{name}.json"
