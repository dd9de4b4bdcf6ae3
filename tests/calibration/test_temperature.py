"""Expansion and drift with temperature: derivatives, an arm at another temperature, and a robot that shares no code with flexcal."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm, postures, tracked, write_robot
from over_seeds import over_seeds
from refusals import refused
from thermal_arm import COLD, ThermalArm, cycling, sensed, warming, write_warm_poses

from flexcal import RobotModel, calibrate, read_poses, tool_at_rest
from flexcal.calibration.fit import geometric_parameters, sensor_scatter
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.jobs.calibration import Calibration
from flexcal.model.kinematics import at_temperature
from flexcal.model.robot import EXPANSION

GROWTH = 15e-6


def changing(model: RobotModel, rng: np.random.Generator) -> RobotModel:
    """A robot all of whose thermal parameters differ from zero."""
    values = {"thermal.reference": 25.0, EXPANSION: GROWTH}
    for joint in model.joints:
        values[f"{joint.link}.thermal_expansion"] = 4e-6 * rng.normal()
        values[f"{joint.name}.thermal_drift"] = 5e-6 * rng.normal()
    values |= {f"station.tracker.thermal_{key}": 5e-6 * rng.normal() for key in "xyz"}
    return model.with_values(values)


def test_columns_are_the_derivatives(simulate: Callable) -> None:
    rng = np.random.default_rng(1)
    simulated = simulate(3, 20)
    poses = replace(simulated.poses, temperature=rng.uniform(15, 40, 20))
    robot = changing(simulated.robot, rng)
    at = predict_measurements(robot, poses, jacobians=True)
    names = [name for name in robot.values if "thermal" in name and name != "thermal.reference"]
    names += ["joint_2.offset", "joint_3.length_z", "joint_1.misalignment_1"]
    jacobian = at.jacobian(names)
    for k, name in enumerate(names):
        step = 1e-5 if "thermal" not in name else 1e-6
        ends = [
            predict_measurements(
                robot.with_values({name: robot.value(name) + sign * step}), poses, flank=at.rest.flank
            ).position
            for sign in (1, -1)
        ]
        expected = (ends[0] - ends[1]) / (2 * step)
        # geometry moves what single links grow beyond the arm by a share of 1e-4, which its columns leave out
        assert np.abs(jacobian[:, :, k] - expected).max() <= 3e-4 * np.abs(expected).max(), name


def test_the_robot_at_another_temperature(tx90l: RobotModel) -> None:
    """Its lengths and zeros alone say what the thermal parameters do."""
    rng = np.random.default_rng(2)
    robot = changing(tx90l.with_values({"joint_2.length_x": 1e-3, "tool.length_z": 2e-3}), rng)
    q = rng.uniform(-1, 1, (30, 6))
    target = np.full(30, robot.point().name)
    warm = tool_at_rest(robot, q, None, target, temperature=np.full(30, 40.0)).kinematics.position
    held = tool_at_rest(at_temperature(robot, 40.0), q, None, target).kinematics.position
    cold = tool_at_rest(robot, q, None, target).kinematics.position
    assert np.linalg.norm(warm - cold, axis=1).mean() > 1e-4
    assert np.abs(warm - held).max() < 1e-6


def test_a_uniform_arm_grows_about_its_base(tx90l: RobotModel) -> None:
    robot = tx90l.without_springs().with_values({"thermal.reference": 20.0, EXPANSION: GROWTH})
    q, target = np.random.default_rng(3).uniform(-1, 1, (5, 6)), np.full(5, robot.point().name)
    cold = tool_at_rest(robot, q, None, target).kinematics.position
    warm = tool_at_rest(robot, q, None, target, temperature=np.full(5, 32.0)).kinematics.position
    np.testing.assert_allclose(warm, cold * (1 + 12 * GROWTH), rtol=1e-12)


def warmed(
    seed: int,
    folder: Path,
    *,
    count: int = 60,
    growth: float = GROWTH,
    rise: float = 12.0,
    profile: Callable = cycling,
    noise: float = 0.3,
    lag: float = 0.0,
    gradient: np.ndarray | None = None,
    sigma: float = 2.5e-5,
    eccentric: float = 0.0,
) -> tuple[RobotModel, PoseSet, PoseSet]:
    """A file of poses of an arm that warms up, and the exact points of others, before the same tracker; both are below `folder`.

    Gears are `eccentric` by so many rad.
    """
    rng = np.random.default_rng(seed)
    arm = ThermalArm(
        DHArm.made(seed), np.full(6, growth), gradient=np.ones(6) if gradient is None else gradient
    )
    robot = write_robot(folder)
    robot.write_text(robot.read_text().replace("[kinematic]", "auto"))
    model = RobotModel.from_yaml(robot, estimates=False)
    time, q, others = np.linspace(0, 10800, count), postures(rng, count), postures(rng, 100)
    temperature, other = profile(time, rise), COLD + rise * rng.uniform(size=100)
    turned = np.concatenate([q, others])
    turned = turned + eccentric * np.sin(turned + np.arange(6))
    every = tracked(arm.points(turned, np.concatenate([temperature, other])), rng, 0.0)
    seen = every[:count] + sigma * rng.normal(size=(count, 3))
    read = sensed(time, temperature, rng, noise=noise, lag=lag)
    files = (
        write_warm_poses(folder / "poses.csv", q, seen, sigma, read, time),
        write_warm_poses(folder / "others.csv", others, every[count:], sigma, other),
    )
    poses, unseen = (read_poses(file, model) for file in files)
    return model, poses, unseen


@pytest.fixture
def measured(tmp_path: Path) -> Callable:
    """measured(seed, …): `warmed` in a folder of its own."""
    return lambda seed, **options: warmed(seed, tmp_path, **options)


def p90(model: RobotModel, unseen: PoseSet) -> float:
    """90 % quantile of the errors at poses outside the fit, m."""
    away = unseen.position - predict_measurements(model, unseen).position
    return float(np.quantile(np.linalg.norm(away, axis=1), 0.9))


def expansion(calibration: Calibration) -> tuple[float, float]:
    interval = calibration.estimate.interval(EXPANSION)
    assert interval is not None
    return interval


def test_an_arm_that_warms_by_12_kelvin_is_as_accurate_as_one_at_rest(measured: Callable) -> None:
    """Selected by itself from a column `temperature`; without it errors are a multiple."""
    model, poses, unseen = measured(21)
    calibration = calibrate(model, poses)
    assert "thermal" in calibration.selected.terms
    low, high = expansion(calibration)
    assert low < GROWTH < high and high - low < 0.5 * GROWTH
    without = calibrate(model, replace(poses, temperature=None))
    still = p90(
        calibrate(*measured(21, rise=1e-9)[:2], terms=["kinematic"]).model, measured(21, rise=1e-9)[2]
    )
    assert p90(calibration.model, unseen) < 1.2 * still
    assert p90(without.model, replace(unseen, temperature=None)) > 2 * still


def test_links_that_warm_up_differently_are_no_drift_of_the_instrument(measured: Callable) -> None:
    """A base column that grows looks like an instrument that sinks; an instrument that drifts sideways is no arm's."""
    warm = np.array([1.0, 0.8, 0.6, 0.3, 0.1, 0.0])
    model, poses, unseen = measured(31, gradient=warm)
    calibration = calibrate(model, poses)
    assert "thermal_links" in calibration.selected.terms
    assert "thermal_stations" not in calibration.selected.terms
    still = p90(
        calibrate(*measured(31, rise=1e-9)[:2], terms=["kinematic"]).model, measured(31, rise=1e-9)[2]
    )
    assert p90(calibration.model, unseen) < 1.2 * still
    model, poses, _ = measured(34, growth=0.0)
    assert poses.temperature is not None
    aside = np.outer(poses.temperature - COLD, [2e-5, 0.0, 0.0])
    terms = calibrate(model, replace(poses, position=poses.position + aside)).selected.terms
    assert "thermal_stations" in terms and "thermal_links" not in terms


