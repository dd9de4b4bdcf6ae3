"""Drives with hysteresis: equivalent gains of an element that slips, and what stage 1 makes of responses that have one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_hardening_drives import still_plan

from flexcal.data.plans import MultisinePlan
from flexcal.elasticity.identification import MultiStart, fit_springs
from flexcal.elasticity.response_model import ResponseModel, Tolerances, stiffness_parameters
from flexcal.elasticity.time_periodic import DriveTorque, SlippingSprings
from flexcal.elasticity.time_periodic.slipping_springs import LIMITS
from flexcal.jobs.experiments import frequency_plan
from flexcal.model.robot import RobotModel
from flexcal.model.vibration import closed_loop_motion, linearise


def slipped(twist: np.ndarray, limit: float) -> np.ndarray:
    """Extension (N,) of a spring that follows a twist (N,) and slips at `limit`."""
    extension, found = 0.0, np.zeros(len(twist))
    for k in range(1, len(twist)):
        extension += twist[k] - twist[k - 1]
        extension = min(max(extension, -limit), limit)
        found[k] = extension
    return found


@pytest.mark.parametrize("share", [0.1, 0.3, 0.7])
def test_gains_under_a_sine_are_those_of_the_closed_form(share: float) -> None:
    """Describing function of a Jenkins element: with cos φ = 1 - 2 share, (φ - sin φ cos φ)/π, and sin² φ / π that is lost."""
    size = np.array([[3e-4], [0.0]])
    springs = SlippingSprings.of(np.zeros((1, 1)), size, np.array([10.0, 80.0]), 2.0)
    gain, loss = springs.mean(np.array([share * 3e-4]))[0][:, 0]
    angle = np.arccos(1 - 2 * share)
    assert gain == pytest.approx((angle - np.sin(angle) * np.cos(angle)) / np.pi, abs=0.04)
    assert 2 * np.pi * 10 * loss == pytest.approx(np.sin(angle) ** 2 / np.pi, abs=0.04)


def test_gains_with_a_slow_motion_by_the_regression_of_a_simulated_element(rng: np.random.Generator) -> None:
    """Mean gains, gains along the slow motion and at the lines; other phases, four times the samples."""
    lines, slow_hz, limit = np.arange(53, 320, 6) * 0.25, 2.125, 1.2e-4
    size = 4e-5 / (1 + (lines / 24) ** 2)[:, None]
    turn = np.arange(64) / 64
    springs = SlippingSprings.of(4e-4 * np.sin(2 * np.pi * turn)[:, None], size, lines, slow_hz)
    time = np.arange(64_000) / 2560
    wave = np.exp(2j * np.pi * np.outer(time, lines)) * (
        size[:, 0] * np.exp(2j * np.pi * rng.uniform(size=len(lines)))
    )
    small = np.real(wave.sum(axis=1))
    rate = np.real(wave @ (2j * np.pi * lines))
    phase = (slow_hz * time) % 1.0
    extension = slipped(small + 4e-4 * np.sin(2 * np.pi * phase), limit)
    cell = (64 * phase).astype(int)
    extension -= (np.bincount(cell, extension) / np.bincount(cell))[cell]
    gains = springs.mean(np.array([limit]))[0][:, 0]
    for gain, x in zip(gains, (small, rate), strict=True):
        assert gain == pytest.approx(extension @ x / (x @ x), rel=0.15)
    turning = np.abs((phase - 0.25 + 0.5) % 0.5 - 0.25)  # from the middle between reversals
    course = springs.course(np.array([limit]), 16)[0, :, 0] + gains[0]
    for p, near in ((4, turning > 0.25 - 1 / 32), (0, turning < 1 / 32)):
        assert (course[p] + course[p + 8]) / 2 == pytest.approx(
            extension[near] @ small[near] / (small[near] @ small[near]), abs=0.1
        )
    spectrum, own = (np.fft.rfft(x[-51_200:])[np.rint(lines * 20).astype(int)] for x in (extension, small))
    complex_gain = springs.at(np.array([limit]), lines)[0][:, 0] + gains[0] + 2j * np.pi * lines * gains[1]
    for band in (slice(0, 12), slice(12, 30)):
        seen = np.vdot(own[band], spectrum[band]) / np.vdot(own[band], own[band])
        expected = np.sum(np.abs(own[band]) ** 2 * complex_gain[band]) / np.sum(np.abs(own[band]) ** 2)
        assert abs(seen - expected) < 0.1


def test_gains_have_one_derivative_everywhere() -> None:
    """A fit ends at the wrong place where it jumps."""
    lines = np.array([10.0, 20.0, 80.0])
    size = np.array([[2e-4, 1e-4], [5e-5, 5e-5], [1e-5, 2e-5]])
    springs = SlippingSprings.of(2e-4 * np.sin(np.linspace(0, 6, 16))[:, None] * [1, 2], size, lines, 2.0)
    for limit in [0.5e-5, *LIMITS[[0, 4, 11, -1]], 7.7e-5, 4e-3]:
        limits = np.array([limit, limit])
        gains, slopes = springs.mean(limits)
        above, below = (
            (springs.mean(limits * np.exp(change))[0] - gains) / change for change in (1e-5, -1e-5)
        )
        size_of = 1e-3 * np.abs(gains).max(axis=1, keepdims=True)
        assert np.all(np.abs(above - slopes) < size_of)
        assert np.all(np.abs(below - slopes) < size_of)
    np.testing.assert_allclose(
        springs.mean(LIMITS[[6, 7]])[0], springs.along.mean(axis=2)[[6, 7], :, [0, 1]].T
    )


@pytest.mark.parametrize(
    "true",
    [
        pytest.param({}, id="linear"),
        pytest.param({0: 0.4, 1: 0.3, 2: 0.4}, id="slipping", marks=pytest.mark.slow),
    ],
)
def test_hysteresis_is_found_and_not_invented(
    stiff: RobotModel, poses, synthesise, rng: np.random.Generator, true: dict[int, float]
) -> None:
    """The stiffness is that under a load, when the springs have slipped; gains are of elements simulated here, in every pose."""
    stiff = stiff.with_bearings("after")
    plan = still_plan(stiff, poses["default"])
    plan = replace(plan, amplitude=np.full_like(plan.amplitude, 6.0))
    time = np.arange(0, 12, 1 / 640)
    wave = np.exp(2j * np.pi * np.outer(time, plan.frequencies_hz))
    responses = []
    for q in poses["default"]:
        system = linearise(stiff, q)
        moved = closed_loop_motion(system, plan.frequencies_hz, plan.kp[:3], plan.kd[:3])
        changed = {}
        for joint, share in true.items():
            twists = 6.0 / np.sqrt(3) * (moved[:, 3 + 3 * joint + 2] - moved[:, joint])
            own = twists * np.exp(2j * np.pi * rng.uniform(size=twists.shape))
            small = np.real(wave @ own).sum(axis=1)
            rate = np.real(wave @ (2j * np.pi * plan.frequencies_hz[:, None] * own)).sum(axis=1)
            extension = slipped(small, 8e-5)
            name = f"joint_{joint + 1}.drive"
            k = stiff.value(f"{name}.stiffness")
            changed[f"{name}.stiffness"] = k * (1 + share * (extension @ small) / (small @ small))
            changed[f"{name}.damping"] = stiff.value(f"{name}.damping") + k * share * (extension @ rate) / (
                rate @ rate
            )
        response = synthesise(stiff.with_values(changed), q[None], noise=0.03, rng=rng, step=8)[0]
        responses.append(replace(response, pose=len(responses)))
    estimate = fit_springs(
        stiff,
        responses,
        rng=rng,
        inertias_known=True,
        tolerances=Tolerances.none(),
        plan=plan,
        search=MultiStart(agreement=1),
    ).estimate
    assert any(name.endswith("slip_share") for name in estimate.parameters.names) == bool(true)
    for joint in range(3):
        name = f"joint_{joint + 1}.drive.stiffness"
        error = abs(np.log(estimate.values[name] / stiff.value(name)))
        std = np.sqrt(estimate.covariance[(k := estimate.parameters.index(name)), k])
        assert error < 3 * std
        assert true or std < 0.01


def check_loss(loaded: ResponseModel, x: np.ndarray, plan: MultisinePlan) -> None:
    """The damping of a drive changes by what an element simulated here loses under the same twists."""
    (pose,), natural = loaded.poses, loaded.parameters.natural(x)
    torque = DriveTorque.of(
        loaded.robot.with_values(pose.values(loaded.robot, natural)[0]), pose.q, pose.payload, plan
    )
    k, d = (loaded.robot.value(f"joint_2.drive.{name}") for name in ("stiffness", "damping"))
    time = np.arange(0, 20, 1 / 2560)
    phases = np.random.default_rng(8).uniform(0, 2 * np.pi, len(plan.frequencies_hz))
    waves = torque.lines[:, 1] / torque.stiffness[1] * np.exp(1j * phases)
    turning = np.exp(2j * np.pi * np.outer(time, plan.frequencies_hz))
    cycle = (plan.reference_frequency_hz * time) % 1.0
    slow = np.interp(cycle, np.arange(64) / 64, torque.slow[:, 1] / k, period=1.0)
    extension = slipped(np.real(turning @ waves) + slow, 1.3e-4)
    rate = np.real(turning @ (2j * np.pi * plan.frequencies_hz * waves))
    loss = 0.3 * k / d * (extension @ rate) / (rate @ rate)
    assert loss > 0.1
    assert loaded.damping_changes(x)["joint_2"] == pytest.approx(loss, rel=0.2)


def test_a_stiffness_changes_the_gains_by_the_torque_at_which_springs_slip(
    stiff: RobotModel, poses, synthesise, examples: Path
) -> None:
    """The derivative with tables of gains at another stiffness is nearly that with new ones: a load stays, whatever the stiffness is."""
    plan = frequency_plan(stiff, examples / "tx90l" / "frequency_poses.csv", "default", 0)
    responses = synthesise(stiff, poses["default"][:1], noise=0.01, step=16)
    model = stiff.with_brakes(responses[0].joints)
    parameters = stiffness_parameters(model, responses, hysteresis=True)
    values = {item.name: item.value for item in parameters}
    names = {"slip_share": 0.3, "slip_twist": 1.3e-4}
    x = parameters.coordinates({n: names.get(n.rpartition(".")[2], v) for n, v in values.items()})
    at_rest = ResponseModel.of(model, responses, parameters)
    loaded = at_rest.with_loaded_drives(x, plan)
    check_loss(loaded, x, plan)
    columns = loaded.predict(x)[0]
    for joint in range(1, 4):
        number = parameters.index(f"joint_{joint}.drive.stiffness")
        step = 0.005 * np.eye(len(x))[number]
        above, below = (at_rest.with_loaded_drives(y, plan).responses(y)[0] for y in (x + step, x - step))
        exact = (above - below) / 0.01
        own = columns.derivatives[..., list(columns.columns).index(number)]
        assert np.linalg.norm(own - exact) < 0.07 * np.linalg.norm(exact)
    # and exact with the same tables, at every line
    for name in ("stiffness", "damping", "slip_share", "slip_twist"):
        number = parameters.index(f"joint_2.drive.{name}")
        step = 1e-5 * np.eye(len(x))[number]
        above, below = (loaded.responses(y)[0] for y in (x + step, x - step))
        own = columns.derivatives[..., list(columns.columns).index(number)]
        np.testing.assert_allclose(own, (above - below) / 2e-5, atol=2e-4 * np.abs(own).max())
