"""Estimators with a simulated closed loop: the loop itself, the truth without noise, and no bias where least squares has one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import recovery
from over_seeds import over_seeds
from refusals import refused
from two_links import CONTROLLER, RATE, driven, errors, recorded, true_values, two_links

from flexcal.data.recordings import Decimation, Recording
from flexcal.dynamics.estimators import (
    direct_and_inverse,
    instrumental_variables,
    simulated_iteration,
    weighted_least_squares,
)
from flexcal.dynamics.friction.terms import CoulombWarmUp
from flexcal.dynamics.inverse_model import CLASSIC, Observation
from flexcal.dynamics.regression import RegressionData, assemble_regression
from flexcal.dynamics.signals import Motion
from flexcal.dynamics.simulation import SimulatedExperiment
from flexcal.dynamics.simulation import experiment as simulated_experiment
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate
from flexcal.model.robot import RobotModel

ENCODER = 1e-3
TORQUE = 0.5


@pytest.fixture(scope="module")
def declared(tmp_path_factory: pytest.TempPathFactory) -> Observation:
    """With its controller."""
    return Observation(two_links(tmp_path_factory.mktemp("declared"), CONTROLLER), CLASSIC)


@pytest.fixture(scope="module")
def unknown(tmp_path_factory: pytest.TempPathFactory) -> Observation:
    """The same robot, with no word of a controller."""
    return Observation(two_links(tmp_path_factory.mktemp("unknown")), CLASSIC)


@pytest.fixture(scope="module")
def clean(declared: Observation) -> Motion:
    """Sixteen seconds at 100 Hz."""
    return driven(declared, true_values(declared), 1600)


def noisy(clean: Motion, rng: np.random.Generator) -> Motion:
    """As it is measured: velocities and accelerations are differences of positions."""
    shape = clean.q.shape
    q, torque = clean.q + ENCODER * rng.normal(size=shape), clean.torque + TORQUE * rng.normal(size=shape)
    return Motion.of(Recording(1 / RATE, q, torque), 20.0)


def divided(whole: Motion, parts: list[Motion]) -> Motion:
    """An experiment with gaps between its parts."""

    class Divided(Motion):
        def blocks(self) -> Iterator[Motion]:
            yield from parts

    return Divided(whole.time, whole.q, whole.dq, whole.ddq, whole.torque)


def test_a_linear_loop_answers_as_its_transfer_function(tmp_path: Path) -> None:
    """One joint about the vertical: (kd s + kp) / (J s² + (v + kd) s + kp), J of the link and the rotor."""
    (tmp_path / "wheel.urdf").write_text(
        '<robot name="wheel"><link name="base"/><link name="disc"><inertial><mass value="2"/>'
        '<inertia ixx="0.2" iyy="0.2" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="axis" type="revolute">'
        '<parent link="base"/><child link="disc"/><axis xyz="0 0 1"/>'
        '<limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>'
    )
    (tmp_path / "robot.yaml").write_text(
        "robot: wheel.urdf\ncontroller: {kp: [200], kd: [12], rate_hz: 2000}\n"
    )
    observation = Observation(RobotModel.from_yaml(tmp_path / "robot.yaml"), CLASSIC)
    values = dict(zip(observation.names, observation.values(), strict=True))
    values |= {"axis.rotor_inertia": 0.2, "axis.viscous": 4.0}
    time, omega = np.arange(2000) / 500.0, 2 * np.pi * 2.0
    q = np.sin(omega * time)[:, None]
    command = Motion(time, q, omega * np.cos(omega * time)[:, None], -(omega**2) * q, 0 * q)
    run = SimulatedExperiment(observation, np.array(list(values.values())), command, Decimation(1))
    found = Motion.joined(run.blocks())
    s = 1j * omega
    answer = (12 * s + 200) / (0.5 * s**2 + 16 * s + 200)
    late = time > 1.0
    for order, motion in enumerate((found.q, found.dq, found.ddq)):
        expected = (answer * s**order * np.exp(1j * omega * time)).imag
        assert np.abs(motion[late, 0] - expected[late]).max() < 0.01 * omega**order


def test_steps_that_are_joined(unknown: Observation, monkeypatch: pytest.MonkeyPatch) -> None:
    """At 2 kHz two samples make a step, wherever blocks are cut; finer steps change the motion by little."""
    time, size = np.arange(6000) / 2000.0, np.array([0.8, 0.5])
    angle = 2 * np.pi * np.array([0.5, 0.7]) * time[:, None]
    rate = 2 * np.pi * np.array([0.5, 0.7])
    q = size * np.sin(angle)
    command = Motion(time, q, size * rate * np.cos(angle), -(rate**2) * q, 0 * q)

    class Cut(Motion):
        def blocks(self) -> Iterator[Motion]:
            yield from (self.part(a, b) for a, b in ((0, 2), (2, 2500), (2500, 2503), (2503, 6000)))

    cut = Cut(command.time, command.q, command.dq, command.ddq, command.torque)

    def moved(experiment: Motion) -> Motion:
        run = SimulatedExperiment(unknown, true_values(unknown), experiment, Decimation(40))
        return Motion.joined(run.blocks())

    whole, parts = moved(command), moved(cut)
    for name in ("time", "q", "dq", "ddq"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), atol=1e-9)
    assert len({tuple(row) for row in whole.ddq}) == 3000
    monkeypatch.setattr(simulated_experiment, "_FINE", 0.0)
    fine = moved(command)
    assert len({tuple(row) for row in fine.ddq}) == 6000
    assert np.abs(fine.q - whole.q).max() < 2e-3
    assert np.abs(fine.dq - whole.dq).max() < 0.02


def test_without_noise_the_truth_comes_back(
    declared: Observation, unknown: Observation, clean: Motion
) -> None:
    """IV with any instruments; DIDIM as far as the simulation's steps of 1 ms are right, if it knows the controller."""
    truth, short = true_values(declared), clean.part(0, 800)
    for observation in (declared, unknown):
        rows = recorded(observation, short, 2)
        data = assemble_regression(observation, rows.base, [short], Decimation(2))
        found = instrumental_variables(data, rows)
        assert found.rank == 13
        assert np.abs(errors(found, observation, truth)[0]).max() < 1e-9
        off = np.abs(errors(direct_and_inverse(data, rows), observation, truth)[0]).max()
        assert off < 0.01 if observation is declared else 0.01 < off < 0.1


