"""Courses over visits: a drift with its rate, a step with its date, and false alarms of all tests together."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dh_arm import postures
from over_seeds import over_seeds
from rechecked_arm import Workshop, judged_beside
from scipy.stats import binom

from flexcal import CalibratedRobot
from flexcal.calibration.recheck import (
    JudgedVisit,
    VisitErrors,
    drift_sums,
    errors_from_reference,
    possible_changes,
    visit_courses,
)
from flexcal.data.poses import PoseSet
from flexcal.jobs.calibration import calibrate_robot
from flexcal.jobs.recheck import recheck_robot


class Course:
    """A calibrated arm, a reference visit that read ten poses three times, and visits after it."""

    def __init__(self, folder: Path, seed: int):
        self.shop = Workshop.made(folder, seed)
        self.robot: CalibratedRobot = self.shop.calibrated()
        self.q = postures(self.shop.rng, 10)
        self.renewed()

    def renewed(self) -> None:
        self.reference = self.shop.measured(self.robot.model, np.repeat(self.q, 3, axis=0))

    def errors(self, poses: PoseSet, placed: bool = False) -> VisitErrors:
        found = errors_from_reference(self.robot.model, poses, self.reference, placed=placed)
        assert found is not None
        return found

    def judged(self, poses: PoseSet) -> JudgedVisit:
        return judged_beside(self.robot.model, poses, self.reference)

    def visit(self, joint: int = 2, shift: float = 0.0) -> PoseSet:
        return self.shop.measured(self.robot.model, self.q, arm=self.shop.arm.turned(joint, shift))


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Course:
    return Course(tmp_path_factory.mktemp("arm"), 31)


def test_a_drift_that_every_visit_shows_is_told_with_its_rate(arm: Course) -> None:
    times = [7.0, 14.0, 30.0, 41.0, 60.0]
    visits = [arm.errors(arm.visit(3, 8e-6 * t)) for t in times]
    (found,) = visit_courses(visits, times, 0.0)
    assert (found.change.subject, found.kind, found.since, found.first) == ("joint_3", "drift", 0.0, 0)
    assert abs(found.estimate[0] - 8e-6) < 4 * found.std[0] < 4e-6


def test_a_step_has_its_visit(arm: Course) -> None:
    """Chance alone rejects the true course in one or two of a hundred cases."""
    told = 0
    for _ in range(6):
        arm.renewed()
        visits = [arm.errors(arm.visit(2, 3e-4 * (k >= 3))) for k in range(6)]
        for found in visit_courses(visits, list(range(6)), -1.0):
            assert (found.change.subject, found.kind, found.first) == ("joint_2", "step", 3)
            assert abs(found.estimate[0] - 3e-4) < 4 * found.std[0]
            told += 1
    assert told >= 4


def test_a_change_that_goes_back_has_no_single_course(arm: Course) -> None:
    """Neither step nor drift, though all coordinates together would hide it."""
    visits = [arm.errors(arm.visit(2, size)) for size in (4e-4, 3e-4, 2e-4, 1e-4)]
    assert visit_courses(visits, [1.0, 2.0, 3.0, 4.0], 0.0) == ()


def test_one_visit_has_no_course_and_two_changes_no_single_one(arm: Course) -> None:
    moved = arm.errors(arm.visit(2, 3e-4))
    assert visit_courses([moved], [1.0], 0.0) == ()
    other = arm.errors(arm.visit(3, 6e-4))
    assert visit_courses([moved, other], [1.0, 2.0], 0.0) == ()


def test_estimates_are_those_of_the_joint_covariance(arm: Course) -> None:
    """Generalised least squares on all visits stacked, whose covariance has the reference's noise in every block."""
    times = np.array([1.0, 2.0, 4.0, 7.0])
    visits = [arm.errors(arm.visit(2, 4e-5 * t)) for t in times]
    found = visit_courses(visits, times.tolist(), 0.0)[0]
    size = len(visits[0].errors)
    whole = np.kron(np.ones((4, 4)), visits[-1].common)
    for k, visit in enumerate(visits):
        whole[k * size : (k + 1) * size, k * size : (k + 1) * size] += visit.own
    change = next(c for c in possible_changes(visits[-1].model, visits[-1].at) if c.subject == "joint_2")
    column = np.kron(times - found.since, change.columns[:, 0])
    weighted = np.linalg.solve(whole, column)
    values = np.concatenate([visit.errors for visit in visits])
    np.testing.assert_allclose(found.estimate[0], weighted @ values / (weighted @ column), rtol=1e-6)
    np.testing.assert_allclose(found.std[0], (weighted @ column) ** -0.5, rtol=1e-6)


