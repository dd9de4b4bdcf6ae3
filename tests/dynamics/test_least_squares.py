"""Linear estimators: exact without noise, true intervals with it, the same in blocks as in one go."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from flexcal.data.recordings import Decimation
from flexcal.dynamics.diagnostics import essential_parameters
from flexcal.dynamics.estimators import ordinary_least_squares, weighted_least_squares
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.regression import RegressionData, TriangularFactor, assemble_regression
from flexcal.dynamics.regression import blocks as rows
from flexcal.dynamics.signals import Motion, Window
from flexcal.estimation import Estimate
from flexcal.model.torques import inertial_parameters

ESTIMATORS = [ordinary_least_squares, weighted_least_squares]
NOISE = np.array([3.0, 2.0, 1.0, 0.3, 0.2, 0.05])


@pytest.fixture(scope="module")
def truth(observation: Observation) -> np.ndarray:
    """The CAD values, each off by a tenth, and drives that CAD does not know."""
    rng = np.random.default_rng(3)
    values = observation.values() * rng.normal(1.0, 0.1, len(observation.names))
    return np.where(values == 0, rng.uniform(0.1, 1.0, len(values)), values)


@pytest.fixture(scope="module")
def clean(observation: Observation, truth: np.ndarray, swing: Motion) -> Motion:
    torques = [
        truth[m] @ c for m, c in zip(observation.column_indices, observation.columns(swing), strict=True)
    ]
    return replace(swing, torque=np.stack(torques, axis=1))


def errors(estimate: Estimate, names: tuple[str, ...], truth: np.ndarray) -> dict[str, float]:
    expected = estimate.regrouped(dict(zip(names, truth, strict=True)))
    return {
        n: estimate.values[n] - v for n, v in expected.items() if n not in {d.name for d in estimate.dropped}
    }


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("factor", [1, 4])
def test_without_noise_the_truth_comes_back(
    estimator: Callable[[RegressionData], Estimate],
    factor: int,
    observation: Observation,
    base: BaseParameters,
    clean: Motion,
    truth: np.ndarray,
) -> None:
    data = assemble_regression(observation, base, [clean], Decimation(factor))
    found = estimator(data)
    assert found.rank == 61
    assert max(map(abs, errors(found, observation.names, truth).values())) < 1e-10
    assert data.errors(found.parameters.coordinates())[0] < 1e-12


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_the_identified_robot_needs_the_measured_torques(
    estimator: Callable[[RegressionData], Estimate],
    observation: Observation,
    base: BaseParameters,
    clean: Motion,
) -> None:
    """What Pinocchio's regressor makes of the robot that carries the estimate, with its drives added, is what was measured."""
    robot = observation.model.with_estimate(
        estimator(assemble_regression(observation, base, [clean], Decimation(1)))
    )
    model = pin.buildModelFromUrdf(str(robot.urdf))
    data = model.createData()
    links = (
        inertial_parameters(robot).reshape(6, 10)[:, [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]].ravel()
    )  # Iyy before Ixz
    (inertia, viscous, coulomb), speed = robot.drives.coupling[0], np.array([0.0, 0.0, 0.0, 0.0, 1.0, 1.0])
    for k in (0, 500, 1500):
        q, dq, ddq = clean.q[k], clean.dq[k], clean.ddq[k]
        torque = (
            pin.computeJointTorqueRegressor(model, data, q, dq, ddq) @ links
            + robot.drives.rotor_inertia * ddq
            + robot.drives.viscous * dq
        )
        torque = torque + robot.drives.coulomb * np.sign(dq) + robot.drives.torque_offset
        torque += coulomb * np.sign(speed @ dq) * speed
        torque[4:] += inertia * ddq[[5, 4]] + viscous * dq[[5, 4]]
        np.testing.assert_allclose(torque, clean.torque[k], atol=1e-9 * np.abs(clean.torque).max())


@pytest.mark.parametrize(
    ("recordings", "low", "high"), [(4, 0.91, 0.985), pytest.param(24, 0.93, 0.97, marks=pytest.mark.slow)]
)
def test_weighted_intervals_cover(
    observation: Observation,
    base: BaseParameters,
    clean: Motion,
    truth: np.ndarray,
    rng: np.random.Generator,
    recordings: int,
    low: float,
    high: float,
) -> None:
    """White noise that differs by joint: 95 % intervals hold 95 % of 61 parameters, and beat unweighted ones."""
    inside, ratios = [], []
    clean = Motion(*(part[::4] for part in (clean.time, clean.q, clean.dq, clean.ddq, clean.torque)))
    for _ in range(recordings):
        noisy = replace(clean, torque=clean.torque + NOISE * rng.normal(size=clean.torque.shape))
        data = assemble_regression(observation, base, [noisy], Decimation(1))
        found, plain = weighted_least_squares(data), ordinary_least_squares(data)
        for name, error in errors(found, observation.names, truth).items():
            least, most = found.interval(name) or (np.nan, np.nan)
            inside.append(least - found.values[name] <= -error <= most - found.values[name])
        ratios.append((found.std("link_6.mc_x") or np.nan) / (plain.std("link_6.mc_x") or np.nan))
    assert low < np.mean(inside) < high
    assert max(ratios) < 0.2