def whole(motion: Motion) -> Motion:
    return motion


def scores(
    unknown: Observation,
    clean: Motion,
    runs: int,
    *,
    seed: int = 3,
    parted: Callable[[Motion], Any] = whole,
) -> tuple[np.ndarray, np.ndarray]:
    """Errors over standard deviations (runs, k) of weighted least squares and of IV; `parted` makes the log of a noisy motion."""
    linear, free = zip(
        *over_seeds(of_one_log, [(seed, k) for k in range(runs)], unknown, clean, parted), strict=True
    )
    return np.array(linear), np.array(free)


def of_one_log(
    seed: tuple[int, int], unknown: Observation, clean: Motion, parted: Callable[[Motion], Any]
) -> list[np.ndarray]:
    truth, log = true_values(unknown), parted(noisy(clean, np.random.default_rng(seed)))
    rows = recorded(unknown, log, 2)
    data = assemble_regression(unknown, rows.base, [log], Decimation(2))
    both = (weighted_least_squares(data), instrumental_variables(data, rows))
    return [np.divide(*errors(found, unknown, truth)) for found in both]


def test_noisy_velocities_bias_least_squares_and_not_instrumental_variables(
    unknown: Observation, clean: Motion
) -> None:
    linear, free = scores(unknown, clean, 6)
    assert np.abs(linear.mean(axis=0)).max() > 5.0
    assert np.abs(free.mean(axis=0)).max() < 1.2
    assert np.mean(np.abs(linear) < 2.0) < 0.7
    assert np.mean(np.abs(free) < 2.0) > 0.93


@pytest.mark.slow
def test_intervals_of_instrumental_variables_cover(unknown: Observation, clean: Motion) -> None:
    """They are wider than needed: differences of positions are blue noise, of which the batches do not see all that cancels.

    What filter and central differences do to a motion at 100 Hz shifts the mean by half a standard deviation at most, noise or not.
    """
    linear, free = scores(unknown, clean, 60)
    print(
        f"scatter over reported {free.std(axis=0)}, mean {free.mean(axis=0)}, held {np.mean(np.abs(free) < 2.0):.3f}"
    )
    assert np.mean(np.abs(free) < 2.0) > 0.95 > np.mean(np.abs(linear) < 2.0)
    assert np.abs(free.mean(axis=0)).max() < 0.7
    assert 0.4 < free.std() < 1.0


def test_didim_with_the_true_controller_holds_the_truth(declared: Observation, clean: Motion) -> None:
    motion = noisy(clean, np.random.default_rng(4))
    rows = recorded(declared, motion, 2)
    data = assemble_regression(declared, rows.base, [motion], Decimation(2))
    error, std = errors(direct_and_inverse(data, rows), declared, true_values(declared))
    assert np.mean(np.abs(error / std) < 2.5) > 0.9
    linear, _ = errors(weighted_least_squares(data), declared, true_values(declared))
    inertia = 2
    assert abs(error[inertia]) < 0.1 * abs(linear[inertia])


