"""Several reflectors in one pose: they share the robot's scatter, so they count as one pose. Arms of another's making."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from stranger_arm import SIX, StrangerArm

from flexcal.calibration.fit import GeometricFit, fit_geometry
from flexcal.calibration.verification import error_scale, prediction_errors, prediction_errors_with_covariance
from flexcal.data.poses import read_poses
from flexcal.model.robot import RobotModel

REFLECTORS = {"smr": (0.05, 0.03, 0.08), "left": (-0.06, 0.05, 0.07), "right": (0.02, -0.07, 0.1)}
TRUE = {"smr": (0.054, 0.027, 0.0833), "left": (-0.061, 0.051, 0.0695), "right": (0.021, -0.0702, 0.1005)}
POSES, TRACKER, ROBOT = 40, 1.5e-5, 6e-5


def robot_with_reflectors(folder: Path, seed: int) -> StrangerArm:
    """robot.yaml of an arm with three reflectors in `folder`."""
    arm = StrangerArm(seed, axes=tuple(SIX))
    robot = arm.write(folder)
    listed = "".join(f"  {name}: {{frame: tool0, xyz: {list(xyz)}}}\n" for name, xyz in REFLECTORS.items())
    robot.write_text(f"robot: arm.urdf\npoints:\n{listed}geometry: {{terms: [kinematic]}}\n")
    return arm


def write_reflectors(
    path: Path, arm: StrangerArm, q: np.ndarray, rng: np.random.Generator, kind: str
) -> Path:
    """Every reflector in every pose: the arm is off by ROBOT at all of them together, the tracker at each of them."""
    moved = q + (6e-5 * rng.normal(size=q.shape) if kind == "joints" else 0.0)
    common = ROBOT * rng.normal(size=(len(q), 3)) if kind == "common" else np.zeros((len(q), 3))
    lines = ["pose,target,q1,q2,q3,q4,q5,q6,x,y,z,sigma"]
    for name, xyz in TRUE.items():
        alone = ROBOT * rng.normal(size=(len(q), 3)) if kind == "alone" else 0.0
        seen = arm.measured(moved, rng, TRACKER, xyz=xyz) + common + alone
        for k, (row, point) in enumerate(zip(q, seen, strict=True)):
            numbers = ",".join(repr(float(v)) for v in (*row, *point, TRACKER))
            lines.append(f"{k},{name},{numbers}")
    path.write_text("\n".join(lines) + "\n")
    return path


Calibrated = Callable[[int, str], tuple[GeometricFit, float]]


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Calibrated:
    """The calibration of a seed and a kind of scatter, made once; and its mean square as of `calibration_of`."""
    return cache(lambda seed, kind: calibration_of(tmp_path_factory.mktemp("arm"), seed, kind))


def calibration_of(folder: Path, seed: int, kind: str) -> tuple[GeometricFit, float]:
    """A calibration, and the mean square of its standardised errors at fresh poses without noise."""
    arm = robot_with_reflectors(folder, seed)
    rng = np.random.default_rng([seed, 2])
    model = RobotModel.from_yaml(folder / "robot.yaml")
    file = write_reflectors(folder / "poses.csv", arm, arm.postures(POSES, rng), rng, kind)
    found = fit_geometry(model, read_poses(file, model), terms=("kinematic",))
    q = arm.postures(60, rng)
    fresh = read_poses(
        arm.write_poses(folder / "fresh.csv", q, arm.measured(q, rng, 0.0, xyz=TRUE["smr"])), model
    )
    seen = prediction_errors(found.model, fresh, noise_free=True)
    return found, float(np.mean((seen.errors**2).sum(axis=1) / seen.parameter_rms**2))


@pytest.mark.parametrize("kind", ["common", "joints", "alone"])
@pytest.mark.parametrize(
    ("arms", "low", "high"), [(2, 0.4, 2.0), pytest.param(10, 0.7, 1.4, marks=pytest.mark.slow)]
)
def test_intervals_hold_with_several_reflectors(
    calibrated: Calibrated, kind: str, arms: int, low: float, high: float
) -> None:
    """Where the scatter is common to a pose, and where it is not, as of reflectors that were measured one after the other."""
    squares = [calibrated(seed, kind)[1] for seed in range(arms)]
    assert low < np.mean(squares) < high


@pytest.mark.parametrize("kind", ["common", "joints", "alone"])
@pytest.mark.parametrize(("arms", "least"), [(2, 2), pytest.param(20, 17, marks=pytest.mark.slow)])
def test_verification_counts_poses_rather_than_points(
    calibrated: Calibrated, tmp_path: Path, kind: str, arms: int, least: int
) -> None:
    """Observed over predicted errors of 15 fresh poses with three reflectors: their 95 % intervals have 1 in them."""
    covered, freedom = [], []
    for seed in range(arms):
        found, _ = calibrated(seed, kind)
        rng = np.random.default_rng([seed, 9])
        arm = robot_with_reflectors(tmp_path, seed)
        file = write_reflectors(tmp_path / "fresh.csv", arm, arm.postures(15, rng), rng, kind)
        scale = error_scale(*prediction_errors_with_covariance(found.model, read_poses(file, found.model)))
        covered.append(scale.ratio_low < 1 < scale.ratio_high)
        freedom.append(scale.freedom)
    assert sum(covered) >= least
    assert (np.mean(freedom) < 60) == (kind != "alone")


def test_the_common_scatter_is_found(calibrated: Calibrated) -> None:
    common, alone = (calibrated(20, kind)[0] for kind in ("common", "alone"))
    assert common.scatter.pose == pytest.approx(ROBOT, rel=0.15) and common.scatter.robot < 5e-6
    assert alone.scatter.robot == pytest.approx(ROBOT, rel=0.15) and alone.scatter.pose == 0
    for found in (common, alone):
        assert found.variances["robot_mm"] == pytest.approx(ROBOT * 1e3, rel=0.15)
        low, high = found.estimate.interval("scatter.robot")  # type: ignore[misc]
        assert low < ROBOT < high
