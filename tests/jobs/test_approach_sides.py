"""Gears with hysteresis: poses approached from one side, from both, and a program that comes from the other one.

The arm is one of Denavit-Hartenberg rows whose joints lag behind their motors by half a width each; it shares nothing with flexcal.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm, postures, rz, write_robot
from over_seeds import over_seeds
from refusals import refused

from flexcal import (
    PoseRequest,
    PoseSet,
    RobotModel,
    calibrate,
    compensate,
    design_poses,
    predict,
    read_poses,
    read_targets,
    recheck,
    verify,
)
from flexcal.calibration.measurement import predict_measurements, propagation
from flexcal.calibration.verification import prediction_errors, prediction_errors_with_covariance
from flexcal.data.experiments import FolderCell, write_measured_poses
from flexcal.data.plans import PosePlan, read_plan, write_plan
from flexcal.data.poses import concatenate, write_poses
from flexcal.design.poses import crossed_approaches
from flexcal.design.scene import CollisionChecker
from flexcal.jobs.calibration import Calibration
from flexcal.virtual_cell import CellConfig, MismatchConfig, VirtualCell

SIGMA, REPEATABILITY = 15e-6, 10e-6
NAMES = [f"joint_{k}.hysteresis" for k in range(1, 7)]


@dataclass(frozen=True)
class LaggingArm:
    """An arm whose joints stand at q − side · half, before a tracker."""

    arm: DHArm
    half: np.ndarray
    place: np.ndarray
    rng: np.random.Generator

    @classmethod
    def made(cls, seed: int) -> LaggingArm:
        """An arm with half widths of 15 to 145 µrad, equally likely by their logarithm, as catalogues of gears have them."""
        rng = np.random.default_rng([46, seed])
        place = rz(rng.uniform(-3, 3))
        place[:3, 3] = rng.normal(size=3) + np.array([2.0, 0.0, 0.0])
        return cls(DHArm.made(seed), np.exp(rng.uniform(np.log(15e-6), np.log(145e-6), 6)), place, rng)

    def measured(self, q: np.ndarray, side: np.ndarray, *, said: bool = True) -> PoseSet:
        """Points at poses approached from a side (N, 6), which the column says or not."""
        stands = q - side * self.half + REPEATABILITY * self.rng.normal(size=q.shape)
        xyz = self.arm.points(stands) @ self.place[:3, :3].T + self.place[:3, 3]
        poses = PoseSet.unmeasured(q, "smr", "station", SIGMA)
        xyz = xyz + SIGMA * self.rng.normal(size=xyz.shape)
        return replace(poses, position=xyz, approach=side * 1.0 if said else None)

    def sides(self, count: int) -> np.ndarray:
        """Sides at random."""
        return self.rng.choice([-1.0, 1.0], (count, 6))


def calibrated(poses: PoseSet) -> Calibration:
    with tempfile.TemporaryDirectory() as folder:
        model = RobotModel.from_yaml(write_robot(Path(folder)))
        return calibrate(model, seen_from(model, poses), terms=["kinematic"])


def seen_from(model: RobotModel, poses: PoseSet) -> PoseSet:
    """Poses measured from the robot's station."""
    return replace(poses, station=np.full(len(poses), model.stations.names[0]))


def elsewhere(arm: LaggingArm, found: Calibration, side: np.ndarray, *, said: bool) -> tuple[float, float]:
    """Mean squares of observed and predicted errors, m², of a program that comes from a side."""
    q = postures(arm.rng, len(side))
    poses = seen_from(found.model, arm.measured(q, side, said=said))
    errors = prediction_errors(found.model, poses)
    return float((errors.errors**2).sum(axis=1).mean()), float((errors.expected_rms**2).mean())