def test_a_joint_that_never_moves_does_not_in_the_simulation(unknown: Observation, clean: Motion) -> None:
    """Its loads would push it about in a loop of finite gains, and the friction of that show in torques that no friction is in."""
    truth, elbow = true_values(unknown), np.array([0.0, 1.0])
    still = replace(clean, q=clean.q * elbow, dq=clean.dq * elbow, ddq=clean.ddq * elbow)
    still = recovery.driven(unknown, still, truth)
    rows = recorded(unknown, still, 2)
    data = assemble_regression(unknown, rows.base, [still], Decimation(2))
    found = direct_and_inverse(data, rows)
    seen = {name for name, known in zip(unknown.names, found.identifiable, strict=True) if known}
    assert not seen & {"shoulder.rotor_inertia", "shoulder.viscous", "shoulder.coulomb"}
    assert found.rank == weighted_least_squares(data).rank
    assert found.values["elbow.viscous"] == pytest.approx(1.0, abs=0.1)


def test_a_robot_that_cannot_be_simulated(unknown: Observation, clean: Motion) -> None:
    values = true_values(unknown)
    values[unknown.names.index("elbow.rotor_inertia")] = -5.0
    with refused("E-DYN-043"):
        list(SimulatedExperiment(unknown, values, clean, Decimation(2)).blocks())


def test_a_controller_that_does_not_hold_the_robot(tmp_path: Path, clean: Motion) -> None:
    weak = Observation(two_links(tmp_path, "controller: {kp: [0, 0], kd: [0, 0], rate_hz: 100}"), CLASSIC)
    values = true_values(weak)
    values[weak.names.index("shoulder.torque_offset")] = 30.0
    with refused("E-DYN-042"):
        list(SimulatedExperiment(weak, values, clean, Decimation(2)).blocks())


def test_it_starts_from_cad_where_no_robot_can_be_built_of_the_data(
    unknown: Observation, clean: Motion, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And ends where it does otherwise."""
    rows = recorded(unknown, clean.part(0, 800), 2)
    data = assemble_regression(unknown, rows.base, [clean.part(0, 800)], Decimation(2))
    usual = instrumental_variables(data, rows).parameters.coordinates()

    def refuse(data: RegressionData) -> Estimate:
        raise FlexcalError("E-TEST-001", "no physically feasible parameters were found.")

    monkeypatch.setattr(simulated_iteration, "feasible_least_squares", refuse)
    assert instrumental_variables(data, rows).parameters.coordinates() == pytest.approx(usual, abs=1e-8)


def test_short_parts_between_gaps_are_simulated_too(unknown: Observation, clean: Motion) -> None:
    """Of 1.5 s, where the low-pass of the path takes 2.3 s: noisy velocities bias least squares, and not instrumental variables."""

    def short(motion: Motion) -> Any:
        parts = [motion.part(first, first + 150) for first in range(0, len(motion) - 150, 160)]
        return divided(Motion.joined(parts), parts)

    linear, free = scores(unknown, clean, 4, seed=5, parted=short)
    assert np.abs(np.mean(linear, axis=0)).max() > 2.5
    assert np.abs(np.mean(free, axis=0)).max() < 1.2
    assert np.mean(np.abs(free) < 2.0) > 0.9


def test_friction_that_warms_up_does_not_begin_anew_after_a_gap(declared: Observation, clean: Motion) -> None:
    """The controller is given the torque of a warm robot beforehand; one that were cold again would stay behind its path."""
    warming = Observation(declared.model, (*CLASSIC, CoulombWarmUp(0.5)))
    size = {"shoulder.coulomb_warm_up": 8.0, "elbow.coulomb_warm_up": 8.0}
    known = dict(zip(declared.names, true_values(declared), strict=True)) | size
    truth = np.array([known[name] for name in warming.names])
    moved = recovery.driven(warming, clean, truth)
    parts = [moved.part(0, 700), moved.part(750, len(moved))]
    whole = Motion.joined(parts)
    log = divided(whole, parts)
    found = Motion.joined(SimulatedExperiment(warming, truth, log, Decimation(2)).blocks())
    after = (found.time > parts[1].time[0] + 0.3) & (found.time < parts[1].time[0] + 1.0)
    assert np.abs(found.q - whole.q)[after].max() < 1.5e-3
