"""The error model of stage 2 on arms of another's making: a wrong sigma, data that hide something, and data that are wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import assert_refusal
from scipy.optimize import least_squares
from stranger_arm import PANDA, SIX, StrangerArm, rigid, turn

from flexcal.calibration.diagnostics import is_implausible
from flexcal.calibration.fit import GeometricFit, fit_geometry
from flexcal.calibration.verification import error_scale, prediction_errors, prediction_errors_with_covariance
from flexcal.data.poses import PoseSet, read_poses
from flexcal.jobs.calibration.remarks import calibration_remarks
from flexcal.model.robot import RobotModel

TRACKER = 1.5e-5


@dataclass
class Measured:
    """An arm, its nominal model, and points in files."""

    arm: StrangerArm
    folder: Path
    rng: np.random.Generator

    @classmethod
    def drawn(cls, folder: Path, seed: int, axes: list = SIX) -> Measured:
        arm = StrangerArm(seed, axes=tuple(axes))
        arm.write(folder)
        return cls(arm, folder, np.random.default_rng([seed, 1]))

    @property
    def model(self) -> RobotModel:
        return RobotModel.from_yaml(self.folder / "robot.yaml", estimates=False)

    def poses(self, q: np.ndarray, xyz: np.ndarray, sigma: float | None) -> PoseSet:
        file = self.arm.write_poses(self.folder / "poses.csv", q, xyz, sigma)
        return read_poses(file, self.model, require_motion=False)

    def calibrated(self, q: np.ndarray, xyz: np.ndarray, sigma: float | None) -> GeometricFit:
        return fit_geometry(self.model, self.poses(q, xyz, sigma), terms=("kinematic",))

    def fresh(self, count: int = 100) -> PoseSet:
        q = self.arm.postures(count, self.rng)
        return self.poses(q, self.arm.measured(q, self.rng, 0.0), None)


def wrong_sigmas(seed: int, folder: Path) -> tuple[list[float], float, int]:
    """Fresh errors with a wrong sigma over those without one, mean square of the standardised ones, and outliers."""
    case = Measured.drawn(folder / str(seed), seed)
    q = case.arm.postures(40, case.rng)
    xyz = case.arm.measured(q, case.rng, np.hypot(case.rng.uniform(3e-5, 1e-4), TRACKER))
    fresh, without = case.fresh(), case.calibrated(q, xyz, None)
    plain = prediction_errors(without.model, fresh, noise_free=True).all.mean
    ratios, squares, outliers = [], [], 0
    for factor in (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0):
        found = case.calibrated(q, xyz, TRACKER * factor)
        seen = prediction_errors(found.model, fresh, noise_free=True)
        ratios.append(seen.all.mean / plain)
        squares.append(float(np.mean((seen.errors**2).sum(axis=1) / seen.parameter_rms**2)))
        outliers += len(found.estimate.outliers)
    return ratios, float(np.mean(squares)), outliers


def test_a_wrong_sigma_costs_nothing(tmp_path: Path) -> None:
    """From a hundredth to a thousand times the tracker's own, beside 0.03 to 0.1 mm of repeatability."""
    for seed in (61, 62):
        ratios, _, outliers = wrong_sigmas(seed, tmp_path)
        assert np.abs(np.array(ratios) - 1).max() < 0.02 and outliers == 0


@pytest.mark.slow
def test_intervals_hold_whatever_the_stated_sigma(tmp_path: Path) -> None:
    found = over_seeds(wrong_sigmas, range(100, 140), tmp_path)
    assert np.abs(np.array([ratios for ratios, _, _ in found]) - 1).max() < 0.02
    assert 0.8 < np.mean([square for _, square, _ in found]) < 1.25
    assert sum(outliers for *_, outliers in found) <= 2


def test_a_sigma_that_is_too_large_is_said(tmp_path: Path, run: Callable) -> None:
    case = Measured.drawn(tmp_path, 63)
    q = case.arm.postures(40, case.rng)
    file = case.arm.write_poses(tmp_path / "p.csv", q, case.arm.measured(q, case.rng), 0.015)
    said = run("calibrate", tmp_path / "robot.yaml", file)
    assert "the stated sigma of 15 mm is" in said.out and "times the scatter of the points" in said.out


