"""Rechecks of an arm by a simulator that shares nothing with flexcal: what is said to have changed, did, and false alarms are rare."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dh_arm import postures, write_poses, write_robot
from over_seeds import over_seeds
from rechecked_arm import Workshop, judged_beside
from refusals import refused
from scipy.stats import binom, f, kstest, ncf, norm

from flexcal import CalibratedRobot, Recheck, RobotModel, calibrate, read_poses, recheck
from flexcal.calibration.recheck import (
    AVERAGE_RUN,
    GlobalTest,
    JudgedVisit,
    ShiftAtVisit,
    detection_limits,
    drift_sums,
    errors_from_calibration,
    errors_from_reference,
    possible_changes,
)
from flexcal.calibration.recheck.cumulative_sums import decision_limit, innovations, run_length
from flexcal.calibration.recheck.detection import _noncentrality
from flexcal.data.poses import PoseSet, concatenate
from flexcal.jobs.inputs import reference_temperature
from flexcal.jobs.recheck.visit_history import Readings


class Visited:
    """A calibrated arm with a reference visit that read ten poses three times."""

    def __init__(self, folder: Path, seed: int, tail: float | None = None):
        self.shop = Workshop.made(folder, seed, tail)
        self.robot = self.shop.calibrated()
        self.q = postures(self.shop.rng, 10)
        self.renewed()

    def renewed(self) -> None:
        self.reference = self.shop.measured(self.robot.model, np.repeat(self.q, 3, axis=0))

    def visit(self, **change) -> PoseSet:
        return self.shop.measured(self.robot.model, self.q, **change)

    def quickly(self, **change) -> JudgedVisit:
        """The judgement alone."""
        return judged_beside(self.robot.model, self.visit(**change), self.reference)

    def judged(self, **change) -> Recheck:
        return recheck(self.robot, self.visit(**change), reference=self.reference)


@pytest.fixture(scope="module")
def visited(tmp_path_factory: pytest.TempPathFactory) -> Visited:
    return Visited(tmp_path_factory.mktemp("arm"), 3)


def test_a_robot_that_did_not_change_is_as_calibrated(visited: Visited) -> None:
    for _ in range(3):
        found = visited.judged()
        assert found.verdict == "as_calibrated" and found.headline.startswith("as calibrated (p = ")
        assert found.absolute is not None and found.absolute.as_calibrated


@pytest.mark.parametrize("joint", range(1, 7))
def test_a_shifted_joint_is_named_with_its_size(visited: Visited, joint: int) -> None:
    size = 6e-3 if joint == 6 else 8e-4  # the reflector is 36 mm from the last axis
    found = visited.judged(arm=visited.shop.arm.turned(joint, size))
    best = found.judged.suspects[0]
    names = [suspect.change.subject for suspect in found.judged.suspects]
    assert f"joint_{joint}" in names
    (item,) = [s for s in found.judged.suspects if s.change.subject == f"joint_{joint}"]
    assert abs(item.estimate[0] - size) < 4 * item.std[0] < 0.4 * size
    # a first joint's shift is a motion of the whole before the tracker, the last one's a bump of a single point
    same = {1: ["tracker"], 6: ["smr"]}.get(joint, [])
    assert best.change.subject == f"joint_{joint}" and names[1:] == same
    assert found.verdict == ("ambiguous" if same else "joint_shifted")


def test_a_large_shift_is_no_wrong_model(visited: Visited) -> None:
    """The points do not move in proportion to 20 mrad: 0.2 mm of second order."""
    found = visited.judged(arm=visited.shop.arm.turned(2, 0.02))
    (item,) = found.judged.suspects
    assert item.change.subject == "joint_2" and abs(item.estimate[0] - 0.02) < 4 * item.std[0]


def test_other_changes_are_named(visited: Visited) -> None:
    shop = visited.shop
    bumped = visited.judged(arm=shop.arm.bumped((2e-4, -1.5e-4, 3e-4)))
    (item,) = bumped.judged.suspects
    assert bumped.verdict == "tool_bumped" and np.all(
        np.abs(item.estimate - (2e-4, -1.5e-4, 3e-4)) < 4 * item.std
    )
    grown = visited.judged(growth=3e-4)
    (item,) = grown.judged.suspects
    assert grown.verdict == "thermal_growth" and abs(item.estimate[0] - 3e-4) < 4 * item.std[0] < 1.5e-4
    assert "unless it is the scale of the instrument" in grown.headline
    moved = visited.judged(place=shop.new_place())
    assert moved.verdict == "instrument_moved" and "stands elsewhere" in moved.headline
    broken = visited.judged(arm=replace(shop.longer(2, 6e-4), tilts=shop.arm.tilts + 4e-4))
    assert broken.verdict == "recalibrate"
    for item in (bumped, grown, broken):
        assert item.judged.probability < 1e-3


def test_one_wrong_reading_is_no_change_of_the_robot(visited: Visited) -> None:
    visit = visited.visit()
    position = visit.position.copy()
    position[4] += (4e-4, -3e-4, 2e-4)
    found = recheck(visited.robot, replace(visit, position=position), reference=visited.reference)
    assert found.verdict == "wrong_reading" and "pose 4 disagrees on its own" in found.headline


def test_a_visit_and_its_reference_are_each_taken_at_their_own_temperature(visited: Visited) -> None:
    """An arm that grows by 15 µm/m/K, 8 K above the temperature of its parameters, then and now."""
    shop, q = visited.shop, visited.q
    model = visited.robot.model.with_values({"thermal.expansion": 15e-6, "thermal.reference": 20.0})
    robot = CalibratedRobot(visited.robot.nominal, model, visited.robot.blocks)
    holds = reference_temperature(model)

    def at(warmer: float, rows: np.ndarray, told: bool = True) -> PoseSet:
        poses = shop.measured(model, rows, growth=15e-6 * warmer)
        return replace(poses, temperature=np.full(len(rows), holds + warmer) if told else None)

    reference = at(8.0, np.repeat(q, 3, axis=0))
    stored = Readings.of(reference).poses(1e-5)
    for warmer in (8.0, 0.0):
        found = recheck(robot, at(warmer, q), reference=stored)
        assert found.verdict == "as_calibrated" and "not used" not in found.summary()
    given = recheck(robot, at(8.0, q, told=False), reference=stored, temperature=holds + 8.0)
    assert given.verdict == "as_calibrated"
    # a sensor that fails for a moment does not make a wrong reading
    failing = at(8.0, q)
    assert failing.temperature is not None
    failing.temperature[3] = -20.0
    mended = recheck(robot, failing, reference=stored)
    assert (
        mended.verdict == "as_calibrated" and "left out, because the temperature is far" in mended.summary()
    )
    # what is not told shows as growth, and is said
    silent = recheck(robot, at(8.0, q), reference=replace(stored, temperature=None))
    assert silent.verdict == "thermal_growth" and "the reference visit has no temperature" in silent.summary()
    unsaid = recheck(robot, at(-8.0, q, told=False), reference=stored)
    assert unsaid.verdict == "thermal_growth" and "no temperature is given" in unsaid.summary()


def test_beside_an_instrument_that_moved_a_first_joint_is_said_to_be_unseen(visited: Visited) -> None:
    place = visited.shop.place.copy()
    place[:3, 3] += (2e-4, -1e-4, 1e-4)
    found = visited.judged(place=place, arm=visited.shop.arm.turned(1, 4e-4))
    assert found.verdict == "instrument_moved" and "a shift of joint_1 looks just like" in found.headline
    assert "not seen: joint_1" in found.power_sentence and not found.judged.suspects
    shifted = visited.judged(arm=visited.shop.arm.turned(1, 4e-4))
    assert shifted.verdict == "ambiguous" and "the tool is where it was" in shifted.headline
    assert "if it was a shift of joint_1, the tool is off by" in shifted.headline


def test_the_place_of_the_instrument_is_fitted_where_declared(visited: Visited) -> None:
    place = visited.shop.new_place()
    found = recheck(visited.robot, visited.visit(place=place), reference=visited.reference, refit=True)
    assert found.verdict == "as_calibrated" and found.judged.instrument == "declared"
    lost = next(limit for limit in found.limits if limit.subject == "joint_1")
    assert not np.isfinite(lost.found) and "not seen: joint_1" in found.power_sentence
    shifted = visited.visit(place=place, arm=visited.shop.arm.turned(3, 1.5e-3))
    found = recheck(visited.robot, shifted, reference=visited.reference, refit=True)
    assert found.judged.suspects[0].change.subject == "joint_3"


def test_the_tool_is_off_as_the_true_arm_is(visited: Visited) -> None:
    arm, ranges = visited.shop.arm, visited.robot.blocks["calibration"].ranges
    found = visited.judged(arm=arm.turned(2, 8e-4))
    low, high = np.array([ranges[f"joint_{k}"] for k in range(1, 7)]).T
    q = np.random.default_rng(5).uniform(low, high, (2000, 6))
    truth = np.linalg.norm(arm.turned(2, 8e-4).points(q) - arm.points(q), axis=1)
    (tool,) = found.tools
    assert tool.mean_interval[0] < 1.05 * truth.mean() and truth.mean() < 1.05 * tool.mean_interval[1]
    np.testing.assert_allclose(tool.p95, np.quantile(truth, 0.95), rtol=0.15)


def test_a_small_change_is_said_to_be_small(visited: Visited) -> None:
    """Tested by many readings, 0.06 mrad of the fourth joint are certain and move the tool by some 15 µm."""
    model, q = visited.robot.model, np.repeat(visited.q, 40, axis=0)
    arm = visited.shop.arm
    reference = visited.shop.measured(model, q)
    found = recheck(
        visited.robot, visited.shop.measured(model, q, arm=arm.turned(4, 6e-5)), reference=reference
    )
    assert not found.judged.as_calibrated and found.tools[0].p95 < 4e-5
    assert "significant, but small beside" in found.headline


def test_two_points_tell_a_bumped_reflector_from_a_moved_tool(tmp_path: Path) -> None:
    """Not a shift of the last joint from a tool turned on its flange; the tool is off by as much as both points moved."""
    shop = Workshop.made(tmp_path, 7)
    file = write_robot(tmp_path)
    far = np.array([0.15, 0.1, 0.2])
    text = file.read_text("utf-8")
    file.write_text(
        text.replace("points:\n", "points:\n  far: {frame: flange, xyz: [0.15, 0.1, 0.2]}\n"), "utf-8"
    )
    model = RobotModel.from_yaml(file, estimates=False)

    def seen(q: np.ndarray, turned: float = 0.0, smr=(0.0, 0.0, 0.0), both=(0.0, 0.0, 0.0)) -> PoseSet:
        actual = q + shop.angular * shop.normal(q.shape)
        arm = shop.arm.turned(6, turned)
        sets = []
        for name, place in (("smr", arm.tool + smr + both), ("far", far + 3e-4 + both)):
            points = replace(arm, tool=place).points(actual) @ shop.place[:3, :3].T + shop.place[:3, 3]
            points = points + 3e-5 * shop.normal(points.shape)
            poses = read_poses(write_poses(tmp_path / "seen.csv", q, points, 3e-5), model)
            sets.append(replace(poses, target=np.full(len(q), name)))
        return concatenate(sets)

    robot = calibrate(model, seen(postures(shop.rng, 50))).robot
    q = postures(shop.rng, 10)
    reference = seen(np.repeat(q, 3, axis=0))
    bumped = recheck(robot, seen(q, smr=(2e-4, 1e-4, -2e-4)), reference=reference)
    assert bumped.verdict == "tool_bumped" and bumped.judged.suspects[0].change.subject == "smr"
    moved = recheck(robot, seen(q, both=(2e-4, 1e-4, -2e-4)), reference=reference)
    assert moved.verdict == "tool_bumped" and moved.judged.suspects[0].change.subject == "the tool"
    assert abs(moved.tools[0].mean - 3e-4) < 4e-5
    turned = recheck(robot, seen(q, turned=2e-3), reference=reference)
    assert [s.change.subject for s in turned.judged.suspects] == ["joint_6", "the tool"]
    assert "look at how the tool is mounted" in " ".join(turned.remarks)


def test_p_values_are_uniform(visited: Visited) -> None:
    """Of errors drawn from the covariance, with the size of the scatter drawn too."""
    rng = np.random.default_rng(0)
    for errors in (
        errors_from_calibration(visited.robot.model, visited.reference, placed=False),
        errors_from_reference(visited.robot.model, visited.reference, visited.reference, placed=True),
    ):
        assert errors is not None
        test = GlobalTest.of(errors, possible_changes(errors.model, errors.at))
        root = np.linalg.cholesky(errors.covariance)
        chances = []
        for _ in range(400):
            size = 1.0 if np.isinf(test.freedom) else np.sqrt(test.freedom / rng.chisquare(test.freedom))
            chances.append(test.probability(root @ rng.standard_normal(len(root)) * size))
        assert kstest(chances, "uniform").pvalue > 1e-3


def test_the_least_shift_is_the_bound_of_the_true_arm(visited: Visited) -> None:
    """Neyman and Pearson's bound from the differences of the true arm's points, and the noise that the reference had."""
    found = recheck(visited.robot, visited.visit(), reference=visited.reference)
    errors = found.judged.test.errors
    assert errors.noise == "repeats" and errors.freedom == 60
    apart = visited.shop.arm.turned(3, 1e-6).points(visited.q) - visited.shop.arm.points(visited.q)
    column = (apart @ visited.shop.place[:3, :3].T).ravel() / 1e-6
    std = 1 / np.sqrt(column @ np.linalg.solve(errors.covariance, column))
    limit = next(item for item in found.limits if item.subject == "joint_3")
    np.testing.assert_allclose(limit.std, std, rtol=5e-3)
    known = norm.ppf(0.995) + norm.ppf(0.95)
    assert known * std < limit.bound < 1.05 * known * std and limit.bound < limit.found < 1.4 * limit.bound
    # the true scatter, which is that of a visit and of a third of the reference's, is what was found
    sigma = 15e-6 + 6e-6 * 2.5
    true = np.sqrt(np.mean(np.diag(errors.covariance)))
    assert 0.7 * sigma < true < 1.6 * sigma


def test_run_lengths_are_those_of_the_literature() -> None:
    """Montgomery, Introduction to Statistical Quality Control, 7th ed., tables 9.3 and 9.4, for both sides: 168 and 465 at h = 4 and 5,
    and 370 at h = 8.01 with half the allowance.
    """
    assert round(run_length(4.0, 0.5) / 2) == 168 and round(run_length(5.0, 0.5) / 2) == 465
    assert run_length(8.01, 0.25) / 2 == pytest.approx(370, rel=0.005)
    limit = decision_limit(AVERAGE_RUN * 7)
    assert run_length(limit) == pytest.approx(2 * 7 * AVERAGE_RUN, rel=1e-6)


def test_innovations_are_those_of_the_joint_covariance() -> None:
    """Visits that share an error: whitened by the Cholesky factor of their covariance."""
    rng = np.random.default_rng(1)
    std, common = rng.uniform(0.5, 2.0, 6), 1.3
    values = rng.standard_normal(6)
    root = np.linalg.cholesky(np.diag(std**2) + common**2)
    shifts = [
        ShiftAtVisit("joint_1", float(v), float(s), common, "a") for v, s in zip(values, std, strict=True)
    ]
    np.testing.assert_allclose(innovations(shifts), np.linalg.solve(root, values), rtol=1e-9)


def test_a_slow_drift_is_found_by_the_sums_before_any_visit_shows_it() -> None:
    rng = np.random.default_rng(2)
    drifting, still = [], []
    for visit in range(60):
        drifting.append([ShiftAtVisit("joint_1", 0.1 * visit + rng.normal(), 1.0, 0.5, "a")])
        still.append([ShiftAtVisit("joint_1", 2.0 + rng.normal(), 1.0, 2.0, "a")])
    (found,), (quiet,) = drift_sums(drifting), drift_sums(still)
    assert (
        found.alarm is not None and found.alarm < 40 and found.since is not None and found.since < found.alarm
    )
    assert quiet.alarm is None
    # the largest standardised shift by then is below what one visit rejects among seven joints
    assert max(abs(v[0].estimate) for v in drifting[: found.alarm]) / np.hypot(1.0, 0.5) < norm.ppf(
        1 - 0.0005 / 7
    )


def test_real_poses_left_out_are_as_calibrated_and_a_shifted_column_is_named(examples: Path) -> None:
    model = RobotModel.from_yaml(examples / "ur5_tracker" / "robot.yaml", estimates=False)
    poses = read_poses(examples / "ur5_tracker" / "grid.csv", model)
    robot = calibrate(model, poses.subset(slice(0, None, 5))).robot
    left_out = [poses.subset(slice(first, None, 100)) for first in (1, 27, 53, 78)]
    assert [recheck(robot, visit).verdict for visit in left_out] == ["as_calibrated"] * 4
    for column, name in ((1, "shoulder_lift_joint"), (2, "elbow_joint")):
        q = left_out[0].q.copy()
        q[:, column] -= 8e-4
        found = recheck(robot, replace(left_out[0], q=q))
        assert found.judged.suspects[0].change.subject == name
        assert abs(found.judged.suspects[0].estimate[0] - 8e-4) < 3e-4
    unseen = next(limit for limit in found.limits if limit.subject == "wrist_3_joint")
    assert unseen.found > 0.02 and "not seen: wrist_3_joint" in found.power_sentence


def test_what_tells_nothing_is_refused(visited: Visited, examples: Path) -> None:
    with refused("E-RECHECK-007", "3 poses"):
        recheck(visited.robot, visited.visit().subset(slice(0, 3)))
    robot = CalibratedRobot(
        visited.robot.nominal,
        visited.robot.model,
        {"calibration": _renamed(visited.robot.blocks["calibration"])},
    )
    with refused("E-RECHECK-006", "smr"):
        recheck(robot, visited.visit())


def test_errors_in_the_data_are_named(visited: Visited) -> None:
    shop = visited.shop

    def found(position: np.ndarray, visit: PoseSet) -> Recheck:
        return recheck(visited.robot, replace(visit, position=position), reference=visited.reference)

    visit = visited.visit()
    swapped = found(visit.position[:, [1, 0, 2]], visit)
    assert swapped.verdict == "wrong_reading" and "x and y are swapped" in swapped.headline
    order = np.arange(10)
    order[[3, 4]] = 4, 3
    rows = found(visit.position[order], visit)
    assert "the point of pose 3 is that of pose 4" in rows.headline and "as calibrated" in rows.headline
    shifted = visited.visit(arm=shop.arm.turned(2, 8e-4))
    position = shifted.position.copy()
    position[6] += (6e-4, 8e-4, 0.0)
    both = found(position, shifted)
    assert both.headline.startswith("pose 6 (") and "without that: joint_2 shifted by" in both.headline
    position[1] -= (9e-4, 0.0, 7e-4)
    assert {"pose 1 (", "pose 6 ("} <= {
        p for p in ("pose 1 (", "pose 6 (") if p in found(position, shifted).headline
    }


def test_a_reference_that_was_not_as_calibrated_is_said_to_differ(visited: Visited) -> None:
    q = np.repeat(visited.q, 3, axis=0)
    wrong = visited.shop.measured(visited.robot.model, q, arm=visited.shop.arm.turned(2, 8e-4))
    back = recheck(visited.robot, visited.visit(), reference=wrong)
    assert not back.judged.as_calibrated and back.headline.startswith("as calibrated (p = ")
    assert "the reference visit was not: against the calibration joint_2 shifted by +" in back.headline
    assert (
        "since then joint_2 shifted by −" in back.headline
        and "make this visit the reference" in back.headline
    )
    # as at the reference: nothing has just moved
    still = recheck(visited.robot, visited.visit(arm=visited.shop.arm.turned(2, 8e-4)), reference=wrong)
    assert still.verdict == "as_at_reference" and still.headline.startswith(
        "nothing changed since the reference visit: as it was then (p = "
    )
    assert "the robot differed already then, and does now: joint_2 shifted by +" in still.headline
    assert still.numbers["suspects"][0]["subject"] == "joint_2" and still.tools[0].mean > 4e-4
    # another joint since
    more = recheck(
        visited.robot, visited.visit(arm=visited.shop.arm.turned(2, 8e-4).turned(3, 6e-4)), reference=wrong
    )
    assert more.headline.startswith("since the reference visit joint_3 shifted by +")
    assert (
        "it differed already then: joint_2 shifted by +" in more.headline and "; and now: " in more.headline
    )


def _renamed(estimate):
    return replace(estimate, provenance={"option.targets": "other"})


def found_and_named(joint: int, root: Path) -> tuple[int, int]:
    """How many of 200 shifts of a joint, each as large as is to be found in 95 %, are found, and in how many the joint is named."""
    (folder := root / str(joint)).mkdir()
    arm = Visited(folder, 17)
    arm.shop.rng = np.random.default_rng([17, joint])
    found, right = 0, 0
    for k in range(200):
        if k % 20 == 0:
            arm.renewed()
            limits = {limit.subject: limit for limit in detection_limits(arm.quickly().test, 5e-5)}
        size = limits[f"joint_{joint}"].found * (1 if k % 2 else -1)
        judged = arm.quickly(arm=arm.shop.arm.turned(joint, size))
        found += not judged.as_calibrated
        right += f"joint_{joint}" in [suspect.change.subject for suspect in judged.suspects]
    return found, right


@pytest.mark.slow
def test_shifts_are_found_as_often_as_predicted(tmp_path: Path) -> None:
    """200 visits with the shift of each joint that is to be found in 95 % of them; the right joint is among what is named."""
    counts = over_seeds(found_and_named, range(1, 7), tmp_path)
    print(f"found and rightly named of 200: {counts}")
    for joint, (found, right) in enumerate(counts, start=1):
        assert binom.cdf(found, 200, 0.95) > 1e-3, (joint, found)
        assert right > 0.9 * found, (joint, right, found)


def false_alarms(seed: int, root: Path) -> int:
    """Of 100 visits to an arm that did not change."""
    (folder := root / str(seed)).mkdir()
    arm, alarms = Visited(folder, seed), 0
    for k in range(100):
        if k % 10 == 0:
            arm.renewed()
        alarms += arm.quickly().verdict != "as_calibrated"
    return alarms


@pytest.mark.slow
def test_false_alarms_are_one_in_a_hundred(tmp_path: Path) -> None:
    """500 visits to five arms, with normal noise; the level lies within the chance of its binomial."""
    alarms = sum(over_seeds(false_alarms, range(11, 16), tmp_path))
    print(f"{alarms} of 500 visits")
    assert binom.sf(alarms - 1, 500, 0.01) > 1e-3, alarms


def test_the_noncentrality_of_few_degrees_of_freedom() -> None:
    """Where the distribution function cannot be computed far out, its root nearer by is found: as by a search from below."""
    for freedom in (3.0, 8.0, 33.0, 300.0):
        found = _noncentrality(0.01, freedom)
        critical = f.isf(0.01, 1, freedom)
        assert ncf.cdf(critical, 1, freedom, found**2) == pytest.approx(0.05, rel=1e-6)


def test_readings_of_unequal_length_are_refused() -> None:
    given = Readings([1], ["p"], ["s"], [[0.0, 0.1]], [[0.0, 0.0, 0.0]])
    for changed in (
        {"target": []},
        {"q": []},
        {"position": [[0.0, 0.0]]},
        {"sigma": [[1e-5]]},
        {"temperature": []},
    ):
        with refused("E-RECHECK-011"):
            replace(given, **changed)
