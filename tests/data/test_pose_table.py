"""Plans of poses as CSV, and files that say where the robot will work."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.data.plans import MultisinePlan, PosePlan, read_plan, read_plan_of, write_plan
from flexcal.data.poses import read_working
from flexcal.model.robot import RobotModel


@pytest.mark.parametrize("payload", [None, np.array([0.0, 2.5, 6.0])])
def test_a_plan_comes_back_bit_by_bit(
    tmp_path: Path, rng: np.random.Generator, payload: np.ndarray | None
) -> None:
    plan = PosePlan(rng.normal(size=(3, 6)), payload, seed=4, name="calibration")
    write_plan(tmp_path / "poses.csv", plan)
    found = read_plan_of(tmp_path / "poses.csv", PosePlan)
    np.testing.assert_array_equal(found.q, plan.q)
    assert (found.payload is None) == (payload is None)
    if payload is not None:
        np.testing.assert_array_equal(found.payload, payload)
    assert found.name == "poses"
    assert (tmp_path / "poses.csv").read_text().startswith("pose,q1,q2,q3,q4,q5,q6")


WRONG = [
    ("pose,q1,q3\n1,0,0\n", ["E-PLAN-024", "line 1", "q2"]),
    ("pose,x\n1,0\n", ["E-PLAN-024", "line 1", "q1"]),
    ("pose,q1,speed\n1,0,2\n", ["E-PLAN-025", "speed"]),
    ("pose,q1\n1,a\n", ["E-TABLE-036", "2", "q1", "a"]),
    ("pose,q1,payload\n1,0,-2\n", ["E-PLAN-029", "-2"]),
]


@pytest.mark.parametrize(("text", "refusal"), WRONG)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, refusal: list[str]) -> None:
    (tmp_path / "p.csv").write_text(text)
    with refused(*refusal):
        read_plan(tmp_path / "p.csv")


def test_only_poses_can_be_csv(tmp_path: Path) -> None:
    plan = object.__new__(MultisinePlan)
    with refused("E-PLAN-023"):
        write_plan(tmp_path / "plan.csv", plan)
    assert not (tmp_path / "plan.csv").exists()


def test_working_points_and_working_poses(tmp_path: Path, tx90l: RobotModel) -> None:
    points, poses = tmp_path / "points.csv", tmp_path / "poses.csv"
    points.write_text("x,y,z\n0.5,0,0.4\n0.6,0.1,0.4\n")
    q, places = read_working(points, tx90l)
    assert q is None
    np.testing.assert_array_equal(places, [[0.5, 0, 0.4], [0.6, 0.1, 0.4]])
    poses.write_text("pose,q1,q2,q3,q4,q5,q6\n1,0,0.1,0.2,0,0,0\n")
    q, places = read_working(poses, tx90l)
    assert places is None
    np.testing.assert_array_equal(q, [[0, 0.1, 0.2, 0, 0, 0]])
    poses.write_text("pose,q1,q2,q3,q4,q5,q6\n1,0,2.9,0.2,0,0,0\n")
    with refused("E-TABLE-002", "line 2, column q2", "pose 1", "2.9", "joint_2"):
        read_working(poses, tx90l)
    points.write_text("target,x,y,z\nsmr,0.5,0,0.4\n")
    np.testing.assert_array_equal(read_working(points, tx90l)[1], [[0.5, 0, 0.4]])
    poses.write_text("pose,q1,q2,q3,q4,q5,q6,target,unambiguous\n1,0,0.1,0.2,0,0,0,smr,true\n")
    np.testing.assert_array_equal(read_working(poses, tx90l)[0], [[0, 0.1, 0.2, 0, 0, 0]])
    points.write_text("target,x,y,z\nsmr,0.5,0,0.4\nball,0.5,0,0.4\n")
    with refused("E-POSES-010", "line 3, column target", "ball"):
        read_working(points, tx90l)
    points.write_text("x,y,height\n0.5,0,0.4\n")
    with refused("E-TABLE-006", "pose"):
        read_working(points, tx90l)


def test_commands_are_a_plan_that_keeps_their_numbers(tmp_path: Path) -> None:
    commands = tmp_path / "commands.csv"
    commands.write_text(
        "pose,q1,target,unambiguous\n7,0.1,smr,true\n9,0.2,smr,false\n7,0.1,smr,true\n", "utf-8"
    )
    plan = read_plan(commands)
    assert isinstance(plan, PosePlan) and plan.numbers.tolist() == [7, 9, 7]
    for name in ("plan.yaml", "plan.csv"):
        write_plan(tmp_path / name, plan)
        again = read_plan(tmp_path / name)
        assert isinstance(again, PosePlan) and again.numbers.tolist() == [7, 9, 7]
        np.testing.assert_array_equal(again.q, plan.q)
    commands.write_text("pose,q1,target\n1,0.1,smr\n2,0.2,tcp\n", "utf-8")
    with refused("E-PLAN-026"):
        read_plan(commands)
    commands.write_text("pose,q1\n1.5,0.1\n", "utf-8")
    with refused("E-POSES-012", "line 2, column pose: 1.5"):
        read_plan(commands)
