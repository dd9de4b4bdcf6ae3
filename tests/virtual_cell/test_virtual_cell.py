"""The virtual cell as a whole: what it measures against the model, its signs, its randomness, its speed-ups."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.data.experiments import Cell
from flexcal.data.plans import MultisinePlan, PosePlan
from flexcal.files.formats import read_yaml
from flexcal.frequency.periodic import odd_lines
from flexcal.model.kinematics import point_kinematics
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium
from flexcal.units import DEGREE
from flexcal.virtual_cell import (
    CellConfig,
    FrictionConfig,
    LoopConfig,
    MismatchConfig,
    SensorConfig,
    SpreadConfig,
    VirtualCell,
    draw_truth,
)

pytest.importorskip("mujoco")

RESOLUTION = 2 * np.pi / 2**18


@pytest.fixture
def truth(tx90l: RobotModel, rng: np.random.Generator) -> RobotModel:
    return tx90l.with_values(draw_truth(tx90l, SpreadConfig(), rng))


@pytest.fixture
def plan() -> MultisinePlan:
    """Two poses, one short period of 1 s, three axes."""
    lines = odd_lines(1.0, 3.0, 80.0)
    return MultisinePlan(
        name="short",
        poses=np.array([[0, 60, -105, 80, 67, 0], [0, 45, 60, 0, 45, 0]]) * DEGREE,
        joints=(0, 1, 2),
        payload=6.0,
        base_frequency_hz=1.0,
        lines=lines,
        amplitude=np.outer([8.0, 8.0, 3.0], np.ones(len(lines))),
        periods=2,
        settle_periods=1,
        realisations=1,
        signs=True,
        reference_amplitude=1.5 * DEGREE,
        reference_frequency_hz=2.5,
        kp=np.array([3000.0, 3000.0, 800.0, 300.0, 100.0, 60.0]),
        kd=np.array([400.0, 400.0, 100.0, 20.0, 8.0, 4.0]),
        rate_hz=4000.0,
        torque="held",
        seed=3,
    )


def poses(rng: np.random.Generator, count: int = 20) -> PosePlan:
    return PosePlan(q=rng.uniform(-1.2, 1.2, (count, 6)), payload=None, seed=7)


def model_positions(truth: RobotModel, q: np.ndarray, payload: np.ndarray | None) -> np.ndarray:
    rest = static_equilibrium(truth, q, payload)
    return truth.stations.pose[0, :3] + point_kinematics(truth, q, rest.deflection, jacobians=False).position


def test_it_is_a_cell(tx90l: RobotModel) -> None:
    assert isinstance(VirtualCell(tx90l), Cell)


@pytest.mark.parametrize("payload", [None, 0.0, 6.0])
def test_rest_poses_are_the_models(
    truth: RobotModel, rng: np.random.Generator, payload: float | None
) -> None:
    plan = replace(poses(rng), payload=None if payload is None else np.full(20, payload))
    found = VirtualCell(truth).noise_free(plan)
    np.testing.assert_allclose(found, model_positions(truth, plan.q, plan.payload), atol=1e-12)


def test_backlash_lets_the_arm_sag_in_the_direction_of_gravity(tx90l: RobotModel) -> None:
    """q_arm = q_M − b sign τ − τ/c with τ of the motor on the arm: a gap lowers the tool whatever side the arm hangs on."""
    gap = 1e-4
    loose = tx90l.with_values({"joint_2.backlash": gap})
    for side in (1, -1):
        plan = PosePlan(q=np.array([[0, side * 60, 0, 0, 0, 0]]) * DEGREE, payload=None, seed=0)
        tight_point, loose_point = (VirtualCell(m).noise_free(plan)[0] for m in (tx90l, loose))
        lever = side * (tight_point[0] - 0.05)
        assert lever > 0.5
        assert loose_point[2] - tight_point[2] == pytest.approx(-gap * lever, rel=1e-2)
        torque = VirtualCell(
            loose, CellConfig(sensors=SensorConfig(torque_noise=0), friction=FrictionConfig(scale=0))
        )
        assert np.sign(torque.measure(plan).torque[0, 1]) == -side


def test_instruments_read_with_their_noise(truth: RobotModel, rng: np.random.Generator) -> None:
    plan = poses(rng, 400)
    cell = VirtualCell(truth, seed=4)
    seen, true = cell.measure(plan), cell.noise_free(plan)
    assert np.abs(seen.q - plan.q).max() <= RESOLUTION / 2 * (1 + 1e-9)
    np.testing.assert_allclose(seen.q / RESOLUTION, np.rint(seen.q / RESOLUTION), atol=1e-6)
    stand = truth.stations.pose[0, :3] + vector_rotation(truth.stations.pose[0, 3:]) @ [2.5, 0, 1]
    measured = np.linalg.norm(seen.position - stand, axis=1)  # the tracker knows no other distance
    np.testing.assert_allclose(
        seen.sigma, np.repeat((15e-6 + 6e-6 * measured)[:, None], 3, axis=1), rtol=1e-12
    )
    assert np.std((seen.position - true) / seen.sigma) == pytest.approx(1, abs=0.08)
    gravity = static_equilibrium(truth, plan.q, None).torque
    spread = (seen.torque - gravity).std(0)
    np.testing.assert_allclose(spread, np.sqrt(truth.drives.coulomb**2 / 3 + 1), rtol=0.1)


def test_what_is_measured_depends_on_the_seed_alone(truth: RobotModel, rng: np.random.Generator) -> None:
    plan = poses(rng)
    first, again, other = (VirtualCell(truth, seed=seed).measure(plan) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.position, again.position)
    np.testing.assert_array_equal(first.torque, again.torque)
    assert np.all(first.position != other.position)


def test_recordings_are_in_order_and_depend_on_the_seed_alone(truth: RobotModel, plan: MultisinePlan) -> None:
    alone = list(VirtualCell(truth, seed=1, threads=1).record(plan))
    shared = list(VirtualCell(truth, seed=1, threads=3).record(plan))
    keys = [(r.label.pose, r.label.realisation, r.label.experiment, r.label.sign) for r in alone if r.label]
    assert keys == [(p, 0, e, s) for p in (0, 1) for e in (0, 1, 2) for s in (1, -1)]
    for one, other in zip(alone, shared, strict=True):
        assert one.label == other.label
        np.testing.assert_array_equal(one.q, other.q)
        np.testing.assert_array_equal(one.torque, other.torque)


def test_a_recording_follows_its_plan(truth: RobotModel, plan: MultisinePlan) -> None:
    recording = next(iter(VirtualCell(truth, controller_model=truth).record(plan)))
    assert len(recording) == 8000 and recording.time_step == 0.25e-3
    np.testing.assert_allclose(recording.q / RESOLUTION, np.rint(recording.q / RESOLUTION), atol=1e-6)
    assert np.ptp(recording.q[:, 3:], axis=0).max() == 0
    assert np.abs(recording.torque[:, 3:]).max() == 0
    motion = np.ptp(recording.q[:, :3], axis=0)
    np.testing.assert_allclose(motion, 3 * DEGREE, rtol=0.15)
    np.testing.assert_allclose(recording.q[:, :3].mean(0), plan.poses[0, :3], atol=0.2 * DEGREE)


def test_the_soft_loop_droops_when_its_model_is_wrong(
    tx90l: RobotModel, truth: RobotModel, plan: MultisinePlan
) -> None:
    recording = next(iter(VirtualCell(truth, controller_model=tx90l).record(plan)))
    droop = np.abs(recording.q[4000:, :3].mean(0) - plan.poses[0, :3])
    assert 0.02 * DEGREE < droop.max() < 3 * DEGREE


def test_arm_encoders_show_the_twist(truth: RobotModel, plan: MultisinePlan) -> None:
    config = CellConfig(sensors=SensorConfig(arm_encoders=True, encoder_counts=0))
    still = replace(plan, reference_amplitude=0.0)
    recording = next(iter(VirtualCell(truth, config).record(still)))
    assert recording.arm is not None
    twist = (recording.arm - recording.q)[4000:].mean(0)
    rest = static_equilibrium(truth, plan.poses[:1], 6.0)
    np.testing.assert_allclose(twist[:3], rest.deflection[0, :3, 2], atol=2e-5)


def test_mismatch_moves_what_is_measured(truth: RobotModel, rng: np.random.Generator) -> None:
    plan = poses(rng)
    exact = VirtualCell(truth).noise_free(plan)
    for mismatch in (
        MismatchConfig(cubic_stiffness=0.1),
        MismatchConfig(elastic_wrist=30e3),
    ):
        moved = np.linalg.norm(
            VirtualCell(truth, CellConfig(mismatch=mismatch)).noise_free(plan) - exact, axis=1
        )
        assert 5e-6 < moved.max() < 1e-3
    sensors = SensorConfig(encoder_counts=0, tracker_noise_m=0, tracker_noise_per_m=0)
    for mismatch, size in (
        (MismatchConfig(hysteresis=5e-5), 5e-5),
        (MismatchConfig(repeatability=35e-6), 35e-6),
        (MismatchConfig(temperature_drift=1e-4), 1e-4),
        (MismatchConfig(link_growth=1e-5, temperature_profile="cycling"), 1e-4),
        (MismatchConfig(zero_drift=1e-5, temperature_profile="warming"), 1e-4),
    ):
        seen = VirtualCell(truth, CellConfig(sensors=sensors, mismatch=mismatch)).measure(plan)
        largest = np.linalg.norm(seen.position - exact, axis=1).max()
        assert 0.3 * size < largest < 4 * size


def test_every_mismatch_can_be_recorded(truth: RobotModel, plan: MultisinePlan) -> None:
    plain = next(iter(VirtualCell(truth).record(plan)))
    for mismatch in (
        MismatchConfig(cubic_stiffness=0.1),
        MismatchConfig(hysteresis=5e-5),
        MismatchConfig(elastic_wrist=30e3),
    ):
        recording = next(iter(VirtualCell(truth, CellConfig(mismatch=mismatch)).record(plan)))
        assert np.isfinite(recording.q).all()
        assert np.abs(recording.q - plain.q).max() > RESOLUTION


def test_a_slow_loop_gets_more_plant_steps(truth: RobotModel, plan: MultisinePlan) -> None:
    slow = replace(plan, rate_hz=1000.0)
    quick = VirtualCell(truth, CellConfig(controller=LoopConfig(substeps=4)), seed=1)
    np.testing.assert_array_equal(
        next(iter(quick.record(slow))).q, next(iter(VirtualCell(truth, seed=1).record(slow))).q
    )


def test_plans_for_another_robot_or_torque_are_refused(truth: RobotModel, plan: MultisinePlan) -> None:
    cell = VirtualCell(truth)
    with refused("E-CELL-013", "5", "tx90l", "6"):
        cell.measure(PosePlan(q=np.zeros((1, 5))))
    with refused("E-CELL-024"):
        next(iter(cell.record(replace(plan, torque="instantaneous"))))


def test_truths_are_spread_as_declared(tx90l: RobotModel) -> None:
    draws = [draw_truth(tx90l, SpreadConfig(), np.random.default_rng(seed)) for seed in range(300)]
    table = {name: np.array([draw[name] for draw in draws]) for name in draws[0]}
    geometric = [n for n in table if "backlash" in n or n.startswith(("tool", "station")) or ".length_" in n]
    geometric += [
        n
        for n in table
        if n.startswith("joint") and n.endswith(("offset", "misalignment_1", "misalignment_2"))
    ]
    assert len(geometric) == 47
    assert np.std(table["link_3.mass"]) / tx90l.value("link_3.mass") == pytest.approx(0.07, rel=0.15)
    assert np.std(table["link_3.com_x"]) == pytest.approx(0.010, rel=0.15)
    assert np.std(table["joint_2.length_y"]) == pytest.approx(3e-4, rel=0.15)
    assert np.std(table["tool.misalignment_1"]) == pytest.approx(5e-4, rel=0.15)
    assert np.std(np.log(table["joint_1.drive.stiffness"])) == pytest.approx(0.15, rel=0.15)
    assert 2e-5 <= table["joint_3.backlash"].min() < table["joint_3.backlash"].max() <= 5e-5
    assert "joint_1.backlash" not in table


def test_cell_yaml_is_read_strictly(tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text("sensors: {torque_noise: 2, encoder_counts: 0}\nmismatch: {repeatability: 35e-6}\n")
    config = read_yaml(file, CellConfig)
    assert (config.sensors.torque_noise, config.mismatch.repeatability) == (2.0, 35e-6)
    file.write_text("sensors:\n  torque_noise: -1\n")
    with refused("E-CELL-016", "torque_noise"):
        read_yaml(file, CellConfig)
    file.write_text("spread: {backlash: [5e-5, 2e-5]}\n")
    with refused("E-CELL-020"):
        read_yaml(file, CellConfig)
