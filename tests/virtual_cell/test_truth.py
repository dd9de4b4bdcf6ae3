"""The file of a truth: the form of estimates.yaml, written and read, and what a user may hand over."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.files.formats import read_yaml
from flexcal.files.formats.estimates_file import StoredEstimates
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell import SpreadConfig, draw_truth, read_truth, read_truth_of, write_truth


def test_what_is_written_is_read_and_has_the_form_of_estimates(
    tx90l: RobotModel, rng: np.random.Generator, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    values = draw_truth(tx90l, SpreadConfig(), rng)
    write_truth(tmp_path / "truth.yaml", values)
    assert read_truth(tmp_path / "truth.yaml") == values == read_truth_of(tmp_path / "truth.yaml", tx90l)
    stored = read_yaml(tmp_path / "truth.yaml", StoredEstimates)
    assert stored.stiffness is not None and stored.calibration is not None and stored.dynamics is not None
    assert stored.stiffness.values["joint_1.drive.stiffness"].unit == "N m/rad"
    assert "joint_2.backlash" in stored.calibration.values and "link_1.mass" in stored.dynamics.values
    assert caplog.text == ""


@pytest.mark.parametrize(
    "text",
    [
        "joint_1.offset: 1e-3\n",
        "joint_1.offset: {estimate: 1e-3, unit: rad}\n",
        "calibration: {values: {joint_1.offset: 1e-3}}\n",
        "calibration:\n  values:\n    joint_1.offset: {estimate: 1e-3, std: 1e-5}\n  provenance: {program: x}\n",
        "stiffness: {values: {joint_1.offset: 2, joint_1.viscous.pose_1: 4}}\n"
        "calibration: {values: {joint_1.offset: 1e-3}}\n",
    ],
)
def test_forms(text: str, tx90l: RobotModel, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "truth.yaml").write_text(text)
    assert read_truth(tmp_path / "truth.yaml") == {"joint_1.offset": 1e-3}
    with caplog.at_level(logging.WARNING):
        found = read_truth_of(tmp_path / "truth.yaml", tx90l)
    drawn = draw_truth(tx90l, SpreadConfig(), np.random.default_rng(0))
    assert found == {name: tx90l.value(name) for name in drawn} | {"joint_1.offset": 1e-3}
    (message,) = caplog.messages
    assert "truth.yaml: 'link_1.mass'" in message and f"and {len(drawn) - 2} others are missing" in message


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ("a:\n  values:\n    joint_1.offset: much\n", ["E-CELL-034", "line 3", "joint_1.offset"]),
        ("a:\n  values:\n    joint_1.offset: {estimate: .nan}\n", ["E-CELL-034", "line 3"]),
        ("a:\n  values:\n    joint_1.offset: {std: 1}\n", ["E-CELL-034", "line 3"]),
        ("joint_1.offset: true\n", ["E-CELL-034", "line 1"]),
        ("a: {joint_1.offset: 1}\n", ["E-CELL-033", "line 1", "a"]),
        ("[1, 2]\n", ["E-CELL-032", "line 1"]),
        ("\njoint_1.ofset: 1\n", ["E-CELL-030", "line 2", "joint_1.ofset", "joint_1.offset"]),
        ("a:\n  values:\n    link_9.mass: 1\n", ["E-CELL-030", "line 3", "link_9.mass"]),
        ("joint_1.drive.stiffness: -1\n", ["E-CELL-031", "line 1"]),
        ("joint_2.backlash: -1e-5\n", ["E-CELL-031", "line 1"]),
    ],
)
def test_what_is_refused(text: str, refusal: list[str], tx90l: RobotModel, tmp_path: Path) -> None:
    (tmp_path / "truth.yaml").write_text(text)
    code, *names = refusal
    with refused(code, "truth.yaml", *names):
        read_truth_of(tmp_path / "truth.yaml", tx90l)