@pytest.mark.parametrize("checked", [TRACKER, 1e-4])
def test_a_sigma_that_the_calibration_did_not_have(tmp_path: Path, checked: float) -> None:
    """Points of another instrument scatter as their file says, and no less than those of the calibration did."""
    case = Measured.drawn(tmp_path, 66)
    q = case.arm.postures(50, case.rng)
    found = case.calibrated(q, case.arm.measured(q, case.rng, TRACKER), None)
    q = case.arm.postures(100, case.rng)
    errors = prediction_errors(found.model, case.poses(q, case.arm.measured(q, case.rng, checked), checked))
    rms = np.sqrt(np.mean((errors.errors**2).sum(axis=1)))
    assert rms == pytest.approx(np.sqrt(np.mean(errors.expected_rms**2)), rel=0.15)


@pytest.mark.parametrize("terms", ["[kinematic]", "auto"])
def test_a_target_that_was_mounted_anew_is_no_crowd_of_outliers(
    tmp_path: Path, run: Callable, terms: str
) -> None:
    """Fifteen poses at a second station, after which the reflector was put elsewhere: said, and refused where too few agree."""
    arm, rng = StrangerArm(5, axes=tuple(SIX)), np.random.default_rng(5)
    robot = arm.write(tmp_path, "stations: {a: {xyz: [2.5, -1, 0.7]}, cal: {xyz: [1, 2, 0.3]}}\n")
    robot.write_text(robot.read_text().replace("terms: [kinematic]", f"terms: {terms}"))
    tracker = rigid(turn(np.array([0.3, 0.2, 0.5])), np.array([1.0, 2.0, 0.3]))
    files = []
    for name, count, own, off in (("a", 60, None, 0.0), ("cal", 15, tracker, 0.03)):
        q = arm.postures(count, rng)
        xyz = arm.measured(q, rng, tracker=own, xyz=arm.true_xyz + np.array([off, 0, -off]))
        file = arm.write_poses(tmp_path / f"{name}.csv", q, xyz, None)
        header, *rows = file.read_text().splitlines()
        file.write_text("\n".join([f"{header},station", *(f"{row},{name}" for row in rows)]) + "\n")
        files.append(file)
    said = run("calibrate", robot, *files)
    assert "14 of the 15 poses of station 'cal' are outliers" in said.out + said.err
    if terms == "auto":
        assert_refusal(said.err, "E-CAL-038", "cal")


def test_outliers_are_found_without_asking(tmp_path: Path) -> None:
    case = Measured.drawn(tmp_path, 64)
    q = case.arm.postures(60, case.rng)
    xyz = case.arm.measured(q, case.rng, 5e-5)
    xyz[[7, 21, 40]] += [[3e-3, 0, 0], [0, -2e-3, 1e-3], [1e-3, 1e-3, 2e-3]]
    assert set(case.calibrated(q, xyz, 5e-6).estimate.outliers) == {7, 21, 40}


def test_components_are_told_apart(tmp_path: Path) -> None:
    """Repeatability at the joints beside a stated instrument: its part stays, the robot's is found."""
    case = Measured.drawn(tmp_path, 65)
    q = case.arm.postures(300, case.rng)
    xyz = case.arm.measured(q + 6e-5 * case.rng.normal(size=q.shape), case.rng, TRACKER)
    found = case.calibrated(q, xyz, TRACKER)
    assert found.scatter.share == 1 and found.scatter.angular == pytest.approx(6e-5, rel=0.15)
    assert found.variances["instrument_mm"] == pytest.approx(0.015)
    low, high = found.estimate.interval("scatter.angular")  # type: ignore[misc]
    assert low < 6e-5 < high


