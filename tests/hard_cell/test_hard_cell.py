"""What the hard cell measures and records."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import flexcal.hard_cell
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.experiments import Cell
from flexcal.data.plans import MultisinePlan, PosePlan
from flexcal.hard_cell import HardCell, counterparts, draw_robot, read_description
from flexcal.hard_cell.true_parameters import ideal_robot
from flexcal.jobs.experiments import frequency_plan
from flexcal.jobs.two_stage.cells import open_cell
from flexcal.model.robot import RobotModel


@pytest.fixture(scope="module")
def robot(examples: Path) -> Path:
    return examples / "tx90l" / "robot.yaml"


@pytest.fixture(scope="module")
def plan(robot: Path, tx90l: RobotModel) -> MultisinePlan:
    """Six recordings of a quarter of the length, in one pose."""
    whole = frequency_plan(tx90l, robot.parent / "frequency_poses.csv", "default", 1)
    return replace(whole, poses=whole.poses[:1], realisations=1, periods=1, settle_periods=0)


def anywhere(count: int, seed: int = 0) -> PosePlan:
    return PosePlan(np.random.default_rng(seed).uniform(-1.2, 1.2, (count, 6)))


def test_it_shares_no_robot_with_the_identification() -> None:
    """Of the model it takes the words of robot.yaml and the refusal of what is no URDF; nothing of export and virtual cell."""
    folder = Path(flexcal.hard_cell.__file__).parent
    taken, names = set(), set()
    for file in folder.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("flexcal"):
                taken.add(node.module)
                names |= {alias.name for alias in node.names if node.module.startswith("flexcal.model")}
            assert not isinstance(node, ast.Import) or "flexcal" not in {a.name for a in node.names}
    known = {
        "flexcal",
        "flexcal.data.experiments",
        "flexcal.data.plans",
        "flexcal.data.poses",
        "flexcal.data.recordings",
        "flexcal.errors",
        "flexcal.files.formats",
        "flexcal.files.transaction",
        "flexcal.frequency.periodic",
        "flexcal.model.robot",
        "flexcal.model.urdf",
        "flexcal.mujoco_library",
    }
    assert {name for name in taken if ".hard_cell" not in name} <= known
    assert names == {"RobotConfig", "read_elements"}


def test_it_is_a_cell(robot: Path) -> None:
    assert isinstance(HardCell.drawn(robot), Cell)


@pytest.mark.parametrize("before", [True, False])
def test_without_errors_its_points_are_those_of_the_model(
    robot: Path, tx90l: RobotModel, before: bool
) -> None:
    """Two ways to the same robot: MuJoCo's bodies from the hard cell's description, and the model's kinematics and equilibrium."""
    described = read_description(robot)
    cell = HardCell(ideal_robot(described, bearings_before=before), described)
    poses = anywhere(20)
    predicted = predict_measurements(
        tx90l.with_bearings("before" if before else "after"), replace(cell.measure(poses), q=poses.q)
    ).position
    np.testing.assert_allclose(cell.noise_free(poses), predicted, atol=2e-6)


def test_points_scatter_by_the_repeatability_and_the_tracker(robot: Path) -> None:
    """Many visits to one pose; the stated noise is off by the factor that was drawn."""
    cell = HardCell.drawn(robot, 3)
    calm = replace(cell.robot, expansion=np.zeros_like(cell.robot.expansion), hysteresis=np.zeros(6))
    cell = HardCell(calm, cell.described, 3)
    visits = PosePlan(np.tile([0.0, 1.5, 0, 0, 0, 0], (400, 1)))
    seen = cell.measure(visits)
    off = seen.position - cell.noise_free(visits)
    distance = np.linalg.norm(cell.noise_free(visits)[0])
    tracker = 5e-6**2 + 2 * (12e-6 + 6e-6 * distance) ** 2
    expected = np.sqrt(calm.repeatability**2 + tracker)
    assert np.sqrt((off**2).sum(axis=1).mean()) == pytest.approx(expected, rel=0.15)
    assert seen.sigma[0, 0] == pytest.approx(calm.sigma_factor * (15e-6 + 6e-6 * distance), rel=1e-3)
    assert 0.2 <= calm.sigma_factor <= 5


