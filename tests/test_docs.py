"""What the documentation says is what the program does."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from flexcal.dynamics.drive_gains import gain_name
from flexcal.elasticity import stage_one_parameters
from flexcal.frequency import FrequencyResponse
from flexcal.frequency.response import POOLED_LINES, SMALLEST_FREEDOM
from flexcal.model import RobotModel
from flexcal.model.names import unit_of

NUMBERS = {"nine": 9, "twelve": 12, "thirteen": 13, "fourteen": 14, "fifteen": 15}


@pytest.fixture(scope="module")
def methods(root: Path) -> str:
    return (root / "docs" / "methods.md").read_text(encoding="utf-8")


def documented(root: Path) -> dict[str, str]:
    """Unit of every name in the table of docs/file-formats.md, as a pattern."""
    text = (root / "docs" / "file-formats.md").read_text(encoding="utf-8")
    table = text[text.index("| name | unit |") : text.index("## robot.yaml")]
    found: dict[str, str] = {}
    for row in table.splitlines()[2:]:
        if row:
            _, names, unit, _ = (cell.strip() for cell in row.split("|"))
            found |= dict.fromkeys(re.findall(r"`([^`]+)`", names), unit)
    return found


def pattern(name: str) -> str:
    name = (
        re.escape(name)
        .replace("<joint>", r"joint_\d")
        .replace("<motor>", r"joint_\d")
        .replace("<link>", r"link_\d")
    )
    return name.replace("<name>", r"\w+").replace("<k>", r"\d+")


def produced(model: RobotModel) -> dict[str, str]:
    """Every name that the program gives a value on the TX90L, with its unit."""
    lines = 30
    response = FrequencyResponse(
        frequencies_hz=np.arange(1.0, lines + 1),
        response=np.tile(np.eye(3, dtype=complex), (lines, 1, 1)),
        covariance=np.tile(1e-6 * np.eye(9, dtype=complex), (lines, 1, 1)),
        noise_covariance=np.tile(1e-7 * np.eye(9, dtype=complex), (lines, 1, 1)),
        degrees_of_freedom=45.0,
        realisations=np.tile(np.eye(3, dtype=complex), (4, lines, 1, 1)),
        joints=("joint_1", "joint_2", "joint_3"),
        q_mean=np.zeros(6),
        payload=None,
        pose=0,
        sample_time=2.5e-4,
    )
    gains = [gain_name(joint) for joint in model.joint_names]
    names = {name: unit_of(name) for name in (*model.values, *gains)}
    return names | {item.name: item.unit for item in stage_one_parameters(model, [response], gaps=True)}


def test_every_name_is_in_the_table_with_its_unit(root: Path, tx90l: RobotModel) -> None:
    tx40 = RobotModel.from_yaml(root / "examples" / "tx40" / "robot.yaml", estimates=False)
    table, names = documented(root), {name: unit_of(name) for name in tx40.values} | produced(tx90l)
    for name, unit in names.items():
        units = [known for written, known in table.items() if re.fullmatch(pattern(written), name)]
        assert units == [unit], name
    for written in table:
        assert any(re.fullmatch(pattern(written), name) for name in names), written
    assert {"joint_1.viscous.pose_1", "joint_2.drive.half_gap", "payload.com_z"} <= set(names)


def test_the_gap_is_as_wide_as_it_says(methods: str, tx90l: RobotModel, rng: np.random.Generator) -> None:
    from flexcal.design import base_sensitivity, pose_sensitivity

    lower, upper = (np.array([getattr(joint, side) for joint in tx90l.joints]) for side in ("lower", "upper"))
    found = base_sensitivity(pose_sensitivity(tx90l, rng.uniform(lower, upper, (60, 6)))).identifiability
    assert found.rank == 29 and "rank is **29**" in methods
    said = re.search(r"(\w+) decades lie between the 29th", methods)
    assert said is not None and abs(found.gap - NUMBERS[said[1]]) < 1


def test_the_pooling_is_as_wide_as_it_says(methods: str) -> None:
    text = " ".join(methods.split())
    assert f"pooled over {POOLED_LINES} neighbouring lines ({3 * POOLED_LINES} degrees of freedom)" in text
    assert f"fewer than {SMALLEST_FREEDOM} are refused" in text


def test_the_page_on_the_command_line_has_every_verb(root: Path) -> None:
    from flexcal.cli.verbs import VERBS

    page = (root / "docs" / "command-line.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| `flexcal ")]
    assert rows == [f"| `{verb.example}` | {verb.summary} |" for verb in VERBS]