def test_repeats_of_one_command_are_no_new_poses(tmp_path: Path) -> None:
    """Ten visits to 30 commands whose errors a wrong model shares: intervals stay those of 30 poses."""
    case = Measured.drawn(tmp_path, 66)
    q = case.arm.postures(30, case.rng)
    shared = 6e-5 * case.rng.normal(size=(30, 3))
    one = case.calibrated(q, case.arm.measured(q, case.rng, 1e-5) + shared, None)
    again, names = np.tile(q, (10, 1)), [p for p in one.identifiability.kept_names if p.startswith("a")]
    many = case.calibrated(again, case.arm.measured(again, case.rng, 1e-5) + np.tile(shared, (10, 1)), None)
    stds = [(many.estimate.std(name), one.estimate.std(name)) for name in names]
    ratio = [a / b for a, b in stds if a is not None and b is not None]
    assert len(ratio) > 10
    assert 0.7 < np.median(ratio) < 1.4
    assert many.scatter.robot == pytest.approx(1e-5, rel=0.2)


def constant_orientation(case: Measured, count: int) -> np.ndarray:
    """Joint positions with which the nominal tool never turns."""
    base = case.arm.postures(1, case.rng, 0.0)[0]
    turn, found = case.arm.tool(base, true=False)[0][:3, :3], []
    while len(found) < count:
        first = base[:3] + case.rng.uniform(-0.6, 0.6, 3)

        def off(wrist: np.ndarray, first: np.ndarray = first) -> np.ndarray:
            return (case.arm.tool(np.r_[first, wrist], true=False)[0][:3, :3] @ turn.T - np.eye(3)).ravel()

        solved = least_squares(off, base[3:], xtol=1e-14, ftol=1e-14)
        if solved.cost < 1e-16:
            found.append(np.r_[first, solved.x])
    return np.array(found)


def test_a_tool_that_never_turns_does_not_tell_its_offset(tmp_path: Path, run: Callable) -> None:
    """Its reflector is 6 mm off: held at the declared place, the cause is named, and the error at other orientations is predicted."""
    case = Measured.drawn(tmp_path, 67)
    q = constant_orientation(case, 40)
    xyz = case.arm.measured(q, case.rng)
    found = case.calibrated(q, xyz, 2e-5)
    assert [item.name for item in found.undetermined] == [f"tool.length_{key}" for key in "xyz"]
    assert all("the tool turned by 0.0° only" in item.cause for item in found.undetermined)
    estimate = found.estimate
    numbers = [estimate.parameters.index(item.name) for item in found.undetermined]
    sizes = [item.size for item in found.undetermined]
    np.testing.assert_allclose(np.sqrt(np.diag(estimate.covariance)[numbers]), sizes)
    assert not np.array(estimate.identifiable)[numbers].any()
    np.testing.assert_allclose(estimate.covariance, estimate.covariance.T, rtol=1e-9)
    scale = np.sqrt(np.diag(estimate.covariance))
    some = scale > 0
    correlation = estimate.covariance[np.ix_(some, some)] / np.outer(scale[some], scale[some])
    assert np.linalg.eigvalsh(correlation)[0] > -1e-9
    for key in "xyz":
        quantity = found.estimate.quantity(f"tool.length_{key}")
        assert quantity["estimate"] == 0 and quantity["std"] is None and not quantity["identifiable"]
    elsewhere = case.fresh(60)
    seen, covariance = prediction_errors_with_covariance(found.model, elsewhere)
    assert seen.all.mean > 3e-3 and error_scale(seen, covariance).inside > 0.9
    q = constant_orientation(case, 30)
    there = case.poses(q, case.arm.measured(q, case.rng), 2e-5)
    seen, covariance = prediction_errors_with_covariance(found.model, there)
    assert seen.all.mean < 1e-4 and error_scale(seen, covariance).ratio < 1.35
    file = case.arm.write_poses(tmp_path / "p.csv", q, case.arm.measured(q, case.rng), 2e-5)
    printed = " ".join(run("calibrate", tmp_path / "robot.yaml", file).out.split())
    assert "told less by these poses than by their prior: tool.length_x" in printed
    assert "the tool turned by 0.0° only" in printed
    held = " ".join(run("calibrate", tmp_path / "robot.yaml", file, "--prior", "none").out.split())
    assert "not determined by these poses, held at the nominal value: tool.length_x" in held


