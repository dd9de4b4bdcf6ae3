"""Rows of an instrument that was moved: the station that they get, in the table and in robot.yaml."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from waiting import until

from flexcal import RobotModel, read_poses
from flexcal.studio.project import Choices, Project
from flexcal.studio.steps.measure.measuring import Measuring

EXAMPLE = Path(__file__).parents[2] / "examples" / "tx90l"
MOVED = 14


@pytest.fixture(scope="module")
def lines() -> list[dict[str, str]]:
    """Rows of the virtual cell, without noise stated; the instrument is moved by 3 mm, and turned, before the row `MOVED`."""
    from flexcal import PosePlan, VirtualCell
    from flexcal.design.poses import random_candidates
    from flexcal.design.scene import CollisionChecker, MeasuringSetup
    from flexcal.virtual_cell import CellConfig

    model = RobotModel.from_yaml(EXAMPLE / "robot.yaml", estimates=False)
    checker = CollisionChecker(model)
    q = random_candidates(checker, 30, np.random.default_rng(2), MeasuringSetup.declared(model, None, None))
    measured = VirtualCell.drawn(model, CellConfig(), 1)[0].measure(PosePlan(q=q))
    turn = 1e-3 * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]])
    points = measured.position.copy()
    points[MOVED:] += points[MOVED:] @ turn.T + [0.003, -0.001, 0.0005]
    return [
        {"pose": str(k + 1)}
        | {f"q{i + 1}": repr(float(v)) for i, v in enumerate(q[k])}
        | dict(zip("xyz", map(repr, points[k].tolist()), strict=True))
        for k in range(len(q))
    ]


@pytest.fixture
def measuring(tmp_path: Path) -> Measuring:
    for name in ("robot.yaml", "tx90l.urdf"):
        shutil.copy(EXAMPLE / name, tmp_path / name)
    robot = tmp_path / "robot.yaml"
    robot.write_text(
        "\n".join(one for one in robot.read_text().splitlines() if not one.startswith("stations:")) + "\n"
    )
    model: list[tuple[bytes, RobotModel]] = []

    def read() -> RobotModel:
        now = robot.read_bytes()
        if not model or model[0][0] != now:
            model[:] = [(now, RobotModel.from_yaml(robot, estimates=False))]
        return model[0][1]

    answers: list[object] = []
    project = Project.open(tmp_path)
    made = Measuring(project, Choices.read(tmp_path), read, answers.append)
    made.answers = answers  # pyright: ignore[reportAttributeAccessIssue]
    made.load()
    return made


def wait(measuring: Measuring, condition: Callable[[], bool]) -> None:
    """Hand over the answers until a condition holds."""

    def holds() -> bool:
        for answer in list(measuring.answers):  # pyright: ignore[reportAttributeAccessIssue]
            measuring.answered(answer)
        return condition()

    until(holds)


def test_a_new_station_from_the_row_on_before_which_the_tracker_moved(
    measuring: Measuring, lines: list[dict[str, str]]
) -> None:
    measuring.take(lines[:24])
    wait(measuring, lambda: measuring.outlook is not None)
    assert measuring.moved == MOVED
    robot_file = measuring.project.robot_file
    assert measuring.move_station(MOVED) == "tracker2" == measuring.station
    # the verbs read what was written: both stations are known to robot.yaml
    model = RobotModel.from_yaml(robot_file, estimates=False)
    assert model.stations.names == ("tracker", "tracker2")
    table = read_poses(measuring.series.table.path, model)
    assert table.station.tolist() == ["tracker"] * MOVED + ["tracker2"] * (24 - MOVED)
    # a row without a station is of the present one, and is judged with it
    assert measuring.take(lines[24:]) == []
    wait(measuring, lambda: measuring.outlook is not None)
    assert set(measuring.series.poses.station[24:]) == {"tracker2"}  # pyright: ignore[reportOptionalMemberAccess]
    assert measuring.moved is None and not measuring.findings
    assert all(one.is_good for one in measuring.judgements.values())
    for _ in range(2):
        assert measuring.undo() is not None
    assert "station" not in measuring.series.table.columns and measuring.station == "tracker"
    assert measuring.move_station(20) == "tracker2"


def test_a_row_of_a_station_that_robot_yaml_lacks(measuring: Measuring, lines: list[dict[str, str]]) -> None:
    measuring.take(lines[:3])
    assert measuring.take([{**lines[3], "station": "tracker"}]) == []
    assert "station" not in measuring.series.table.columns
    assert measuring.take([{**lines[4], "station": "by the door"}]) == ["by the door"]
    assert RobotModel.from_yaml(measuring.project.robot_file).stations.names == ("tracker", "by the door")
    assert [row.cells["station"] for row in measuring.series.rows] == ["tracker"] * 4 + ["by the door"]
    measuring.take(lines[5:6])
    assert measuring.series.rows[-1].cells["station"] == "by the door"