def from_one_side(seed: int) -> tuple[list[tuple[float, float]], dict, Sequence[str]]:
    arm = LaggingArm.made(seed)
    found = calibrated(arm.measured(postures(arm.rng, 50), np.ones((50, 6))))
    same, other = np.ones((60, 6)), -np.ones((60, 6))
    ways = [(same, True), (other, True), (arm.sides(60), True), (arm.sides(60), False)]
    document = found.document()
    return [elsewhere(arm, found, side, said=said) for side, said in ways], document, document["remarks"]


def test_a_side_that_no_pose_came_from_is_in_every_prediction_for_it() -> None:
    """Eight robots: poses as measured are predicted to their scatter, and those from the other side are 4 to 10 times as far off, which
    the prediction knows, whether or not the program says from where it comes.
    """
    results = [from_one_side(seed) for seed in range(8)]
    observed, predicted = np.array([r[0] for r in results]).mean(axis=0).T
    ratio = np.sqrt(observed / predicted)
    assert np.sqrt(observed[1] / predicted[0]) > 4
    assert 0.9 < ratio[0] < 1.1
    assert (np.abs(np.log(ratio[1:])) < np.log(1.35)).all()
    for _, document, remarks in results:
        approach = document["approach"]
        assert approach["one_side"] == [f"joint_{k}" for k in range(1, 7)]
        assert not any(document["parameters"][name]["identifiable"] for name in NAMES)
        (sentence,) = [r for r in remarks if "came from one side at all poses" in r]
        assert f"{approach['other_side_mm']:.2g} mm" in sentence
    # what the sentence says is what the points move by
    moved = np.sqrt(np.maximum(observed[1] - observed[0], 0.0))
    said = np.sqrt(np.mean([r[1]["approach"]["other_side_mm"] ** 2 for r in results])) * 1e-3
    assert said == pytest.approx(moved, rel=0.35)


def test_without_the_column_a_sentence_says_what_one_side_would_mean() -> None:
    arm = LaggingArm.made(3)
    q, side = postures(arm.rng, 50), np.ones((50, 6))
    poses = arm.measured(q, side, said=False)
    found = calibrated(poses)
    again = calibrated(replace(poses, approach=side * 0.0))
    assert NAMES[0] not in found.estimate.parameters
    assert again.estimate.parameters.names == found.estimate.parameters.names
    for each in (found, again):
        approach = each.document()["approach"]
        assert len(approach["unknown"]) == 6
        (sentence,) = [r for r in each.document()["remarks"] if "do not say from which side" in r]
        assert f"{approach['other_side_mm']:.2g} mm" in sentence
        assert "straight from row to row, they came from both" in sentence
    swept = calibrated(poses.subset(np.argsort(q[:, 1]))).document()["remarks"]
    assert not any("straight from row to row" in r for r in swept)
    observed, predicted = elsewhere(arm, found, side, said=False)
    assert np.sqrt(observed / predicted) == pytest.approx(1.0, rel=0.2)


def from_both_sides(seed: int) -> tuple[np.ndarray, np.ndarray, list[tuple[float, float]]]:
    arm = LaggingArm.made(seed)
    found = calibrated(arm.measured(postures(arm.rng, 50), arm.sides(50)))
    estimate = found.estimate
    number = [estimate.parameters.index(name) for name in NAMES]
    std = np.sqrt(np.diag(estimate.covariance)[number])
    score = (np.array([estimate.values[name] for name in NAMES]) - arm.half) / std
    ways = [(np.ones((60, 6)), True), (arm.sides(60), True), (arm.sides(60), False)]
    return score, std, [elsewhere(arm, found, side, said=said) for side, said in ways]


def check_both_sides(results: Sequence[tuple[np.ndarray, np.ndarray, list[tuple[float, float]]]]) -> None:
    score, std = (np.concatenate([r[k] for r in results]) for k in (0, 1))
    assert np.sqrt(np.mean(score**2)) < 1.3
    assert np.median(std) < 10e-6
    observed, predicted = np.array([r[2] for r in results]).mean(axis=0).T
    assert np.sqrt(observed / predicted) == pytest.approx(1.0, rel=0.15)