def test_a_joint_that_hardly_moves_is_named(tmp_path: Path) -> None:
    case = Measured.drawn(tmp_path, 68)
    q = case.arm.postures(60, case.rng)
    q[:, 1] = q[0, 1] + 4e-3 * case.rng.uniform(-1, 1, 60)
    found = case.calibrated(q, case.arm.measured(q, case.rng), 2e-5)
    assert found.undetermined and any("a2 moved 0.5° only" in item.cause for item in found.undetermined)
    seen, covariance = prediction_errors_with_covariance(found.model, case.fresh(60))
    assert error_scale(seen, covariance).ratio_low < 1.35


@pytest.mark.parametrize(
    "terms", [("gravity_compliance", "transmission_1"), ("transmission_1", "transmission_2")]
)
def test_terms_that_poses_do_not_tell_stay_plausible(tmp_path: Path, terms: tuple[str, ...]) -> None:
    """Poses of a few degrees: without a plausible size of the terms, points elsewhere were off by decimetres, or not a number."""
    case = Measured.drawn(tmp_path, 72)
    q = case.arm.postures(40, case.rng, spread=0.02)
    measured = case.poses(q, case.arm.measured(q, case.rng), 2e-5)
    found = fit_geometry(case.model, measured, terms=("kinematic", *terms))
    assert {u.name.rpartition(".")[2].rpartition("_")[0] for u in found.undetermined} >= {"transmission_1"}
    seen, covariance = prediction_errors_with_covariance(found.model, case.fresh(60))
    assert seen.all.max < 0.01 and seen.parameter_rms.max() < 0.015
    assert error_scale(seen, covariance).inside > 0.9


def test_the_rotation_of_a_station_is_the_first_joints(tmp_path: Path) -> None:
    """Points of one joint hardly tell how the instrument is turned about them; the first joint's errors have to take that up."""
    ratios, errors = [], []
    for seed in range(80, 92):
        case = Measured.drawn(tmp_path, seed)
        q = case.arm.postures(1, case.rng) + 2e-3 * case.rng.uniform(-1, 1, (40, 6))
        q[:, 3] += case.rng.uniform(-0.8, 0.8, 40)
        found = case.calibrated(q, case.arm.measured(q, case.rng), 2e-5)
        seen, covariance = prediction_errors_with_covariance(found.model, case.fresh(60))
        ratios.append(error_scale(seen, covariance).ratio)
        errors.append(seen.all.mean)
    assert np.sqrt(np.mean(np.square(ratios))) < 2 and max(errors) < 0.02


def test_points_of_a_plane_predict_the_space(tmp_path: Path) -> None:
    case = Measured.drawn(tmp_path, 69)
    xyz, base, found = np.append(case.arm.declared_xyz, 1.0), case.arm.postures(1, case.rng, 0.0)[0], []
    while len(found) < 60:
        start = case.arm.postures(1, case.rng)[0]
        goal = (case.arm.tool(start, true=False)[0] @ xyz)[:3] * [1, 1, 0] + [0, 0, 0.9]

        def off(first: np.ndarray, start: np.ndarray = start, goal: np.ndarray = goal) -> np.ndarray:
            return (case.arm.tool(np.r_[first, start[3:]], true=False)[0] @ xyz)[:3] - goal

        solved = least_squares(off, start[:3])
        if solved.cost < 1e-16 and np.abs(solved.x - base[:3]).max() < 1.5:
            found.append(np.r_[solved.x, start[3:]])
    q = np.array(found)
    fit = case.calibrated(q, case.arm.measured(q, case.rng), 2e-5)
    seen, covariance = prediction_errors_with_covariance(fit.model, case.fresh(60))
    assert error_scale(seen, covariance).ratio < 1.6 and seen.all.p90 < 2e-4


def test_poses_outside_the_calibrated_ranges_are_said(tmp_path: Path, run: Callable) -> None:
    case = Measured.drawn(tmp_path, 70)
    q = case.arm.postures(60, case.rng, spread=0.3)
    robot, file = tmp_path / "robot.yaml", tmp_path / "p.csv"
    run("calibrate", robot, case.arm.write_poses(file, q, case.arm.measured(q, case.rng)))
    wide = case.arm.postures(40, case.rng)
    file = case.arm.write_poses(tmp_path / "v.csv", wide, case.arm.measured(wide, case.rng))
    said = run("verify", robot, file, "--json").document["remarks"]
    assert any("above three times that near the calibrated poses" in remark for remark in said)
    q = case.arm.postures(40, case.rng, spread=0.3)
    file = case.arm.write_poses(tmp_path / "v.csv", q, case.arm.measured(q, case.rng))
    assert not any("joint ranges" in r for r in run("verify", robot, file, "--json").document["remarks"])


