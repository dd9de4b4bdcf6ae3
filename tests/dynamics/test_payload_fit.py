"""A payload from torques: exact without noise, by another engine's torques, with intervals that hold it, and what no motion tells."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import recovery
from over_seeds import over_seeds
from refusals import refused
from two_links import GAINS, HELD, two_links
from two_links import swings as swing_of

from flexcal.data.recordings import Decimation
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.payload import PayloadEquations, PayloadFit, RobotPrior, fit_payload
from flexcal.dynamics.payload.equations import payload_to_link_frame
from flexcal.dynamics.payload.rigid_body import (
    identified_moments,
    link_frame_from_payload,
    nearest_body,
    payload_from_link_frame,
)
from flexcal.dynamics.regression import assemble_regression
from flexcal.dynamics.signals import Motion
from flexcal.estimation import Estimate
from flexcal.model.parts import PSEUDO_INERTIA
from flexcal.model.robot import RobotModel, with_payload
from flexcal.model.torques import torque_regressor

BODY = np.array([2.0, 0.05, -0.03, 0.08, 0.02, 0.001, -0.002, 0.03, 0.003, 0.015])
"""kg, m, kg m² about the centre of mass."""
LAST = slice(50, 60)


@pytest.fixture(scope="module")
def arm(tx40: RobotModel) -> Observation:
    return Observation(held_by(tx40), CLASSIC)


def held_by(model: RobotModel) -> RobotModel:
    """With a payload to be found in the frame of the last link."""
    return with_payload(model, model.joints[-1].link, 1.0, np.zeros(3), np.zeros((3, 3)))


def loaded(arm: Observation, truth: np.ndarray) -> np.ndarray:
    """The true parameters with the body."""
    held = arm.model.payload
    assert held is not None
    values = truth.copy()
    values[LAST] += payload_to_link_frame(held) @ link_frame_from_payload(BODY)
    return values


def found(
    arm: Observation, motions: list[Motion], carries: list[bool], dynamics: Estimate | None = None
) -> PayloadFit:
    base, held = BaseParameters.of(arm), arm.model.payload
    data = assemble_regression(arm, base, motions, Decimation(1))
    assert held is not None
    return fit_payload(PayloadEquations(data, carries, held, RobotPrior.of(arm, base, dynamics)))


def values(fit: PayloadFit) -> np.ndarray:
    return np.array(list(fit.estimate.values.values()))


def test_without_noise_it_comes_back(
    arm: Observation, truth: np.ndarray, sines: Callable[[int, float], Motion]
) -> None:
    """From ten seconds with it and ten without, of a robot that differs from CAD in everything."""
    motion = sines(1000, 100.0)
    pair = [recovery.driven(arm, motion, p) for p in (loaded(arm, truth), truth)]
    fit = found(arm, pair, [True, False])
    assert values(fit) == pytest.approx(BODY, abs=1e-6)
    assert all(fit.estimate.identifiable) and fit.rise == 0.0


def test_what_is_predicted_is_what_was_measured(
    arm: Observation, truth: np.ndarray, sines: Callable[[int, float], Motion]
) -> None:
    """Column by column, of a recording with the payload and of one without; the errors by joint are those of noise that is added to one."""
    motion, held = sines(1000, 100.0), arm.model.payload
    pair = [recovery.driven(arm, motion, p) for p in (loaded(arm, truth), truth)]
    noise = np.zeros_like(motion.torque)
    noise[:, 1] = np.random.default_rng(3).normal(size=len(motion))
    base = BaseParameters.of(arm)
    for added in (0 * noise, noise):
        noisy = [replace(each, torque=each.torque + added) for each in pair]
        data = assemble_regression(arm, base, noisy, Decimation(1), mask_standstill=False)
        assert held is not None
        equations = PayloadEquations(data, [True, False], held, RobotPrior.of(arm, base, None))
        fit = fit_payload(equations)
        left = []
        for each, carries in zip(noisy, (True, False), strict=True):
            found = equations.coefficients(fit.unknowns, carries)
            predicted = [
                found[m] @ own[:-1] for m, own in zip(arm.column_indices, arm.systems(each), strict=True)
            ]
            left.append(each.torque - np.array(predicted).T)
        missed = np.linalg.norm(np.concatenate(left), axis=0)
        size = np.linalg.norm(np.concatenate([each.torque for each in noisy]), axis=0)
        np.testing.assert_allclose(fit.joint_errors, missed / size, atol=1e-9)
        assert fit.error == pytest.approx(np.linalg.norm(missed) / np.linalg.norm(size), abs=1e-9)
        share = np.linalg.norm([added[:, 1]] * 2) / size[1]
        assert fit.joint_errors == pytest.approx([0, share, 0, 0, 0, 0], rel=0.1, abs=1e-3)


def test_without_noise_from_identified_dynamics(
    arm: Observation, base: BaseParameters, truth: np.ndarray, sines: Callable[[int, float], Motion]
) -> None:
    """The block of an earlier identification in place of recordings, its regrouped parameters left where CAD has them."""
    motion = sines(1000, 100.0)
    data = assemble_regression(arm, base, [recovery.driven(arm, motion, truth)], Decimation(1))
    block = weighted_least_squares(data)
    known = Observation(arm.model.with_estimate(block), CLASSIC)
    fit = found(known, [recovery.driven(arm, motion, loaded(arm, truth))], [True], block)
    assert values(fit) == pytest.approx(BODY, abs=1e-5)


def test_the_columns_are_those_of_pinocchio(tx40: RobotModel, motion: Motion) -> None:
    """Its inverse dynamics with the body on the flange's frame less those without, in a frame that is turned and shifted."""
    turn = pin.rpy.rpyToMatrix(0.3, -0.5, 0.9)
    model = held_by(tx40)
    assert model.payload is not None
    held = replace(model.payload, rotation=turn, translation=np.array([0.05, -0.02, 0.1]))
    columns = torque_regressor(tx40, motion.q, motion.dq, motion.ddq)[:, :, LAST] @ payload_to_link_frame(
        held
    )
    engine = pin.buildModelFromUrdf(str(tx40.urdf))
    heavier = engine.copy()
    body = pin.Inertia(BODY[0], BODY[1:4], moments_matrix(BODY[4:]))
    last = heavier.njoints - 1
    heavier.inertias[last] = heavier.inertias[last] + pin.SE3(turn, held.translation).act(body)
    data = engine.createData(), heavier.createData()
    for k in range(len(motion)):
        state = motion.q[k], motion.dq[k], motion.ddq[k]
        expected = pin.rnea(heavier, data[1], *state) - pin.rnea(engine, data[0], *state)
        np.testing.assert_allclose(columns[k] @ link_frame_from_payload(BODY), expected, atol=1e-10)


