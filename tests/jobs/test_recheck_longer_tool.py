"""Longer tools that a plan of rechecks proposes find what it says, by a simulator that shares nothing with flexcal."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm, postures, write_poses, write_robot
from over_seeds import over_seeds
from rechecked_arm import Workshop, judged_beside
from scipy.stats import binom

from flexcal import CalibratedRobot, RobotModel, calibrate, read_poses
from flexcal.calibration.recheck import (
    DetectionLimit,
    JudgedVisit,
)
from flexcal.data.poses import PoseSet, concatenate
from flexcal.jobs.recheck.longer_tool import ROUNDS, LongerTools, longer_tools

SHIFT = 5e-5
NOISE = 3e-5


def proposed(robot: CalibratedRobot, rng: np.random.Generator) -> LongerTools | None:
    """What is proposed to an arm with a reflector at 0.12 m, of which none of the limits is enough."""
    q = postures(rng, 200)
    candidates = PoseSet(
        q=q,
        position=np.zeros((200, 3)),
        sigma=np.full((200, 3), NOISE),
        torque=None,
        payload=None,
        target=np.full(200, "smr"),
        station=np.full(200, "tracker"),
        temperature=None,
        pose=np.arange(200),
        sigma_given=True,
    )
    limits = [DetectionLimit(f"joint_{k}", "rad", 5e-5, 0.1, 2.5e-4, 2e-4) for k in range(1, 7)]
    return longer_tools(robot.model, candidates, limits, 10, refit=False)


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    return Workshop.made(tmp_path_factory.mktemp("arm"), 51)


@pytest.fixture(scope="module")
def told(shop: Workshop) -> LongerTools:
    found = proposed(shop.calibrated(), shop.rng)
    assert found is not None
    return found


def test_the_bound_is_that_of_the_true_arm(shop: Workshop, told: LongerTools) -> None:
    """The Cramér-Rao bound of every joint from differences of the true arm's points at the proposed places and poses."""
    tool = told.example
    arm = replace(shop.arm, tool=tool.places[0])
    assert np.linalg.norm(tool.places[0]) == pytest.approx(0.3)
    ratios = []
    for k, limit in enumerate(tool.limits, start=1):
        apart = (arm.turned(k, 1e-6).points(tool.q) - arm.points(tool.q)) / 1e-6
        ratios.append(limit.std / (NOISE * np.sqrt(1 + 1 / ROUNDS) / np.linalg.norm(apart)))
    # what the scatter of the arm adds to the noise of the instrument: 15 µrad of each joint, about half of that noise at a point
    np.testing.assert_allclose(ratios, np.sqrt(1 + 0.5**2), rtol=0.12)


def test_what_is_proposed_is_enough_and_in_words(told: LongerTools) -> None:
    assert told.enough and told.best.worst <= SHIFT
    assert told.lines[0].startswith("a point 300 mm from the origin of flange, as at [")
    assert told.lines[1].startswith("what finds 0.05 mrad of every joint: ")


class Visited:
    """The arm with the proposed points, calibrated, and a reference visit."""

    def __init__(self, shop: Workshop, tool_places: np.ndarray, q: np.ndarray, readings: int):
        self.shop, self.q, self.readings = shop, q, readings
        self.names = [f"far_{k}" for k in range(1, len(tool_places) + 1)]
        self.true = tool_places + 5e-4 * shop.rng.normal(size=tool_places.shape)
        file = write_robot(shop.folder)
        more = "".join(
            f"  {name}: {{frame: flange, xyz: {place.tolist()}}}\n"
            for name, place in zip(self.names, tool_places, strict=True)
        )
        file.write_text(file.read_text("utf-8").replace("points:\n", f"points:\n{more}"), "utf-8")
        self.model = RobotModel.from_yaml(file, estimates=False)
        self.robot = calibrate(self.model, self.seen(postures(shop.rng, 60), shop.arm)).robot
        self.renewed()

    def renewed(self) -> None:
        self.reference = self.seen(np.repeat(self.q, ROUNDS * self.readings, axis=0), self.shop.arm)

    def seen(self, q: np.ndarray, arm: DHArm) -> PoseSet:
        """All points at every pose, the arm standing at each where it came to."""
        actual = q + self.shop.angular * self.shop.rng.normal(size=q.shape)
        sets = []
        for name, place in zip(self.names, self.true, strict=True):
            points = replace(arm, tool=place).points(actual) @ self.shop.place[:3, :3].T
            points = points + self.shop.place[:3, 3] + NOISE * self.shop.rng.normal(size=points.shape)
            rows = read_poses(write_poses(self.shop.folder / "seen.csv", q, points, NOISE), self.model)
            sets.append(replace(rows, target=np.full(len(q), name)))
        return replace(concatenate(sets), pose=np.tile(np.arange(len(q)), len(sets)))

    def judged(self, arm: DHArm) -> JudgedVisit:
        visit = self.seen(np.repeat(self.q, self.readings, axis=0), arm)
        return judged_beside(self.robot.model, visit, self.reference)


def found_of_visits(number: int, arm: Visited, root: Path) -> np.ndarray:
    """How many (2, 7) of no shift and of a shift of each joint are found, and of how many, after a reference visit: five of no shift and of
    each joint of the wrist, one of each of the others.
    """
    (folder := root / str(number)).mkdir()
    own = copy(arm)
    own.shop = replace(arm.shop, folder=folder, rng=np.random.default_rng([52, number]))
    own.renewed()
    counts = np.zeros((2, 7), dtype=int)
    for k in range(5 * number, 5 * number + 5):
        for joint in (0, 4, 5, 6) if k % 5 else range(7):
            shift = SHIFT * (1 if k % 2 else -1)
            moved = own.shop.arm if joint == 0 else own.shop.arm.turned(joint, shift)
            counts[:, joint] += (not own.judged(moved).as_calibrated, 1)
    return counts


@pytest.mark.slow
def test_such_a_tool_finds_a_twentieth_of_a_milliradian_of_any_joint(
    tmp_path: Path, told: LongerTools
) -> None:
    """200 visits with each joint of the wrist shifted, and 40 with each of the others: found in 95 % of them, at 1 % false alarms."""
    arm = Visited(Workshop.made(tmp_path, 52), told.best.places, told.best.q, told.best.readings)
    found, visits = np.sum(over_seeds(found_of_visits, range(40), arm, tmp_path), axis=0)
    print(f"found {found} of {visits}, of no shift and of each joint's")
    assert binom.sf(found[0] - 1, 200, 0.01) > 1e-3, found
    assert (binom.cdf(found[1:], visits[1:], 0.95) > 1e-3).all(), found
    assert found[1:].sum() >= 0.95 * visits[1:].sum(), found
