"""Simulations without noise, and very many points: fits to micrometres, of which no verdict is no and no cause is given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from yielding_robot import PANDA_LIKE, TX90L_LIKE, UR_LIKE, YieldingRobot, write_robot

from flexcal import RobotModel, calibrate, read_poses
from flexcal.jobs.accuracy import verify

# sentences on what would be wrong
CAUSES = ("implausibly far", "do not go together", "not converged", "flank", "negative compliance")


def judged(folder: Path, seed: int, count: int, noise: float) -> tuple[str, str, list[str]]:
    """Verdicts on a calibration and its check at fresh poses, and remarks on causes."""
    rng = np.random.default_rng([47, seed])
    compliance = np.zeros((len(PANDA_LIKE), 3))
    compliance[:, 2] = 5e-5 * np.exp(rng.normal(0, 0.5, len(PANDA_LIKE)))
    robot = YieldingRobot(PANDA_LIKE, compliance, rng, noise)
    folder.mkdir(exist_ok=True)
    model = RobotModel.from_yaml(write_robot(folder, PANDA_LIKE), estimates=False)
    found = calibrate(model, read_poses(robot.write(folder / "poses.csv", count), model))
    fresh = read_poses(robot.write(folder / "fresh.csv", 60), found.model)
    told = [remark for remark in found.document()["remarks"] if any(cause in remark for cause in CAUSES)]
    return found.trust.status, verify(found.robot, fresh).trust.status, told


@pytest.mark.parametrize(("seed", "noise"), [(1, 0.0), (2, 1e-6)])
def test_a_thousand_points_of_a_simulation_are_trusted(tmp_path: Path, seed: int, noise: float) -> None:
    """Waves of a hundredth of a milliradian are significant then, and nothing is wrong."""
    calibrated, verified, told = judged(tmp_path, seed, 1000, noise)
    # of 60 poses errors are significantly larger than predicted once in forty times
    assert (calibrated, told) == ("good", []) and verified in ("good", "care")


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 1e-6, 5e-6, 2e-5])
@pytest.mark.parametrize("count", [300, 1000, 4000, 10_000])
def test_points_of_simulations_are_trusted(tmp_path: Path, count: int, noise: float) -> None:
    for seed in range(3, 7):
        calibrated, verified, told = judged(tmp_path, seed, count, noise)
        assert (calibrated, told) == ("good", []) and verified in ("good", "care"), seed


def test_few_points_of_soft_simulated_arms_are_met(tmp_path: Path) -> None:
    """To a tenth of a micrometre, where derivatives are not exact enough for a last step: nothing is wrong with data or robot."""
    for seed, count in ((1, 12), (2, 20), (6, 60), (9, 20)):
        rng, bodies = np.random.default_rng([48, seed]), (PANDA_LIKE, UR_LIKE, TX90L_LIKE)[seed % 3]
        compliance = np.zeros((len(bodies), 3))
        compliance[:, 2] = 3e-5 * 1.6 ** np.arange(len(bodies)) * np.exp(rng.normal(0, 0.4, len(bodies)))
        folder = tmp_path / str(seed)
        folder.mkdir()
        model = RobotModel.from_yaml(write_robot(folder, bodies), estimates=False)
        robot = YieldingRobot(bodies, compliance, rng, 0.0)
        found = calibrate(model, read_poses(robot.write(folder / "poses.csv", count), model))
        assert found.trust.status in ("good", "care"), (seed, found.trust.because)
        assert not any("not converged" in remark for remark in found.document()["remarks"])