def test_time_widens_the_interval_of_an_arm_that_only_warms_up(measured: Callable) -> None:
    model, poses, _ = measured(22, profile=warming)
    calibration = calibrate(model, poses, terms=["kinematic", "thermal"])
    told = calibration.selected.temperature
    assert told is not None and told.confounded and told.correlation > 0.8
    assert told.wide[EXPANSION] > 1.5 * told.narrow[EXPANSION]
    assert calibration.estimate.std(EXPANSION) == pytest.approx(told.wide[EXPANSION])
    assert any("temperature and time go together" in remark for remark in calibration.document()["remarks"])


def test_a_column_that_hardly_varies_is_not_used(measured: Callable) -> None:
    model, poses, _ = measured(23, rise=0.4, noise=0.02)
    calibration = calibrate(model, poses)
    assert calibration.selected.temperature is None and calibration.selection is not None
    (row,) = [row for row in calibration.selection.considered if row.term == "thermal"]
    assert not row.taken and "0.4" in row.reason
    still = replace(poses, temperature=np.full(len(poses), 23.0))
    with refused("E-CAL-034", "thermal"):
        geometric_parameters(model, still, ["thermal"])


def test_errors_that_other_terms_explain_do_not_hide_an_expansion(measured: Callable) -> None:
    """Eccentric gears scatter the points of the plain geometry by ten times the noise, as gravity does."""
    model, poses, _ = measured(24, rise=8.0, eccentric=2e-3)
    calibration = calibrate(model, poses)
    assert "thermal" in calibration.selected.terms, str(calibration.selection)
    low, high = expansion(calibration)
    assert low < GROWTH < high and high - low < GROWTH