def test_torques_at_rest_are_gravity_within_friction(robot: Path, tx90l: RobotModel) -> None:
    cell = HardCell.drawn(robot, 5)
    poses = anywhere(60)
    torque = cell.measure(poses).torque
    free = replace(
        cell.robot,
        arm=replace(cell.robot.arm, coulomb=np.zeros(6)),
        stribeck=np.zeros(6),
        per_load=np.zeros(6),
    )
    gravity = HardCell(free, cell.described, 5).measure(poses).torque
    assert torque is not None and gravity is not None
    level = cell.robot.arm.coulomb + cell.robot.stribeck + cell.robot.per_load * np.abs(gravity)
    assert (np.abs(torque - gravity) < 1.1 * level + 8).all()
    assert (np.abs(torque - gravity).max(axis=0) > 0.8 * cell.robot.arm.coulomb).all()


def test_a_recording_does_not_depend_on_threads_and_differs_by_seed(robot: Path, plan: MultisinePlan) -> None:
    one, two = HardCell.drawn(robot, 1), HardCell.drawn(robot, 1)
    one.threads, two.threads = 1, 2
    first, second = list(one.record(plan)), list(two.record(plan))
    assert len(first) == 6
    for a, b in zip(first, second, strict=True):
        assert a.label == b.label
        np.testing.assert_array_equal(a.q, b.q)
        np.testing.assert_array_equal(a.torque, b.torque)
    assert np.abs(next(iter(HardCell.drawn(robot, 2).record(plan))).q - first[0].q).max() > 1e-4


def test_braked_joints_stand_still_and_read_no_torque(robot: Path, plan: MultisinePlan) -> None:
    recording = next(iter(HardCell.drawn(robot, 1).record(plan)))
    assert np.ptp(recording.q[:, 3:], axis=0).max() == 0.0
    assert not recording.torque[:, 3:].any()
    assert (np.ptp(recording.q[:, :3], axis=0) > 0.02).all()


def test_drawn_links_err_in_shape_independently_of_mass(robot: Path) -> None:
    """Over robots: the inertia's spread is not the mass's, every body can exist, and both bearings come up."""
    described = read_description(robot)
    drawn = [draw_robot(described, np.random.default_rng(seed)) for seed in range(60)]
    mass = np.array([r.arm.links[1].mass / described.links[1].mass for r in drawn])
    shape = np.array([np.trace(r.arm.links[1].inertia) / np.trace(described.links[1].inertia) for r in drawn])
    assert abs(np.corrcoef(mass, shape)[0, 1]) < 0.35
    assert 0.05 < mass.std() < 0.09 and shape.std() > 0.04
    for r in drawn:
        for link in r.arm.links:
            moments = np.linalg.eigvalsh(link.inertia)
            assert link.mass == 0 or (moments[0] > 0 and moments[2] < moments[0] + moments[1])
    assert {r.bearings_before for r in drawn} == {True, False}


def test_gears_have_loops_of_a_tenth_to_one_arc_minute(robot: Path) -> None:
    described = read_description(robot)
    drawn = [draw_robot(described, np.random.default_rng(seed)) for seed in range(60)]
    full = np.degrees(2 * np.array([r.hysteresis for r in drawn])) * 60
    assert 0.1 < full.min() < 0.13 and 0.8 < full.max() < 1.0
    assert np.median(full) == pytest.approx(0.32, rel=0.15)
    share = np.array([r.hysteresis / r.slip_twist for r in drawn])
    assert share.min() > 0.1 and share.max() < 0.5


def test_counterparts_are_parameters_of_the_model(robot: Path, tx90l: RobotModel) -> None:
    cell = HardCell.drawn(robot, 1)
    values = counterparts(cell.robot)
    assert set(values) <= set(tx90l.with_drive_springs(dict.fromkeys((3, 4, 5), (1e5, 10.0))).values)
    assert sum(name.endswith(".stiffness") for name in values) == 12
    assert not any("length" in name or "angle" in name for name in values)


def test_what_it_cannot_be_is_said(robot: Path, tx90l: RobotModel, tmp_path: Path) -> None:
    with refused("E-RUN-093"):
        open_cell("hard", robot, tx90l, truth=robot, hidden=tmp_path / "truth.yaml", seed=1)
    with refused("E-CELL-003", "5"):
        HardCell.drawn(robot).measure(PosePlan(np.zeros((1, 5))))
