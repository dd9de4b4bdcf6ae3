"""Inertials from trajectories with CAD as the prior: recovery, truthful covariance under coloured noise and on the virtual cell."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import repeat

import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import refused

from flexcal.data.plans import FourierPaths, TrajectoryPlan
from flexcal.data.recordings import Recording
from flexcal.dynamics.inertials import fit_inertials, relative_torque_error, trajectory_torques
from flexcal.estimation import Estimate
from flexcal.jobs.experiments import exciting_plan
from flexcal.model.robot import RobotModel
from flexcal.model.robot.drive_config import PriorConfig
from flexcal.model.torques import inertial_parameters, torque_regressor
from flexcal.model.vibration import periodic_torque
from flexcal.virtual_cell import CellConfig, VirtualCell, draw_truth


@pytest.fixture(scope="module")
def plan(tx90l: RobotModel) -> TrajectoryPlan:
    """Two trajectories, sampled slowly: synthetic torques need no controller."""
    designed = exciting_plan(tx90l, count=2, seed=1)
    return replace(designed, rate_hz=400.0, torque="instantaneous")


@pytest.fixture(scope="module")
def single(plan: TrajectoryPlan) -> TrajectoryPlan:
    """The first of them."""
    return replace(plan, paths=FourierPaths.of_coefficients(plan.paths.coefficients[:1]))


def drawn(model: RobotModel, rng: np.random.Generator) -> RobotModel:
    """A true robot as far from CAD, nominal springs, nominal geometry and torque constants as declared; friction changes by a tenth."""
    values = draw_truth(model, CellConfig().spread, rng)
    values = {n: v for n, v in values.items() if not n.endswith((".backlash", ".damping"))}
    robot = model.with_values(values)
    return replace(
        robot,
        drives=replace(
            robot.drives,
            viscous=model.drives.viscous * rng.uniform(0.9, 1.1, model.n),
            coulomb=model.drives.coulomb * 1.1,
            drive_gain=np.exp(model.prior.torque_constant * rng.standard_normal(model.n)),
        ),
    )


def reshaped(robot: RobotModel, rng: np.random.Generator) -> RobotModel:
    """A robot whose links have other shapes than in CAD: principal second moments off by 15 %, masses and centres of mass as before."""
    tensors = []
    for tensor in robot.links.inertia:
        moments, axes = np.linalg.eigh(np.trace(tensor) / 2 * np.eye(3) - tensor)
        moments = np.maximum(moments, 1e-3 * moments.max()) * np.exp(0.15 * rng.standard_normal(3))
        tensors.append(np.sum(moments) * np.eye(3) - axes @ np.diag(moments) @ axes.T)
    return replace(robot, links=replace(robot.links, inertia=np.array(tensors)))


def with_known_constants(model: RobotModel) -> RobotModel:
    """The robot with torques that are those measured, and links of CAD's shapes."""
    prior = replace(model.config.prior, torque_constant=0.0, inertia=0.0)
    return replace(model, config=replace(model.config, prior=prior))


STILL = repeat(np.zeros((1, 6)))
"""No noise in any recording."""


def synthetic(truth: RobotModel, plan: TrajectoryPlan, noises: Iterable[np.ndarray]) -> Iterator[Recording]:
    """Recordings of a true robot that follows the plan exactly; each has the next of `noises` (samples, n) N m on its torques."""
    size = plan.samples_per_period
    for number, noise in zip(range(len(plan)), noises, strict=False):
        q, dq, ddq = plan.motion(number, np.arange(size) / plan.rate_hz)
        torque = periodic_torque(truth, q, dq, ddq, 1 / plan.base_frequency_hz, 0.0)
        torque += (
            truth.drives.rotor_inertia * ddq + truth.drives.viscous * dq + truth.drives.coulomb * np.sign(dq)
        )
        yield Recording(
            time_step=1 / plan.rate_hz,
            q=np.tile(q, (plan.periods, 1)),
            torque=np.tile(torque / truth.drives.drive_gain, (plan.periods, 1)) + noise,
        )


def coloured(plan: TrajectoryPlan, rng: np.random.Generator) -> Iterator[np.ndarray]:
    """Noise (samples, n) of 0.3 N m that holds for a fifth of a second, for every recording its own."""
    from scipy.signal import lfilter

    decay = np.exp(-5.0 / plan.rate_hz)
    while True:
        white = rng.standard_normal((plan.periods * plan.samples_per_period + 1000, plan.joint_count))
        yield 0.3 * np.sqrt(1 - decay**2) * lfilter([1.0], [1.0, -decay], white, axis=0)[1000:]