def test_an_instrument_that_is_set_up_anew_does_not_hide_a_drift(arm: Course) -> None:
    shop, visits = arm.shop, []
    for k in range(1, 6):
        poses = shop.measured(
            arm.robot.model, arm.q, arm=shop.arm.turned(3, 1.2e-4 * k), place=shop.new_place()
        )
        visits.append(arm.errors(poses, placed=True))
    found = visit_courses(visits, [1.0, 2.0, 3.0, 4.0, 5.0], 0.0)
    assert found[0].kind == "drift" and found[0].change.subject == "joint_3"
    assert abs(found[0].estimate[0] - 1.2e-4) < 4 * found[0].std[0]


def test_the_sentence_of_a_drift_and_of_a_step(tmp_path: Path) -> None:
    """Files of visits, as `flexcal recheck` takes them."""
    shop = Workshop.made(tmp_path, 32)
    shop.calibrated()
    robot = tmp_path / "robot.yaml"
    calibrate_robot(robot, [shop.written("poses.csv", postures(shop.rng, 60))])
    q = postures(shop.rng, 10)

    def said(name: str, day: str, shift: float, out: str) -> str:
        file = shop.written(
            f"{name}.csv", np.repeat(q, 3, axis=0) if name == "a" else q, arm=shop.arm.turned(2, shift)
        )
        return recheck_robot(robot, [file], tmp_path / out, day=day).headline

    days = ["2026-01-01", "2026-02-10", "2026-03-22", "2026-05-01"]
    drifts = [said("abcd"[k], days[k], 1e-4 * k, "drift") for k in range(4)]
    assert drifts[0].startswith("as calibrated") and "joint_2 shifted by +0." in drifts[1]
    assert "than at the visit of 2026-02-10: it drifts, or changed a second time" in drifts[2]
    assert (
        drifts[3].startswith("joint_2 drifts by +0.07")
        and "in 30 days since the visit of 2026-01-01" in drifts[3]
    )
    steps = [said("abcd"[k], days[k], 4e-4 * (k > 1), "step") for k in range(4)]
    assert "came at once between the visits of 2026-02-10 and 2026-03-22" in steps[3]


def false_alarms(seed: int, root: Path) -> tuple[int, int]:
    """By the visit's own test and by the sums, of two histories of a hundred visits of an arm."""
    (folder := root / str(seed)).mkdir()
    arm, own, sums = Course(folder, seed), 0, 0
    for _ in range(2):
        arm.renewed()
        shifts = []
        for _ in range(100):
            judged = arm.judged(arm.visit())
            own += not judged.as_calibrated or judged.instrument == "evident"
            shifts.append(judged.at_visit("a") if judged.as_calibrated else [])
            if any(item.gradual for item in drift_sums(shifts)):
                sums, shifts = sums + 1, []
    return own, sums


@pytest.mark.slow
def test_false_alarms_of_all_tests_together_are_one_in_a_hundred(tmp_path: Path) -> None:
    """Ten histories of a hundred visits of arms that did not change: the visit's own test, and sums that begin anew after an alarm."""
    own, sums = np.sum(over_seeds(false_alarms, range(40, 45), tmp_path), axis=0)
    print(f"{own} visits and {sums} sums of 1000 visits")
    assert binom.sf(own + sums - 1, 1000, 0.01) > 1e-3, (own, sums)


def rate_is_held(number: int, arm: Course, root: Path) -> bool | None:
    """Whether the interval of a drift's rate holds it; None: no drift of the joint was told."""
    (folder := root / str(number)).mkdir()
    own = copy(arm)
    own.shop = replace(arm.shop, folder=folder, rng=np.random.default_rng([46, number]))
    own.renewed()
    times = [1.0, 2.0, 3.0, 4.0]
    courses = visit_courses([own.errors(own.visit(2, 6e-5 * t)) for t in times], times, 0.0)
    found = [c for c in courses if c.since == 0.0 and c.kind == "drift"]
    if not found or found[0].change.subject != "joint_2":
        return None
    return bool(abs(found[0].estimate[0] - 6e-5) < found[0].quantile * found[0].std[0])


@pytest.mark.slow
def test_intervals_of_the_rate_cover(tmp_path: Path) -> None:
    """Of drifts that were told, with the noise of the reference visit drawn anew."""
    arm = Course(tmp_path, 46)
    held = [h for h in over_seeds(rate_is_held, range(200), arm, tmp_path) if h is not None]
    inside, told = sum(held), len(held)
    print(f"{inside} of {told} that were told, of 200")
    assert told > 150 and 0.9 < inside / told < 0.99, (told, inside)
