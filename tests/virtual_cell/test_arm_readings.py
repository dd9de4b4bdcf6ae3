"""Sensors on the arm of the virtual cell: a nonlinear simulation in time against the linearised model's prediction."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from flexcal.data.plans import MultisinePlan
from flexcal.data.recordings import read_recording, write_recording
from flexcal.elasticity.time_periodic import ReferenceMotion, reference_shift
from flexcal.frequency.periodic import samples_per_period
from flexcal.model.robot import ArmSensor, RobotModel, SignalConfig
from flexcal.model.robot.measuring_config import ArmSensorConfig
from flexcal.model.vibration import linearise, transfer_matrix
from flexcal.units import DEGREE
from flexcal.virtual_cell import CellConfig, FrictionConfig, LoopConfig, SensorConfig, VirtualCell
from flexcal.virtual_cell.arm_sensor_readings import mounted, sensitivities

RATE_HZ, SEED = 1000.0, 3


@pytest.fixture(scope="module")
def sensing(tx90l: RobotModel) -> RobotModel:
    """Two accelerometers, a vibrometer and a displacement probe on a robot without friction or backlash."""
    config = ArmSensorConfig(frame="flange", xyz=(0.0, 0.0, 0.0), direction=(1.0, 0.0, 0.0))
    places = {
        "hand": (5, [0.03, 0.02, 0.05], [0.2, 0.3, 1.0], True, 2),
        "forearm": (3, [0.03, 0.12, 0.05], [1.0, 0.0, 0.0], True, 2),
        "beam": (5, [0.03, 0.02, 0.05], [0.3, 1.0, 0.2], False, 1),
        "probe": (2, [0.3, 0.02, 0.05], [0.3, 1.0, 0.2], False, 0),
    }
    sensors = {
        name: ArmSensor(name, joint, np.array(xyz), np.array(n) / np.linalg.norm(n), moves, order, config)
        for name, (joint, xyz, n, moves, order) in places.items()
    }
    slippery = {
        f"{joint}.{key}": 0.0 for joint in tx90l.joint_names for key in ("viscous", "coulomb", "backlash")
    }
    return replace(tx90l.with_values(slippery), sensors=sensors)


@pytest.fixture(scope="module")
def plan() -> MultisinePlan:
    lines = np.arange(3, 80, 4)
    return MultisinePlan(
        name="short",
        poses=np.array([[0, 45, 60, 20, 45, 0]]) * DEGREE,
        joints=(0, 1, 2),
        payload=6.0,
        base_frequency_hz=0.5,
        lines=2 * lines + 1,
        amplitude=np.outer([8.0, 8.0, 3.0], np.ones(len(lines))),
        periods=7,
        settle_periods=6,
        realisations=1,
        signs=False,
        reference_amplitude=0.0,
        reference_frequency_hz=0.0,
        kp=np.array([3000.0, 3000.0, 800.0, 300.0, 100.0, 60.0]),
        kd=np.array([400.0, 400.0, 100.0, 20.0, 8.0, 4.0]),
        rate_hz=RATE_HZ,
        torque="held",
        seed=3,
    )


EXACT = CellConfig(
    controller=LoopConfig(substeps=4),
    sensors=SensorConfig(0, False, 0.0, acceleration_noise=0.0, velocity_noise=0.0, displacement_noise=0.0),
    friction=FrictionConfig(scale=0.0),
)


def test_readings_follow_the_linearised_robot(sensing: RobotModel, plan: MultisinePlan) -> None:
    period = samples_per_period(plan.base_frequency_hz, 1 / RATE_HZ)
    torque, read, q = [], [], []
    for recording in VirtualCell(sensing, EXACT, SEED).record(plan):
        assert recording.sensors == ("hand", "forearm", "beam", "probe")
        last = slice(-period, None)
        torque.append(np.fft.rfft(recording.torque[last, :3], axis=0)[plan.lines])
        read.append(np.fft.rfft(recording.sensor_readings[last], axis=0)[plan.lines])
        q.append(recording.q[last].mean(axis=0))
    s = 2j * np.pi * plan.frequencies_hz
    held = -np.expm1(-s / RATE_HZ) / (s / RATE_HZ)
    measured = np.stack(read, axis=2) @ np.linalg.inv(held[:, None, None] * np.stack(torque, axis=2))
    system = linearise(sensing, np.mean(q, axis=0), plan.payload, sensors=mounted(sensing, SEED))
    expected = transfer_matrix(system, plan.frequencies_hz).response[:, 3:]
    expected = expected * sensitivities(tuple(sensing.sensors.values()), SEED)[:, None]
    off = np.linalg.norm(measured - expected, axis=2) / np.linalg.norm(expected, axis=2)
    assert np.median(off) < 3e-4 and off.max() < 3e-3, off


def test_readings_along_the_reference_motion(sensing: RobotModel, plan: MultisinePlan) -> None:
    """What a sensor sees of a displacement turns with the arm: a simulation in time that swings by 0.04 rad."""
    swaying = replace(plan, signs=True, reference_amplitude=0.04, reference_frequency_hz=1.75)
    period = 2 * samples_per_period(plan.base_frequency_hz, 1 / RATE_HZ)
    torque, read, q = [], [], []
    for recording in VirtualCell(sensing, EXACT, SEED).record(swaying):
        last = slice(-period, None)
        torque.append(np.fft.rfft(recording.torque[last, :3], axis=0)[2 * plan.lines])
        read.append(np.fft.rfft(recording.sensor_readings[last], axis=0)[2 * plan.lines])
        q.append(recording.q[last].mean(axis=0))
    torque, read = (
        [(up - down) / 2 for up, down in zip(x[::2], x[1::2], strict=True)] for x in (torque, read)
    )
    s = 2j * np.pi * plan.frequencies_hz
    held = -np.expm1(-s / RATE_HZ) / (s / RATE_HZ)
    measured = np.stack(read, axis=2) @ np.linalg.inv(held[:, None, None] * np.stack(torque, axis=2))
    at, sensors, gains = (
        np.mean(q, axis=0),
        mounted(sensing, SEED),
        sensitivities(mounted(sensing, SEED), SEED),
    )
    still = transfer_matrix(
        linearise(sensing, at, plan.payload, sensors=sensors), plan.frequencies_hz
    ).response
    motion = ReferenceMotion.of(swaying)
    shift = reference_shift(sensing, at, plan.payload, plan.frequencies_hz, motion, sensors=sensors)
    size = np.linalg.norm(still[:, 3:], axis=2)
    off, off_still = (
        np.linalg.norm(measured / gains[:, None] - expected[:, 3:], axis=2) / size
        for expected in (still + shift, still)
    )
    assert (np.median(off, axis=0) < 1e-3).all(), off
    assert (np.median(off_still, axis=0) > 2e-3).all(), off_still


def test_readings_have_their_noise_and_round_trip(
    sensing: RobotModel, plan: MultisinePlan, tmp_path: Path
) -> None:
    short = replace(plan, periods=1, settle_periods=0)
    quiet = SensorConfig(acceleration_noise=0.0, velocity_noise=0.0, displacement_noise=0.0)
    pairs = [
        next(VirtualCell(sensing, CellConfig(sensors=s), SEED).record(short)) for s in (SensorConfig(), quiet)
    ]
    noise = (pairs[0].sensor_readings - pairs[1].sensor_readings).std(axis=0)
    np.testing.assert_allclose(noise, [0.02, 0.02, 5e-5, 1e-6], rtol=0.1)
    assert pairs[1].sensor_readings[:, 0].mean() == pytest.approx(9.81 * _upwards(sensing, plan), rel=0.05)
    for name in ("log.csv", "log.parquet"):
        write_recording(tmp_path / name, pairs[0])
        back = read_recording(tmp_path / name, sensing)
        assert back.sensors == pairs[0].sensors
        np.testing.assert_allclose(back.sensor_readings, pairs[0].sensor_readings, rtol=1e-9, atol=1e-12)


def _upwards(model: RobotModel, plan: MultisinePlan) -> float:
    """Cosine of the direction of `hand` to the vertical, from the nominal kinematics."""
    from flexcal.model.vibration import ElasticArm

    arm = ElasticArm(model, 0.0)
    sensor = model.sensors["hand"]
    _, turn = arm.place(arm.configuration(plan.poses[0], np.zeros((model.n, 3))), sensor.joint, sensor.xyz)
    return float((turn @ sensor.direction)[2])


def test_readings_in_g_under_another_name(sensing: RobotModel, plan: MultisinePlan, tmp_path: Path) -> None:
    recording = next(
        VirtualCell(sensing, CellConfig(), SEED).record(replace(plan, periods=1, settle_periods=0))
    )
    write_recording(tmp_path / "log.csv", recording)
    table = pl.read_csv(tmp_path / "log.csv").with_columns((pl.col("sensor_hand") / 9.80665).alias("ai3"))
    table.drop("sensor_hand", "sensor_beam").write_csv(tmp_path / "log.csv")
    mapped = {"sensor_hand": SignalConfig(("ai3",), "g")}
    model = replace(sensing, config=replace(sensing.config, signals=mapped))
    back = read_recording(tmp_path / "log.csv", model)
    assert back.sensors == ("hand", "forearm", "probe")
    np.testing.assert_allclose(back.sensor_readings[:, 0], recording.sensor_readings[:, 0], rtol=1e-9)
