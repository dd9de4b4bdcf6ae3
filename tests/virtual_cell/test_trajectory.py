"""Exciting trajectories on the virtual robot: MuJoCo's torques against Pinocchio's, the log's form, what a seed decides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from flexcal.data.plans import FourierPaths, TrajectoryPlan
from flexcal.model.robot import RobotModel
from flexcal.model.vibration import periodic_torque
from flexcal.virtual_cell import CellConfig, FrictionConfig, SensorConfig, VirtualCell

IDEAL = CellConfig(sensors=SensorConfig(encoder_counts=0, torque_noise=0.0))


@pytest.fixture(scope="module")
def plan(tx90l: RobotModel) -> TrajectoryPlan:
    """One slow trajectory of all joints, two periods of two seconds."""
    rng = np.random.default_rng(2)
    controller = tx90l.controller
    assert controller is not None
    return TrajectoryPlan(
        name="slow",
        paths=FourierPaths(
            centre=np.array([[0.0, 0.4, 0.8, 0.0, 0.5, 0.0]]),
            sine=0.3 * rng.normal(size=(1, 6, 2)),
            cosine=0.3 * rng.normal(size=(1, 6, 2)),
        ),
        payload=0.0,
        base_frequency_hz=0.5,
        periods=2,
        settle_periods=1,
        kp=np.array(controller.kp),
        kd=np.array(controller.kd),
        rate_hz=4000.0,
        torque="held",
        seed=0,
    )


@pytest.mark.parametrize("payload", [0.0, 6.0])
def test_torques_are_those_of_the_elastic_robot(
    tx90l: RobotModel, plan: TrajectoryPlan, payload: float
) -> None:
    """MuJoCo, stepped in closed loop, against Pinocchio with springs that yield to their load: no friction, no gaps, ideal sensors."""
    smooth = replace(IDEAL, friction=FrictionConfig(scale=0.0))
    (recording,) = VirtualCell(tx90l, smooth).record(replace(plan, payload=payload))
    kept = slice(plan.samples_per_period, None, 80)
    q = recording.q[plan.samples_per_period :: 80]
    spectrum = np.fft.rfft(q, axis=0)
    spectrum[12:] = 0
    omega = 2j * np.pi * 0.5 * np.arange(len(spectrum))[:, None]
    q, dq, ddq = (np.fft.irfft(spectrum * omega**order, n=len(q), axis=0) for order in range(3))
    expected = periodic_torque(tx90l, q, dq, ddq, 2.0, payload) + tx90l.drives.rotor_inertia * ddq
    worst = np.abs(recording.torque[kept] - expected).max(axis=0)
    assert (worst < 0.01 * np.abs(expected).max(axis=0) + 0.05).all(), worst


def test_the_log_follows_the_plan(tx90l: RobotModel, plan: TrajectoryPlan) -> None:
    (recording,) = VirtualCell(tx90l, seed=3).record(plan)
    (again,) = VirtualCell(tx90l, seed=3).record(plan)
    (other,) = VirtualCell(tx90l, seed=4).record(plan)
    assert len(recording) == plan.periods * plan.samples_per_period
    wanted = plan.motion(0, recording.time)[0]
    assert np.abs(recording.q - wanted).max() < 0.01
    np.testing.assert_array_equal(recording.torque, again.torque)
    assert np.std(recording.torque - other.torque) == pytest.approx(np.sqrt(2.0), rel=0.05)
    assert recording.label is not None and recording.label.name == "pose_1_realisation_1_experiment_1_plus"


def test_what_the_cell_cannot_do_is_said(tx90l: RobotModel, plan: TrajectoryPlan) -> None:
    with refused("E-CELL-028"):
        list(VirtualCell(tx90l).record(replace(plan, torque="instantaneous")))
    narrow = replace(
        plan,
        paths=FourierPaths.of_coefficients(plan.paths.coefficients[:, :, :3]),
        kp=plan.kp[:3],
        kd=plan.kd[:3],
    )
    with refused("E-CELL-013", "3"):
        VirtualCell(tx90l).record(narrow)