def test_blocks_and_experiments_add_up(
    observation: Observation, base: BaseParameters, clean: Motion, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(1)
    noisy = replace(clean, torque=clean.torque + NOISE * rng.normal(size=clean.torque.shape))
    whole = ordinary_least_squares(assemble_regression(observation, base, [noisy], Decimation(4)))
    monkeypatch.setattr(rows, "_BLOCK", 100)
    data = assemble_regression(observation, base, [noisy], Decimation(4))
    assert data.subsystems[0].triangle.rows == whole_rows(noisy, Decimation(4))
    assert ordinary_least_squares(data).parameters.coordinates() == pytest.approx(
        whole.parameters.coordinates(), abs=1e-9
    )
    halves = [Window(end=5.0), Window(start=5.0)]
    two = ordinary_least_squares(
        assemble_regression(observation, base, [noisy, noisy], Decimation(4), windows=halves)
    )
    assert two.parameters.coordinates() == pytest.approx(whole.parameters.coordinates(), abs=1e-9)


def whole_rows(motion: Motion, decimation: Decimation) -> int:
    return len(range(decimation.support, len(motion) - decimation.support, decimation.factor))


def test_standstill_is_left_out_and_counted(
    observation: Observation, base: BaseParameters, clean: Motion
) -> None:
    at = np.r_[np.arange(2000), np.full(500, 1999)]
    held = Motion(
        np.arange(2500) / 200, clean.q[at], clean.dq[at] * (np.arange(2500) < 2000)[:, None], clean.ddq[at], clean.torque[at]
    )  # fmt: skip
    data = assemble_regression(observation, base, [held], Decimation(1))
    assert data.masked == 500
    assert (
        assemble_regression(observation, base, [held], Decimation(1), mask_standstill=False)
        .subsystems[0]
        .triangle.rows
        == 2500
    )
    with refused("E-DYN-025", "the motion"):
        assemble_regression(observation, base, [held], Decimation(1), windows=[Window(start=10.5)])


def test_a_joint_that_never_moves_is_named_and_the_rest_identified(
    observation: Observation, base: BaseParameters, truth: np.ndarray, swing: Motion
) -> None:
    locked = swing.q * [1, 1, 1, 1, 1, 0], swing.dq * [1, 1, 1, 1, 1, 0], swing.ddq * [1, 1, 1, 1, 1, 0]
    still = Motion(swing.time, *locked, swing.torque)
    torques = [
        truth[m] @ c for m, c in zip(observation.column_indices, observation.columns(still), strict=True)
    ]
    data = assemble_regression(
        observation, base, [replace(still, torque=np.stack(torques, axis=1))], Decimation(1)
    )
    found = weighted_least_squares(data)
    assert found.rank < 61
    hidden = {entry.name for entry in found.dropped}
    assert {"joint_6.viscous", "joint_6.coulomb", "joint_6.rotor_inertia"} <= hidden
    assert found.interval("joint_6.viscous") is None
    essential = essential_parameters(data, found)
    assert hidden.isdisjoint(essential.names + essential.eliminated)
    assert abs(found.values["joint_3.viscous"] - truth[observation.names.index("joint_3.viscous")]) < 1e-8


def test_a_triangle_is_its_system(rng: np.random.Generator) -> None:
    """Residual, noise and rank as a dense solution gives them; two triangles added are the two systems stacked."""
    w, y = rng.normal(size=(50, 4)), rng.normal(size=50)
    w[:, 3] = w[:, 0] - 2 * w[:, 1]
    triangle = TriangularFactor.of(w[:30], y[:30]) + TriangularFactor.of(w[30:], y[30:])
    x = np.array([1.0, -2.0, 0.5, 3.0])
    assert triangle.residual(x) == pytest.approx(np.linalg.norm(y - w @ x), rel=1e-13)
    left = y - w @ np.linalg.lstsq(w, y, rcond=None)[0]
    sigma, rank = triangle.noise()
    assert (rank, triangle.rows) == (3, 50)
    assert sigma == pytest.approx(np.linalg.norm(left) / np.sqrt(47), rel=1e-12)


def test_triangles_solve_as_extended_precision_does(rng: np.random.Generator) -> None:
    """A system of condition 1e6 in twelve parts, against Householder's QR in 80-bit floats."""
    size, rows = 9, 600
    left, right = (
        np.linalg.qr(rng.normal(size=(rows, size)))[0],
        np.linalg.qr(rng.normal(size=(size, size)))[0],
    )
    w = left * np.logspace(0, -6, size) @ right
    y = w @ rng.normal(size=size) + 1e-9 * rng.normal(size=rows)
    triangle = TriangularFactor.of(w[:50], y[:50])
    for start in range(50, rows, 50):
        triangle = triangle + TriangularFactor.of(w[start : start + 50], y[start : start + 50])
    found = np.linalg.solve(triangle.matrix[:size], triangle.right[:size])
    table = np.column_stack([w, y]).astype(np.longdouble)
    for k in range(size):
        v = table[k:, k].copy()
        v[0] += np.copysign(np.sqrt(v @ v), v[0])
        table[k:, k:] -= np.outer(v, 2 * (v @ table[k:, k:]) / (v @ v))
    expected = np.zeros(size, dtype=np.longdouble)
    for k in reversed(range(size)):
        expected[k] = (table[k, -1] - table[k, k + 1 : size] @ expected[k + 1 :]) / table[k, k]
    assert np.linalg.norm(found - expected) < 1e-9 * np.linalg.norm(expected)


def test_what_is_not_finite_is_refused(observation: Observation, base: BaseParameters, clean: Motion) -> None:
    torque = clean.torque.copy()
    torque[70, 2] = np.nan
    with refused("E-DYN-024", "the motion"):
        assemble_regression(observation, base, [replace(clean, torque=torque)], Decimation(1))


def test_too_few_rows_for_a_noise(observation: Observation, base: BaseParameters, motion: Motion) -> None:
    with refused("E-DYN-012"):
        weighted_least_squares(assemble_regression(observation, base, [motion.part(0, 20)], Decimation(1)))