def errors(estimate: Estimate, truth: RobotModel) -> tuple[np.ndarray, float]:
    """Every error over its standard deviation, and the mean square of all errors together, decorrelated."""
    names = estimate.parameters.names
    should = estimate.parameters.coordinates({name: truth.value(name) for name in names})
    error = estimate.parameters.coordinates() - should
    together = float(error @ np.linalg.solve(estimate.covariance, error)) / len(error)
    return error / np.sqrt(np.diag(estimate.covariance)), together


def test_without_noise_the_torques_of_the_robot_come_back(tx90l: RobotModel, single: TrajectoryPlan) -> None:
    """Single masses stay as uncertain as CAD; what turns the motors, on motions never recorded, does not."""
    rng, tx90l = np.random.default_rng(5), with_known_constants(tx90l)
    truth = drawn(tx90l, rng)
    truth = replace(
        truth,
        geometry=replace(truth.geometry, errors=tx90l.geometry.errors),
        springs=replace(truth.springs, stiffness=tx90l.springs.stiffness),
    )
    found = tx90l.with_estimate(fit_inertials(tx90l, single, synthetic(truth, single, STILL)))
    q, dq, ddq = rng.uniform(-1, 1, (3, 50, 6)) * np.array([2.0, 2.0, 5.0])[:, None, None]

    def torque(robot: RobotModel) -> np.ndarray:
        rows = torque_regressor(
            replace(robot, geometry=replace(robot.geometry, errors=tx90l.geometry.errors)), q, dq, ddq
        ) @ inertial_parameters(robot)
        return rows + robot.drives.rotor_inertia * ddq

    scale = np.linalg.norm(torque(truth), axis=0)
    before = np.linalg.norm(torque(tx90l) - torque(truth), axis=0) / scale
    after = np.linalg.norm(torque(found) - torque(truth), axis=0) / scale
    assert (before > 0.02).all()
    assert (after < 0.05 * before).all()
    np.testing.assert_allclose(found.drives.viscous, truth.drives.viscous, rtol=1e-3)
    np.testing.assert_allclose(found.drives.coulomb, truth.drives.coulomb, rtol=1e-3)


def test_what_torques_miss(tx90l: RobotModel, single: TrajectoryPlan) -> None:
    """Nothing with the true robot; with rotors that are a tenth too large, a tenth of what they need: the lines up to 5 Hz hold it all."""
    truth = drawn(tx90l, np.random.default_rng(8))
    recordings = list(synthetic(truth, single, STILL))
    assert relative_torque_error(trajectory_torques(truth, single, recordings)) < 1e-6
    heavier = replace(truth, drives=replace(truth.drives, rotor_inertia=1.1 * truth.drives.rotor_inertia))
    size = single.samples_per_period
    acceleration = single.motion(0, np.arange(size) / single.rate_hz)[2]
    spectrum = np.fft.rfft(recordings[0].torque[:size], axis=0)[:26] / size
    spectrum[1:] *= np.sqrt(2.0)
    missed = 0.1 * truth.drives.rotor_inertia * acceleration / truth.drives.drive_gain
    missed = np.linalg.norm(missed) / np.sqrt(size)
    expected = missed / np.linalg.norm(spectrum)
    assert relative_torque_error(trajectory_torques(heavier, single, recordings)) == pytest.approx(
        expected, rel=1e-6
    )


def test_exact_links_leave_rotors_and_friction(tx90l: RobotModel, single: TrajectoryPlan) -> None:
    """A robot.yaml that lets no link be off has no unknown link."""
    exact = PriorConfig(mass=0.0, com=0.0, inertia=0.0, rotor_inertia=0.05)
    robot = replace(tx90l, config=replace(tx90l.config, prior=exact))
    truth = replace(robot, drives=replace(robot.drives, rotor_inertia=1.04 * robot.drives.rotor_inertia))
    rng = np.random.default_rng(6)
    estimate = fit_inertials(robot, single, synthetic(truth, single, coloured(single, rng)))
    assert not any(name.startswith("link") for name in estimate.parameters.names)
    for name in tx90l.joint_names:
        key = f"{name}.rotor_inertia"
        std = estimate.std(key)
        assert std is not None and abs(estimate.values[key] - truth.value(key)) < 4 * std