def test_both_sides_tell_the_half_widths() -> None:
    check_both_sides([from_both_sides(seed) for seed in range(10)])


@pytest.mark.statistical
def test_intervals_of_half_widths_hold() -> None:
    """40 robots of six joints: 95 % intervals of the half widths."""
    results = over_seeds(from_both_sides, range(100, 140))
    check_both_sides(results)
    inside = np.mean(np.abs(np.concatenate([r[0] for r in results])) < 1.96)
    assert 0.92 < inside < 0.99


def test_verification_says_what_holds_for_its_sides_alone() -> None:
    arm = LaggingArm.made(5)
    found = calibrated(arm.measured(postures(arm.rng, 50), np.ones((50, 6))))
    poses = arm.measured(postures(arm.rng, 40), np.ones((40, 6)))
    poses = seen_from(found.model, poses)
    checked = verify(found.robot, poses)
    assert checked.document()["prediction"]["verdict"] == "right"
    assert sum("where a program comes from any side" in r for r in checked.remarks) == 1
    # without the column too it is no worse than expected
    unsaid = verify(found.robot, replace(poses, approach=None))
    assert unsaid.document()["prediction"]["verdict"] in ("right", "cautious")
    assert not any("any side" in r for r in unsaid.remarks)


def test_a_visit_from_an_unknown_side_is_no_change_of_the_robot() -> None:
    """A robot whose half widths are known is rechecked at poses approached from one side, which the files do not say."""
    for seed in range(4):
        arm = LaggingArm.made(seed)
        robot = calibrated(arm.measured(postures(arm.rng, 50), arm.sides(50))).robot
        visit = arm.measured(postures(arm.rng, 12), np.ones((12, 6)), said=False)
        assert recheck(robot, seen_from(robot.probable, visit)).verdict == "as_calibrated"


def test_commands_are_for_the_side_that_a_program_comes_from(tmp_path: Path) -> None:
    """The real arm, commanded for its side, is at its target to its scatter, and predicted there; a plan is a file of targets too."""
    arm = LaggingArm.made(7)
    robot = calibrated(arm.measured(postures(arm.rng, 60), arm.sides(60))).robot
    side = arm.sides(30)
    write_plan(tmp_path / "plan.csv", PosePlan(q=postures(arm.rng, 30), approach=side.astype(int)))
    targets = read_targets(tmp_path / "plan.csv", robot.probable)
    aims = predict(
        robot, replace(targets, approach=None)
    ).tool.position  # where the arm would be in the middle
    errors = []
    for own in (targets, replace(targets, approach=None)):
        # targets of the nominal robot are other points: those of the arm in the middle are given
        commands = compensate(robot, replace(own, position=aims)).commands
        assert commands.reached.all()
        there = predict(robot, replace(targets, q=commands.q)).tool.position
        stands = arm.arm.points(commands.q - side * arm.half)
        errors.append((float(np.linalg.norm(there - aims, axis=1).max()), _apart(stands, aims)))
    assert errors[0][0] < 1e-8 < 5e-5 < errors[1][0]
    assert errors[0][1] < 0.5 * errors[1][1]


def _apart(points: np.ndarray, others: np.ndarray) -> float:
    """Root mean square distance (m) of points from others after best-fit registration."""
    a, b = points - points.mean(axis=0), others - others.mean(axis=0)
    u, _, v = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v
    return float(np.sqrt(((a @ turn - b) ** 2).sum(axis=1).mean()))


def test_reversed_signs_are_found() -> None:
    arm = LaggingArm.made(1)
    poses = arm.measured(postures(arm.rng, 60), arm.sides(60))
    found = calibrated(replace(poses, approach=-np.asarray(poses.approach)))
    assert any("the arm leads its motors" in r for r in found.document()["remarks"])
    assert not any("leads" in r for r in calibrated(poses).document()["remarks"])


