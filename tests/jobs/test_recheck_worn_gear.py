"""A gear that got play, found by a recheck, of an arm whose gravity moments are found by plain vectors; nothing of flexcal in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rechecked_arm import judged_beside
from yielding_robot import CARRIER, PANDA_LIKE, YieldingRobot, write_robot

from flexcal import CalibratedRobot, RobotModel, calibrate, read_poses
from flexcal.calibration.recheck import JudgedVisit
from flexcal.data.poses import PoseSet
from flexcal.jobs.recheck.judgement_words import judgement_sentence

NOISE = 2e-5


class WornRobot(YieldingRobot):
    """A rigid arm whose gears have `play` (n,), half of it, rad: the arm side lies where gravity presses it."""

    play = np.zeros(len(PANDA_LIKE))
    zeros = np.zeros(len(PANDA_LIKE))

    def point(self, q: np.ndarray) -> np.ndarray:
        none = np.zeros((len(self.bodies), 3))
        moments = self._moments(*self._frames(q + self.zeros, none))
        turns, origins = self._frames(q + self.zeros + self.play * np.sign(moments[:, 2]), none)
        return origins[CARRIER[self.bodies]] + turns[CARRIER[self.bodies]] @ self.reflector


@pytest.fixture(scope="module")
def worn(tmp_path_factory: pytest.TempPathFactory) -> tuple[WornRobot, CalibratedRobot, np.ndarray, Path]:
    folder = tmp_path_factory.mktemp("worn")
    robot = WornRobot(PANDA_LIKE, np.zeros((len(PANDA_LIKE), 3)), np.random.default_rng(6), noise=NOISE)
    model = RobotModel.from_yaml(write_robot(folder, PANDA_LIKE), estimates=False)
    calibrated = calibrate(
        model, read_poses([robot.write(folder / "poses.csv", 60)], model), terms=["kinematic"]
    )
    return robot, calibrated.robot, robot.measured(10)[0], folder


def _judged(worn: tuple[WornRobot, CalibratedRobot, np.ndarray, Path]) -> JudgedVisit:
    """A visit with the robot as it is now, against a reference before, each pose read three times."""
    robot, calibrated, q, folder = worn
    play, zeros = robot.play, robot.zeros
    robot.play = robot.zeros = np.zeros(len(q[0]))
    before = _read(robot, calibrated.model, np.repeat(q, 3, axis=0), folder)
    robot.play, robot.zeros = play, zeros
    now = _read(robot, calibrated.model, q, folder)
    return judged_beside(calibrated.model, now, before)


def _read(robot: WornRobot, model: RobotModel, q: np.ndarray, folder: Path) -> PoseSet:
    turn, place = robot.station
    seen = turn.apply([robot.point(row) for row in q]) + place
    seen += robot.rng.normal(0, NOISE, seen.shape)
    header = ",".join(["pose", *(f"q{i + 1}" for i in range(q.shape[1])), "x", "y", "z"])
    rows = np.column_stack([np.arange(len(q)), q, seen])
    np.savetxt(folder / "visit.csv", rows, delimiter=",", header=header, comments="")
    return read_poses([folder / "visit.csv"], model)


@pytest.mark.parametrize(("joint", "half"), [(1, 4e-4), (3, 3e-4)])
def test_play_is_named_and_neither_the_instrument_nor_a_payload(
    worn, monkeypatch: pytest.MonkeyPatch, joint: int, half: float
) -> None:
    monkeypatch.setattr(worn[0], "play", half * (np.arange(7) == joint))
    judged = _judged(worn)
    assert judged.scatter is None
    best = judged.suspects[0]
    assert (best.change.kind, best.change.subject) == ("gear_worn", f"a{joint + 1}")
    assert abs(best.estimate[0] - half) < 4 * best.std[0]
    assert "play in the gear" in judgement_sentence(judged)


def test_play_of_a_gear_that_gravity_hardly_loads_is_not_laid_on_the_instrument_alone(
    worn, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wrist, whose flanks these poses do not tell: the readings scatter, and what to look for includes play."""
    monkeypatch.setattr(worn[0], "play", 1.2e-3 * (np.arange(7) == 5))
    judged = _judged(worn)
    assert judged.scatter is not None
    assert "the robot for play in joints and tool" in judgement_sentence(judged)


def test_a_shifted_zero_is_no_play(worn, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worn[0], "zeros", 4e-4 * (np.arange(7) == 3))
    judged = _judged(worn)
    assert [(s.change.kind, s.change.subject) for s in judged.suspects] == [("joint_shifted", "a4")]
