"""The evaluator of the benchmark of trajectories, against Pinocchio's regressor and motions whose faults are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from benchmarks._judge import Judge
from benchmarks._random_trajectories import fourier_motion, random_trajectories
from flexcal.model.robot import RobotModel

TIME = np.arange(400) / 40


@pytest.fixture(scope="module")
def judge(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Judge:
    folder = tmp_path_factory.mktemp("judge")
    (folder / "robot.yaml").write_text(f"robot: {examples / 'tx90l' / 'tx90l.urdf'}\n")
    return Judge(RobotModel.from_yaml(folder / "robot.yaml"))


@pytest.fixture(scope="module")
def motion(judge: Judge) -> np.ndarray:
    drawn = next(random_trajectories(judge.model, 10.0, 5, np.random.default_rng(3)))
    return fourier_motion(*drawn, 10.0, TIME)


def _pinocchio(judge: Judge, motion: np.ndarray) -> np.ndarray:
    """All columns by Pinocchio, in flexcal's order."""
    model = pin.buildModelFromUrdf(str(judge.model.urdf))
    data = model.createData()
    links = [
        pin.computeJointTorqueRegressor(model, data, q, dq, ddq) for q, dq, ddq in motion.transpose(1, 0, 2)
    ]
    per_link = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]  # Pinocchio: Ixx Ixy Iyy Ixz Iyz Izz
    order = [10 * link + column for link in range(model.nv) for column in per_link]
    _, dq, ddq = motion
    drives = np.array([ddq, dq, np.sign(dq), np.ones_like(dq)])
    own = np.einsum("knj,ij->nikj", drives, np.eye(model.nv)).reshape(len(dq), model.nv, -1)
    return np.concatenate([np.array(links)[:, :, order], own], axis=2).reshape(-1, 14 * model.nv)


def test_condition_and_information_of_the_kept_columns_are_those_of_pinocchio(
    judge: Judge, motion: np.ndarray
) -> None:
    whole = _pinocchio(judge, motion)
    base = whole[:, list(judge.base.identifiability.kept)]
    condition, told = judge.merits(motion)
    assert condition == pytest.approx(np.linalg.cond(base / np.linalg.norm(base, axis=0)), rel=1e-8)
    assert told == pytest.approx(np.linalg.slogdet(base.T @ base / len(TIME))[1], abs=1e-6)


def test_the_kept_columns_are_a_basis(judge: Judge, motion: np.ndarray) -> None:
    whole = _pinocchio(judge, motion)
    base = whole[:, list(judge.base.identifiability.kept)]
    rest = whole - base @ np.linalg.lstsq(base, whole, rcond=None)[0]
    assert np.abs(rest).max() < 1e-9 * np.abs(whole).max()


def test_one_more_turn_of_the_same_tells_the_same_of_each_sample(judge: Judge, motion: np.ndarray) -> None:
    np.testing.assert_allclose(judge.merits(np.tile(motion, (1, 2, 1))), judge.merits(motion), rtol=1e-9)


def test_a_joint_that_stands_still_tells_nothing(judge: Judge, motion: np.ndarray) -> None:
    still = motion.copy()
    still[1:, :, 2] = 0.0
    assert judge.merits(still) == (np.inf, -np.inf)


def test_random_trajectories_keep_all_limits_and_touch_nothing_where_they_were_looked_at(
    judge: Judge,
) -> None:
    drawn = random_trajectories(judge.model, 10.0, 5, np.random.default_rng(1))
    for _, one in zip(range(20), drawn, strict=False):
        assert judge.violations(fourier_motion(*one, 10.0, TIME[::2])) == {}
        assert judge.violations(fourier_motion(*one, 10.0, TIME)).keys() <= {"itself", "floor"}


def test_fourier_motions_are_derivatives_of_each_other(motion: np.ndarray) -> None:
    for lower, upper in ((0, 1), (1, 2)):
        slope = np.fft.ifft(
            np.fft.fft(motion[lower], axis=0) * 2j * np.pi * np.fft.fftfreq(len(TIME), 1 / 40)[:, None],
            axis=0,
        )
        np.testing.assert_allclose(slope.real, motion[upper], atol=1e-9)


@pytest.mark.parametrize(("order", "broken"), [(0, "position"), (1, "velocity"), (2, "torque")])
def test_what_is_broken_is_named(judge: Judge, motion: np.ndarray, order: int, broken: str) -> None:
    wrong = motion.copy()
    wrong[order, 7, 1] = (2.6, -7.0, 100.0)[order]
    found = judge.violations(wrong)
    assert broken in found and found[broken] > 1
    assert set(found) <= {broken, "itself", "floor"}


def test_uses_and_touches_are_measured(judge: Judge, motion: np.ndarray) -> None:
    wrong = motion.copy()
    wrong[1, 3, 0] = 2 * judge.model.joints[0].velocity
    wrong[0] = 0.0
    wrong[0, :4] = np.array([0, 129, 144, 0, 0, 0]) * np.pi / 180  # folded onto itself
    wrong[0, 4:10] = np.array([0, 120, 0, 0, 0, 0]) * np.pi / 180  # below the floor
    expected = {"velocity": 2.0, "itself": 4 / len(TIME), "floor": 6 / len(TIME)}
    assert judge.violations(wrong) == pytest.approx(expected, rel=1e-12)