def moments_matrix(moments: np.ndarray) -> np.ndarray:
    result = np.zeros((3, 3))
    result[np.triu_indices(3)] = moments
    return result + np.triu(result, 1).T


def test_a_plane_arm_tells_what_lies_in_its_plane(tmp_path: Path) -> None:
    """Mass and centre of mass in the plane; the other coordinate and the inertia stay as declared, by name."""
    robot = with_payload(two_links(tmp_path), "lower", 1.0, np.array([0.0, 0.07, 0.0]), np.zeros((3, 3)))
    arm = Observation(robot, CLASSIC)
    pair = [level(swing_of(arm, held, 7)) for held in (HELD, 0 * HELD)]
    fit = found(arm, pair, [True, False])
    hidden = {
        n
        for n, seen in zip(fit.estimate.parameters.names, fit.estimate.identifiable, strict=True)
        if not seen
    }
    assert hidden == {f"payload.{k}" for k in ("com_y", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")}
    assert fit.estimate.values["payload.com_y"] == 0.07
    expected = HELD[:4] / HELD[0]
    got = fit.estimate.values
    assert got["payload.mass"] == pytest.approx(HELD[0], rel=1e-6)
    assert [got["payload.com_x"], got["payload.com_z"]] == pytest.approx([expected[1], expected[3]], abs=1e-6)
    assert fit.estimate.std("payload.com_y") is None and fit.estimate.std("payload.com_x") is not None


def level(motion: Motion) -> Motion:
    """The swings with torques that read what they are."""
    return replace(motion, torque=motion.torque * GAINS)


def test_nothing_held_is_refused(tmp_path: Path) -> None:
    robot = with_payload(two_links(tmp_path), "lower", 1.0, np.zeros(3), np.zeros((3, 3)))
    arm = Observation(robot, CLASSIC)
    rng = np.random.default_rng(0)
    clean = [level(swing_of(arm, 0 * HELD, seed)) for seed in (7, 8)]
    pair = [replace(m, torque=m.torque + rng.normal(size=m.torque.shape)) for m in clean]
    with refused("E-DYN-022"):
        found(arm, pair, [True, False])


def scores(folder: Path, seeds: range) -> np.ndarray:
    """Errors over half the intervals (seeds, 3) of mass and centre of mass in the plane, the noise coloured: an AR(1) of 0.8."""
    robot = with_payload(two_links(folder), "lower", 1.0, np.zeros(3), np.zeros((3, 3)))
    arm = Observation(robot, CLASSIC)
    clean = [level(swing_of(arm, held, 7 + k)) for k, held in enumerate((HELD, 0 * HELD))]
    truth = dict(
        zip(("mass", "com_x", "com_z"), (HELD[0], HELD[1] / HELD[0], HELD[3] / HELD[0]), strict=True)
    )
    return np.array(over_seeds(of_one_recording, seeds, arm, clean, truth))


def of_one_recording(
    seed: int, arm: Observation, clean: list[Motion], truth: dict[str, float]
) -> list[float]:
    """Errors over half the intervals, of one draw of the noise."""
    rng = np.random.default_rng(seed)
    noisy = []
    for m in clean:
        noise = rng.normal(size=m.torque.shape)
        for k in range(1, len(noise)):
            noise[k] += 0.8 * noise[k - 1]
        noisy.append(replace(m, torque=m.torque + noise))
    estimate = found(arm, noisy, [True, False]).estimate
    row = []
    for key, value in truth.items():
        interval = estimate.interval(f"payload.{key}")
        assert interval is not None
        row.append(2 * (value - sum(interval) / 2) / (interval[1] - interval[0]))
    return row


@pytest.mark.statistical
def test_intervals_are_of_the_size_of_errors(tmp_path: Path) -> None:
    """Coarsely, from eight runs; intervals for white noise would be three times too narrow here."""
    missed = scores(tmp_path, range(8)) * 1.98
    assert 0.5 < np.sqrt(np.mean(missed**2)) < 1.6


@pytest.mark.slow
def test_intervals_cover(tmp_path: Path) -> None:
    missed = scores(tmp_path, range(200))
    print(f"rms {np.sqrt(np.mean(missed**2, axis=0))}, inside {np.mean(np.abs(missed) < 1, axis=0)}")
    assert 0.92 < np.mean(np.abs(missed) < 1) < 0.985


def test_ten_numbers_become_a_body(rng: np.random.Generator) -> None:
    """The nearest one in the norm of the covariance; numbers that are a body's stay."""
    inside = link_frame_from_payload(BODY)
    root = np.diag(rng.uniform(0.5, 2.0, 10))
    assert nearest_body(inside, root, np.zeros((10, 0))).rise == 0.0
    outside = inside.copy()
    outside[4] = -0.05
    near = nearest_body(outside, root, np.zeros((10, 0)))
    assert np.linalg.eigvalsh(np.tensordot(near.parameters, PSEUDO_INERTIA, 1))[0] > 0
    away = np.linalg.solve(root, near.parameters - outside)
    assert near.rise == pytest.approx(away @ away, rel=1e-2)
    others = inside + 1e-3 * rng.normal(size=(200, 10))
    bodies = [b for b in others if np.linalg.eigvalsh(np.tensordot(b, PSEUDO_INERTIA, 1))[0] > 0]
    assert bodies and min(np.sum(np.linalg.solve(root, b - outside) ** 2) for b in bodies) >= 0.99 * near.rise


def test_body_and_frame_are_each_others_reverse() -> None:
    np.testing.assert_allclose(payload_from_link_frame(link_frame_from_payload(BODY)), BODY, atol=1e-15)


def test_moments_are_told_together() -> None:
    narrow = np.full(6, 1e-3)
    assert identified_moments(BODY, narrow).all()
    wide = narrow.copy()
    wide[1] = 0.03
    assert list(identified_moments(BODY, wide)) == [True, False, True, True, True, True]
    wide[0] = 0.05
    assert not identified_moments(BODY, wide).any()