def test_robot_yaml_may_know_a_gear(tmp_path: Path) -> None:
    yaml = write_robot(tmp_path)
    yaml.write_text(yaml.read_text() + "prior: {parameters: {joint_2.hysteresis: 1.0e-7}}\n")
    model, arm = RobotModel.from_yaml(yaml), LaggingArm.made(2)
    poses = seen_from(model, arm.measured(postures(arm.rng, 50), arm.sides(50)))
    estimate = calibrate(model, poses, terms=["kinematic"]).estimate
    assert abs(estimate.values["joint_2.hysteresis"]) < 1e-6
    assert estimate.values["joint_3.hysteresis"] == pytest.approx(arm.half[2], abs=2e-5)


def test_derivatives_are_those_of_differences() -> None:
    arm = LaggingArm.made(2)
    poses = arm.measured(postures(arm.rng, 5), arm.sides(5))
    found = calibrated(arm.measured(postures(arm.rng, 50), arm.sides(50)))
    model = found.model
    poses = seen_from(model, poses)
    columns = predict_measurements(model, poses, jacobians=True).jacobian(NAMES)
    for k, name in enumerate(NAMES):
        ahead, behind = (
            predict_measurements(model.with_values({name: model.value(name) + step}), poses).position
            for step in (1e-5, -1e-5)
        )
        np.testing.assert_allclose(columns[:, :, k], (ahead - behind) / 2e-5, atol=2e-7)
    # the covariance along a program from any side is that of its points, in both ways to it
    roots = propagation(model).roots(poses.q)[1]
    _, errors = prediction_errors_with_covariance(model, replace(poses, approach=None), noise_free=True)
    parts = errors.roots[:, :, : errors.roots.shape[2] - errors.shared]
    scatter = [
        6 * (model.value("scatter.angular") > 0),
        3 * (model.value("scatter.robot") + model.value("scatter.model") > 0),
    ]
    exact = (parts**2).sum(axis=(1, 2))
    fast = (np.delete(roots, _scatter_columns(roots.shape[2], *scatter), axis=2) ** 2).sum(axis=(1, 2))
    np.testing.assert_allclose(fast, exact, rtol=1e-2)


def _scatter_columns(count: int, angular: int, last: int) -> list[int]:
    """Columns of repeatability and model error: before and after the six of hysteresis, which are not among them."""
    first = count - last - 6 - angular
    return [*range(first, first + angular), *range(count - last, count)]


def test_files_carry_the_sides(tmp_path: Path) -> None:
    model = RobotModel.from_yaml(write_robot(tmp_path))
    arm = LaggingArm.made(0)
    poses = seen_from(model, arm.measured(postures(arm.rng, 8), arm.sides(8)))
    for name in ("poses.csv", "poses.parquet"):
        write_poses(tmp_path / name, poses)
        np.testing.assert_array_equal(read_poses(tmp_path / name, model).approach, poses.approach)
    joined = concatenate([poses, replace(poses, approach=None)])
    np.testing.assert_array_equal(joined.approach, np.vstack([np.asarray(poses.approach), np.zeros((8, 6))]))
    text = (tmp_path / "poses.csv").read_text()
    for wrong, what in (("0.5", "approach is 0.5"), ("2", "approach is 2")):
        lines = text.splitlines()
        cells, column = lines[2].split(","), lines[0].split(",").index("approach3")
        cells[column] = wrong
        (tmp_path / "wrong.csv").write_text("\n".join([*lines[:2], ",".join(cells), *lines[3:]]) + "\n")
        with refused("E-POSES-084", "wrong.csv", "approach3", what):
            read_poses(tmp_path / "wrong.csv", model)


