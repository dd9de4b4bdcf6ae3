"""Springs of joints that robot.yaml holds rigid, found where the wrist gives way and left out where it does not, and misfits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexcal.elasticity.identification import MultiStart, fit_springs
from flexcal.model.robot import spring_names
from flexcal.virtual_cell import CellConfig, FrictionConfig, MismatchConfig
from flexcal.virtual_cell.equilibrium import rest
from flexcal.virtual_cell.plant import build_plant, linearise

mujoco = pytest.importorskip("mujoco")

WRIST = ("joint_4", "joint_5", "joint_6")
NOISE = 0.03


def mujoco_responses(like, truth, rng, *, wrist):
    """The responses `like` with the values that MuJoCo's matrices give; the wrist's drives have `wrist` N m/rad, 0 is rigid."""
    config = CellConfig(mismatch=MismatchConfig(elastic_wrist=wrist), friction=FrictionConfig())
    made = []
    for response in like:
        plant = build_plant(truth, config, q=response.q_mean, free=(0, 1, 2), payload=6.0)
        at = rest(plant, mujoco.MjData(plant.mjmodel), response.q_mean[:3]).position
        linear = linearise(plant, at)
        s = 1j * response.omega[:, None, None]
        dynamics = s**2 * linear.mass + s * linear.damping + linear.stiffness
        forces = np.eye(len(at))[:, plant.motors]
        moved = np.linalg.solve(dynamics, np.broadcast_to(forces, (len(s), *forces.shape)))
        exact = s**2 * moved[:, plant.motors]
        draw = rng.standard_normal((2, *exact.shape)) / np.sqrt(2)
        made.append(noisy(response, exact, draw[0] + 1j * draw[1]))
    return made


def noisy(response, exact, draw):
    """With noise on the torque of the relative size NOISE, and its covariance."""
    covariance = np.zeros_like(response.covariance)
    one = NOISE**2 * exact @ np.swapaxes(exact, 1, 2).conj()
    for c in range(3):
        covariance[:, 3 * c : 3 * c + 3, 3 * c : 3 * c + 3] = one
    seen = exact + NOISE * exact @ draw
    return replace(
        response,
        response=seen,
        covariance=covariance,
        noise_covariance=covariance,
        realisations=seen[None],
    )


@pytest.fixture
def like(stiff, poses, synthesise):
    return synthesise(stiff, poses["default"][[0, 1, 3]], noise=NOISE, payload=6.0, step=8)


def test_an_elastic_wrist_is_found(stiff, like, drawn, rng):
    truth = drawn(stiff, rng, inertias=False).with_values({f"joint_{i}.delay": 0.0 for i in (1, 2, 3)})
    responses = mujoco_responses(like, truth, rng, wrist=50e3)
    result = fit_springs(stiff, responses, rng=rng, inertias_known=True, search=MultiStart(agreement=1))
    estimate = result.estimate
    assert estimate.misfit is None
    assert {name.split(".")[0] for name in result.springs} >= set(WRIST[:2])
    for name in spring_names(stiff)[:9]:
        number = estimate.parameters.index(name)
        error = np.log(estimate.values[name] / truth.value(name))
        assert abs(error) < 4 * np.sqrt(estimate.covariance[number, number]), name
        if estimate.identifiable[number]:
            assert abs(error) < 0.15, name
    number = estimate.parameters.index("joint_5.drive.stiffness")
    error = np.log(estimate.values["joint_5.drive.stiffness"] / 50e3)
    assert abs(error) < 4 * np.sqrt(estimate.covariance[number, number]) < 0.5
    robot = stiff.with_estimate(estimate)
    assert "joint_5" in [joint.name for joint in robot.elastic]
    assert [joint.name for joint in robot.driven] == ["joint_1", "joint_2", "joint_3"]


def test_a_rigid_wrist_stays_rigid(stiff, like, drawn, rng):
    truth = drawn(stiff, rng, inertias=False)
    responses = mujoco_responses(like, truth, rng, wrist=0.0)
    result = fit_springs(stiff, responses, rng=rng, inertias_known=True)
    assert result.springs == spring_names(stiff)
    assert result.estimate.misfit is None


@pytest.mark.slow
def test_a_mode_that_no_spring_of_the_model_has_is_a_misfit(stiff, like, shaken, rng):
    clean = mujoco_responses(like, stiff, rng, wrist=0.0)
    calm = fit_springs(stiff, clean, rng=rng, inertias_known=True).estimate
    responses = [shaken(response, 0.6) for response in clean]
    estimate = fit_springs(stiff, responses, rng=rng, inertias_known=True).estimate
    misfit = estimate.misfit
    assert misfit is not None and misfit.severe
    assert misfit.axis == "joint_2"
    assert misfit.low_hz < 50 and misfit.high_hz > 40
    for name in spring_names(stiff)[:9]:
        number = estimate.parameters.index(name)
        assert np.sqrt(estimate.covariance[number, number]) >= 0.3, name
        assert np.sqrt(calm.covariance[number, number]) < 0.3, name