def test_the_scatter_of_a_sensor_is_told_where_temperature_is_smooth(measured: Callable) -> None:
    _, poses, _ = measured(24, count=200)
    assert sensor_scatter(poses) == pytest.approx(0.3, rel=0.25)
    shuffled = np.random.default_rng(0).permutation(len(poses))
    assert sensor_scatter(replace(poses, temperature=poses.temperature[shuffled], time=None)) is None


def coefficient_inside(seed: int, folder: Path) -> bool:
    """Whether the interval of the coefficient of one arm holds the truth."""
    (folder := folder / str(seed)).mkdir()
    model, poses, _ = warmed(seed, folder)
    low, high = expansion(calibrate(model, poses, terms=["kinematic", "thermal", "transmission"]))
    return low < GROWTH < high


@pytest.mark.slow
def test_intervals_of_the_coefficient_cover(tmp_path: Path) -> None:
    assert 0.88 <= np.mean(over_seeds(coefficient_inside, range(100, 180), tmp_path)) <= 0.99


def gets_a_thermal_term(seed: int, folder: Path) -> bool:
    """Whether an arm without expansion is given a thermal term."""
    (folder := folder / str(seed)).mkdir()
    model, poses, _ = warmed(seed, folder, growth=0.0)
    return any("thermal" in term for term in calibrate(model, poses).selected.terms)


@pytest.mark.slow
def test_an_arm_without_expansion_hardly_ever_gets_a_term(tmp_path: Path) -> None:
    """With a column that varies by 12 K and no effect."""
    assert sum(over_seeds(gets_a_thermal_term, range(300, 330), tmp_path)) <= 3


def test_an_expansion_of_no_material_is_said(measured: Callable) -> None:
    """As of a sensor that warms up by a third of what the arm does."""
    model, poses, _ = measured(25)
    assert poses.temperature is not None
    third = replace(poses, temperature=COLD + (poses.temperature - COLD) / 3)
    remarks = calibrate(model, third, terms=["kinematic", "thermal"]).document()["remarks"]
    assert any("which no arm's material does" in remark for remark in remarks)
    cold_hall = replace(poses, temperature=1.8 * (poses.temperature - COLD) + 35.0)
    remarks = calibrate(model, cold_hall, terms=["kinematic", "thermal"]).document()["remarks"]
    assert any("less than cast iron or steel does: if the column is in Fahrenheit" in r for r in remarks)
    plain = calibrate(model, poses, terms=["kinematic", "thermal"]).document()["remarks"]
    assert not any("Fahrenheit" in remark for remark in plain)
    assert any("per kelvin" in remark for remark in plain) and not any("material" in r for r in plain)