@pytest.mark.statistical
def test_covariance_is_true_under_coloured_noise(tx90l: RobotModel, single: TrajectoryPlan) -> None:
    inside, together, _ = coverage(tx90l, single, range(2))
    assert 0.90 < inside < 0.99
    assert 0.75 < together < 1.4


@pytest.mark.slow
def test_covariance_is_true_on_many_robots(tx90l: RobotModel, plan: TrajectoryPlan) -> None:
    inside, together, offsets = coverage(tx90l, plan, range(100, 160))
    assert 0.93 < inside < 0.97
    assert 0.9 < together < 1.2
    assert 0.92 < offsets < 0.98


def of_one_robot(
    seed: int, model: RobotModel, plan: TrajectoryPlan
) -> tuple[np.ndarray, float, tuple[str, ...]]:
    """Errors over their standard deviations, the mean square of decorrelated errors, and the names of the parameters."""
    rng = np.random.default_rng([2024, seed])
    truth = reshaped(drawn(model, rng), rng)
    estimate = fit_inertials(model, plan, synthetic(truth, plan, coloured(plan, rng)))
    return *errors(estimate, truth), estimate.parameters.names


def coverage(model: RobotModel, plan: TrajectoryPlan, seeds: range) -> tuple[float, float, float]:
    """Share of the 95 % intervals that hold the truth, the mean square of decorrelated errors, and that share of the offsets alone."""
    normalised, together, names = zip(*over_seeds(of_one_robot, seeds, model, plan), strict=True)
    inside = np.abs(normalised) < 1.96
    offsets = inside[:, [name.endswith(".torque_offset") for name in names[0]]]
    return float(np.mean(inside)), float(np.mean(together)), float(np.mean(offsets))


def test_the_virtual_cell_is_understood(tx90l: RobotModel) -> None:
    """MuJoCo's robot with gaps, encoders and a friction that is no sign: the covariance still holds, and gravity is known.

    Its links have CAD's shapes, without which a rotor is not told from the link about the same axis.
    """
    known = replace(tx90l.config.prior, inertia=0.0)
    tx90l = with_known_constants(replace(tx90l, config=replace(tx90l.config, prior=known)))
    plan = exciting_plan(tx90l, count=1, seed=4)
    values = draw_truth(tx90l, CellConfig().spread, np.random.default_rng(4))
    truth = tx90l.with_values(values)
    cell = VirtualCell(truth, seed=4, controller_model=tx90l)
    estimate = fit_inertials(tx90l, plan, cell.record(plan))
    one, together = errors(estimate, truth)
    assert np.mean(np.abs(one) < 1.96) > 0.88
    assert 0.5 < together < 1.6
    for name, below in (("link_2.com_x", 1e-3), ("link_3.com_x", 1e-3), ("joint_2.rotor_inertia", 5e-3)):
        number = estimate.parameters.index(name)
        assert np.sqrt(estimate.covariance[number, number]) < below


def test_what_does_not_fit_is_said(tx90l: RobotModel, plan: TrajectoryPlan) -> None:
    short = Recording(time_step=1 / 400, q=np.zeros((50, 6)), torque=np.zeros((50, 6)))
    with refused("E-DYN-039", "50", "0.0025", "6000"):
        fit_inertials(tx90l, plan, [short])
    with refused("E-DYN-015"):
        fit_inertials(tx90l, plan, [])
    still = Recording(time_step=1 / 400, q=np.zeros((6000, 6)), torque=np.zeros((6000, 6)))
    with refused("E-DYN-040", "1"):
        fit_inertials(tx90l, plan, [still])
    full = next(synthetic(tx90l, plan, STILL))
    with refused("E-DYN-040", "2"):
        fit_inertials(tx90l, plan, [full, full])
    with refused("E-DYN-016", "joint_1"):
        fit_inertials(tx90l, plan, [replace(full, torque=0.0 * full.torque)])
    lacking = replace(tx90l, drives=replace(tx90l.drives, rotor_inertia=np.full(6, np.nan)))
    with refused("E-DYN-017", "joint_1"):
        fit_inertials(lacking, plan, [full])
