# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameter file and the README's table say what the parameter tables say."""

from __future__ import annotations

import pytest
import yaml
from places import ROOT

from topo_region_seg.offline.parameter_docs import main, markdown_table, yaml_text
from topo_region_seg.params import Params
from topo_region_seg.ros.node_params import NodeParams

CONFIG = ROOT / "config" / "region_segmentation.yaml"
ROWS = (*Params.table(), *NodeParams.table())


def test_the_shipped_file_is_the_generated_one() -> None:
    assert CONFIG.read_text(encoding="utf-8") == yaml_text(), (
        "run: python -m topo_region_seg.offline.parameter_docs yaml"
    )


def test_the_file_holds_every_default_in_its_own_type() -> None:
    values = yaml.safe_load(yaml_text())["/**"]["ros__parameters"]
    expected = {row.name: list(row.default) if row.type is tuple else row.default for row in ROWS}
    assert values == expected
    assert {name: type(value) for name, value in values.items()} == {
        name: type(value) for name, value in expected.items()
    }, "ROS tells 1 from 1.0"


def test_the_table_has_a_row_for_every_parameter() -> None:
    lines = markdown_table().splitlines()
    assert [line.split("`")[1] for line in lines[2:]] == [row.name for row in ROWS]
    assert len({line.replace("\\|", "").count("|") for line in lines}) == 1, "as many cells in every row"


def test_no_parameter_is_in_both_tables() -> None:
    assert len({row.name for row in ROWS}) == len(ROWS)


def test_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["markdown"]) == 0
    assert capsys.readouterr().out == markdown_table()
    assert main([]) == 2
    assert capsys.readouterr().err.startswith("usage: ")