def test_a_plan_leads_there_from_both_sides(tmp_path: Path, ur5: RobotModel) -> None:
    """Sides are balanced, hardly correlated with each other and with the joint's position, and their ways within limits."""
    design = design_poses(ur5, PoseRequest(count=40, candidates=200))
    plan = design.plan
    assert plan.approach is not None and set(np.unique(plan.approach)) == {-1, 1}
    np.testing.assert_allclose(plan.q - plan.via, np.deg2rad(2.0) * plan.approach)
    assert (np.abs(plan.approach.sum(axis=0)) <= 8).all()
    among = np.abs(np.corrcoef(np.hstack([plan.approach, plan.q]).T))
    assert np.max(among[:6, :6] - np.eye(6)) < 0.35
    assert np.max(np.diag(among[:6, 6:])) < 0.35
    lower, upper = (np.array([getattr(j, end) for j in ur5.motor_joints]) for end in ("lower", "upper"))
    assert (plan.via >= lower).all() and (plan.via <= upper).all()
    sides = design.document()["approaches"]["elbow_joint"]
    assert sides["positive"] + sides["negative"] == 40
    # near a limit there is one side
    edge = replace(plan, q=np.where(np.arange(6) == 2, upper[2] - 1e-3, plan.q), approach=None)
    assert (
        crossed_approaches(CollisionChecker(ur5, floor=None), edge, np.random.default_rng(0))[:, 2] >= 0
    ).all()
    for name in ("plan.csv", "plan.yaml"):
        write_plan(tmp_path / name, plan)
        again = read_plan(tmp_path / name)
        assert isinstance(again, PosePlan)
        np.testing.assert_array_equal(again.approach, plan.approach)
        np.testing.assert_array_equal(again.q, plan.q)
    # with points beside it the plan is a file of measurements
    lines = (tmp_path / "plan.csv").read_text().splitlines()
    measured = [lines[0] + ",x,y,z", *(f"{line},0.3,{0.01 * k},0.4" for k, line in enumerate(lines[1:]))]
    (tmp_path / "measured.csv").write_text("\n".join(measured) + "\n")
    np.testing.assert_array_equal(read_poses(tmp_path / "measured.csv", ur5).approach, plan.approach)
    lines[1] = lines[1].replace(",1,", ",3,", 1)
    (tmp_path / "wrong.csv").write_text("\n".join(lines) + "\n")
    with refused("E-PLAN-035", "wrong.csv"):
        read_plan(tmp_path / "wrong.csv")


def test_the_virtual_cell_stands_on_the_side_it_came_from(tmp_path: Path, tx90l: RobotModel) -> None:
    """Poses approached from opposite sides are as far apart as joints that turn by twice the half width of the drives' hysteresis."""
    half = 60e-6
    cell = VirtualCell(tx90l, CellConfig(mismatch=MismatchConfig(hysteresis=half)))
    q = np.array([[0.1, -0.4, 1.5, 0.2, 0.7, 0.1], [-0.6, -0.2, 1.2, 0.5, 0.9, -0.4]])
    signs = np.ones(q.shape, dtype=int)
    driven = [joint.index for joint in tx90l.elastic]
    ahead, behind = (cell.noise_free(PosePlan(q=q, approach=sign * signs)) for sign in (1, -1))
    expected = np.zeros((2, 3))
    for i in driven:
        turned = q + 1e-4 * (np.arange(6) == i)
        step = cell.noise_free(PosePlan(q=turned, approach=0 * signs)) - cell.noise_free(PosePlan(q=q))
        expected -= 2 * half * step / 1e-4
    np.testing.assert_allclose(ahead - behind, expected, rtol=0.02, atol=2e-6)
    assert np.linalg.norm(expected, axis=1).min() > 5e-5
    # files measured by the plan have its sides, whether or not they say them
    plan = PosePlan(q=q, approach=np.array([[1, -1, 1, 1, -1, 1], [-1, -1, 1, -1, 1, 1]]))
    poses = cell.measure(plan)
    np.testing.assert_array_equal(poses.approach, plan.approach)
    write_measured_poses(tmp_path, plan, replace(poses, approach=None))
    np.testing.assert_array_equal(FolderCell(tmp_path, tx90l).measure().approach, plan.approach)
