"""Temperatures that a failing sensor gives are found, and those of an arm that changes fast are not."""

from __future__ import annotations

import numpy as np
import pytest
from dh_arm import DHArm, postures, tracked, write_robot
from thermal_arm import ThermalArm, warming, write_warm_poses

from flexcal.data.poses import PoseSet, read_poses
from flexcal.jobs.calibration.odd_temperatures import plausible_temperatures, with_plausible_temperatures
from flexcal.jobs.calibration.procedure import calibrate
from flexcal.model.robot import RobotModel
from flexcal.report.checks.temperature import check_instrument_change, check_temperature_sensor

N = 40


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    robot = write_robot(tmp_path_factory.mktemp("odd"))
    robot.write_text(robot.read_text().replace("[kinematic]", "[kinematic, thermal]"))
    return RobotModel.from_yaml(robot)


def measured(model: RobotModel, temperature: np.ndarray, true: np.ndarray | None = None) -> PoseSet:
    """Poses of an arm at the `true` temperatures, by default those its sensor says."""
    rng = np.random.default_rng(5)
    q = postures(rng, len(temperature))
    points = ThermalArm(DHArm.made(4)).points(q, temperature if true is None else true)
    seen = tracked(points, rng, 1e-5)
    return read_poses(write_warm_poses(model.path.parent / "p.csv", q, seen, 1e-5, temperature), model)


def mixed() -> np.ndarray:
    return np.random.default_rng(1).permutation(warming(np.linspace(0, 7200, N)))


@pytest.mark.parametrize(
    ("wrong", "value"), [([7, 20], 0.0), ([0], 99.0), ([11, 12, 13], 0.0), ([N - 1], -40.0)]
)
def test_a_sensor_that_fails(model: RobotModel, wrong: list[int], value: float) -> None:
    temperature = mixed()
    temperature[wrong] = value
    kept = plausible_temperatures(measured(model, temperature, mixed()))
    assert np.flatnonzero(~kept).tolist() == wrong


@pytest.mark.parametrize(
    "temperature",
    [
        mixed(),
        warming(np.linspace(0, 7200, N), rise=40.0),
        np.concatenate([15 + 0.1 * np.arange(5), 38 + 0.1 * np.arange(N - 5)]),
        np.repeat([20.0, 45.0], N // 2),
        np.full(N, 26.0),
    ],
    ids=["mixed", "warming", "a cold start", "two halls", "constant"],
)
def test_an_arm_that_changes(model: RobotModel, temperature: np.ndarray) -> None:
    assert plausible_temperatures(measured(model, temperature)).all()


def test_the_coefficient_is_found_without_the_wrong_rows(model: RobotModel) -> None:
    temperature = mixed()
    temperature[[7, 20]] = 0.0
    calibration = calibrate(model, measured(model, temperature, mixed()))
    assert calibration.model.value("thermal.expansion") == pytest.approx(15e-6, abs=3e-6)
    assert any("row 8, pose 7 (0.0 °C), row 21" in remark for remark in calibration.selected.poses.notes)
    assert len(calibration.selected.poses) == N - 2


def test_fahrenheit_is_named(model: RobotModel) -> None:
    poses = measured(model, 1.8 * mixed() + 32, mixed())
    noted = with_plausible_temperatures(poses, np.ones(N, bool)).notes
    assert any("Fahrenheit" in note for note in noted)
    assert not with_plausible_temperatures(measured(model, mixed()), np.ones(N, bool)).notes


def test_what_the_verdict_says_of_temperature() -> None:
    told = {"attenuation": 0.0, "sensor_std": None, "instrument_mm": 0.18}
    fit = {"sigma_given": True, "reduced_chi2": 2.8}
    assert check_instrument_change(told).status == "care"
    assert "0.18" in check_instrument_change(told).answer
    (unknown,) = check_temperature_sensor(told, fit)
    assert unknown.status == "care"
    assert not check_temperature_sensor(told, fit | {"reduced_chi2": 1.1})
    (known,) = check_temperature_sensor(told | {"attenuation": 0.3, "sensor_std": 2.0}, fit)
    assert known.status == "care" and "30%" in known.answer