WRONG = ("swapped coordinates", "swapped joints", "sign", "mirror", "order", "degrees", "millimetres")


def spoiled(
    kind: str, q: np.ndarray, xyz: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    q, xyz = q.copy(), xyz.copy()
    joints = rng.choice(q.shape[1], 2, replace=False)
    axes = rng.choice(3, 2, replace=False)
    if kind == "swapped coordinates":
        xyz[:, axes] = xyz[:, axes[::-1]]
    elif kind == "swapped joints":
        q[:, joints] = q[:, joints[::-1]]
    elif kind == "sign":
        q[:, joints[0]] *= -1
    elif kind == "mirror":
        xyz[:, axes[0]] *= -1
    elif kind == "order":
        q = q[:, ::-1]
    elif kind == "degrees":
        q = np.deg2rad(q)
    else:
        xyz = xyz / 1000
    return q, xyz


def alarms(seed: int, folder: Path) -> tuple[bool, bool]:
    """Whether right data are said to be wrong, and wrong ones are."""
    case = Measured.drawn(folder / str(seed), seed, SIX if seed % 2 else PANDA)
    q = case.arm.postures(40 + seed % 40, case.rng)
    xyz = case.arm.measured(q, case.rng, case.rng.uniform(5e-5, 2e-4))
    sigma = (None, 5e-6, 2e-5)[seed % 3]
    wrong = case.calibrated(*spoiled(WRONG[seed % len(WRONG)], q, xyz, case.rng), sigma)
    return is_implausible(case.calibrated(q, xyz, sigma)), is_implausible(wrong)


def test_wrong_data_are_told_from_noise(tmp_path: Path) -> None:
    assert [alarms(seed, tmp_path) for seed in range(7)] == [(False, True)] * 7


@pytest.mark.slow
def test_wrong_data_are_told_from_noise_in_a_hundred_robots(tmp_path: Path) -> None:
    assert over_seeds(alarms, range(1000, 1100), tmp_path) == [(False, True)] * 100


def test_a_cause_that_is_known_stands_in_place_of_where_to_look(tmp_path: Path) -> None:
    case = Measured.drawn(tmp_path, 73)
    q = case.arm.postures(60, case.rng)
    wrong = case.calibrated(*spoiled("sign", q, case.arm.measured(q, case.rng), case.rng), 2e-5)
    far, look = calibration_remarks(wrong)[-2:]
    assert far.startswith("implausibly far") and look.startswith(
        "data and robot.yaml do not go together: look"
    )
    assert calibration_remarks(wrong, ("the cause",))[-2:] == ("the cause", far)


def test_a_declared_prior_holds_what_points_do_not_tell(tmp_path: Path) -> None:
    """With a prior on every length and angle all parameters stay; those that it alone determines are not identifiable."""
    case = Measured.drawn(tmp_path, 71)
    text = (tmp_path / "robot.yaml").read_text()
    (tmp_path / "robot.yaml").write_text(
        f"{text}prior: {{length: 3.0e-4, angle: 5.0e-4, parameters: {{a2.length_x: 1.0e-6}}}}\n"
    )
    q = case.arm.postures(60, case.rng)
    found = case.calibrated(q, case.arm.measured(q, case.rng), 2e-5)
    names = found.estimate.parameters.names
    covariance = dict(zip(names, np.diag(found.estimate.covariance), strict=True))
    assert all(covariance[f"a{i}.{key}"] > 0 for i in range(1, 7) for key in ("offset", "length_y"))
    assert abs(found.estimate.values["a2.length_x"]) < 5e-6
    known = dict(zip(names, found.estimate.identifiable, strict=True))
    assert not known["a2.length_x"] and sum(known[name] for name in names if name.startswith("a")) > 2
    assert prediction_errors(found.model, case.fresh(), noise_free=True).all.p90 < 1e-4
