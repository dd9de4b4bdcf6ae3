"""Drift of a robot's geometry as a whole, on robots of a simulator that shares nothing with flexcal."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dh_arm import DHArm, postures, tracked, write_poses, write_robot
from over_seeds import over_seeds
from scipy.stats import binom

from flexcal import RobotModel, fit_geometry, read_poses
from flexcal.calibration.comparison import GeometryTrend
from flexcal.files.formats import write_estimates
from flexcal.fleet import JointLine, joint_tests
from flexcal.jobs.fleet import Fleet, review_fleet
from flexcal.jobs.fleet.geometry_drifts import GeometryCourse, geometry_drifts

DAYS = ("2024-01-10", "2024-07-10", "2025-01-10", "2025-07-10")
SIGMA = 2e-5


def write_fleet(
    root: Path,
    robots: int,
    seed: int,
    after: Callable[[DHArm, int, int], DHArm],
    visits: int = 4,
    temperatures: tuple[float, ...] = (),
) -> Fleet:
    """Robots that are calibrated on every day at other poses, with the tracker elsewhere and the reflector put on anew; `after` makes of
    an arm what it is at a visit of a robot. Where `temperatures` of the days, °C, are given, they were measured.
    """
    for number in range(robots):
        folder = root / f"r{number}"
        folder.mkdir(parents=True)
        model = RobotModel.from_yaml(write_robot(folder), estimates=False)
        urdf = hashlib.sha256((folder / "robot.urdf").read_bytes()).hexdigest()
        rng = np.random.default_rng(100 * seed + number)
        arm = DHArm.made(100 * seed + number)
        for visit, day in enumerate(DAYS[:visits]):
            own = after(arm, number, visit).bumped(tuple(3e-4 * rng.normal(size=3)))
            q = postures(rng, 45)
            measured = tracked(own.points(q), rng, SIGMA)
            poses = write_poses(folder / "poses.csv", q, measured, SIGMA)
            fit = fit_geometry(model, read_poses(poses, model), terms=("kinematic",))
            origin = {
                "option.targets": "smr",
                "option.terms": "kinematic",
                "input.robot.urdf": urdf,
                "input.poses.csv": hashlib.sha256(poses.read_bytes()).hexdigest(),
            }
            ranges = {f"joint_{k + 1}": (float(q[:, k].min()), float(q[:, k].max())) for k in range(6)}
            if temperatures:
                ranges["temperature"] = (temperatures[visit], temperatures[visit])
            (folder / day).mkdir()
            estimate = replace(fit.estimate, provenance=origin, ranges=ranges)
            write_estimates(folder / day / "estimates.yaml", "calibration", estimate)
    return review_fleet(root, tolerance=1e-3)


def test_a_slow_drift_is_found_and_named(tmp_path: Path) -> None:
    """joint_4 turns by 0.15 mrad from visit to visit, which moves the tool by less than 0.1 mm: no single parameter says so."""
    fleet = write_fleet(
        tmp_path, 4, 1, lambda arm, n, visit: arm.turned(4, 1.5e-4 * visit) if n == 1 else arm
    )
    document = fleet.document()
    assert document["counts"]["geometry_trends_tested"] == 4 and not document["problems"]
    (drift,) = document["geometry_drifts"]
    assert drift["robot"] == "r1" and drift["adjusted_probability"] < 0.05
    assert drift["change"] == "trend" and (drift["first"], drift["last"]) == (DAYS[0], DAYS[3])
    (cause,) = drift["explanations"]
    assert cause["name"] == "joint_4.offset"
    assert abs(cause["change"] - 4.5e-4) < 3 * cause["std"] < 1.5e-4
    moved = drift["tool_mm"]
    # a turn by 0.45 mrad moves a point 0.1 m from the axis of joint 4 by 0.045 mm
    assert 0.01 < moved["mean"] < moved["largest"] < 0.15
    assert "significant, but small beside the tolerance of 1 mm" in drift["sentence"]
    assert document["headline"].endswith("; drifting or changed: r1")
    (robot,) = [item for item in document["robots"] if item["robot"] == "r1"]
    assert robot["outlook"].startswith("the geometry drifts over 4 calibrations, the tool by 0.")
    fleet.write(tmp_path / "fleet.parquet")
    page = (tmp_path / "fleet.html").read_text("utf-8")
    assert "joint_4.offset" in page and "small beside the tolerance" in page


def test_a_jump_is_found_named_and_dated(tmp_path: Path) -> None:
    """joint_3 is 0.3 mrad elsewhere from the third of four calibrations on."""
    fleet = write_fleet(
        tmp_path, 3, 8, lambda arm, n, visit: arm.turned(3, 3e-4 * (visit > 1)) if n == 1 else arm
    )
    document = fleet.document()
    (jump,) = document["geometry_drifts"]
    assert jump["robot"] == "r1"
    assert jump["change"] == "step"
    assert (jump["first"], jump["last"]) == (DAYS[1], DAYS[2])
    assert f"the geometry jumped between {DAYS[1]} and {DAYS[2]}" in document["robots"][1]["outlook"]
    (cause,) = jump["explanations"]
    assert cause["name"] == "joint_3.offset"
    assert abs(cause["change"] - 3e-4) < 3 * cause["std"] < 1.5e-4
    assert cause["per_year"] is None
    assert f"jump between the calibrations of {DAYS[1]} and {DAYS[2]}: joint_3" in jump["sentence"]
    fleet.write(tmp_path / "fleet.parquet")
    assert f"jump between the calibrations of {DAYS[1]}" in (tmp_path / "fleet.html").read_text("utf-8")


def with_one_serial(root: Path, one: str, other: str) -> Fleet:
    """The fleet where the first two calibrations of a robot are in the folder `one`, the others in the folder `other`, with one serial."""
    for name, gone in ((one, DAYS[2:]), (other, DAYS[:2])):
        with (root / name / "robot.yaml").open("a", encoding="utf-8") as file:
            file.write('serial: "20195500123"\n')
        for day in gone:
            shutil.rmtree(root / name / day)
    return review_fleet(root)


@pytest.mark.parametrize("seed", [11, 12])
def test_two_robots_with_one_serial_are_asked_about(tmp_path: Path, seed: int) -> None:
    write_fleet(tmp_path, 3, seed, lambda arm, *_: arm)
    document = with_one_serial(tmp_path, "r0", "r1").document()
    (jump,) = document["geometry_drifts"]
    assert (jump["change"], jump["first"], jump["last"]) == ("step", DAYS[1], DAYS[2])
    assert jump["two_robots"] == ("r0", "r1") and jump["explanations"] == []
    assert "are r0 and r1 two robots with one serial number?" in jump["sentence"]
    (robot,) = [item for item in document["robots"] if item["robot"] == "20195500123"]
    assert "are r0 and r1 two robots" in robot["outlook"] and "drifts" not in robot["outlook"]


@pytest.mark.parametrize("dated", [False, True], ids=["two folders", "a project a visit"])
def test_one_robot_in_several_folders_is_one_robot(tmp_path: Path, dated: bool) -> None:
    """Its joint_3 is 0.3 mrad elsewhere in the second folder, or it has two joints elsewhere in the second of two dated folders."""
    arm = DHArm.made(1300)
    jumped = arm.turned(3, 3e-4).turned(5, 6e-4) if dated else arm.turned(3, 3e-4)
    write_fleet(tmp_path, 3, 13, lambda own, n, _: (arm, jumped, own)[n])
    if dated:
        (tmp_path / "r").mkdir()
        for name, day in (("r0", DAYS[0]), ("r1", DAYS[2])):
            (tmp_path / name).rename(tmp_path / "r" / f"r_{day}")
        fleet = with_one_serial(tmp_path / "r", f"r_{DAYS[0]}", f"r_{DAYS[2]}")
    else:
        fleet = with_one_serial(tmp_path, "r0", "r1")
    (jump,) = fleet.document()["geometry_drifts"]
    assert jump["two_robots"] is None and "serial" not in jump["sentence"]
    # joint_4.misalignment_2 resembles both joints together, and is left out again
    names = {cause["name"] for cause in jump["explanations"]}
    assert names == ({"joint_3.offset", "joint_5.offset"} if dated else {"joint_3.offset"})


@dataclass(frozen=True)
class LoadedArm(DHArm):
    """An arm that carries 8 kg at its reflector, to whose torque its joints yield by `yields`, rad/(N m)."""

    yields: tuple[float, ...] = (1e-6, 2e-6, 2.5e-6, 4e-6, 6e-6, 8e-6)

    def points(self, q: np.ndarray) -> np.ndarray:
        step = 1e-5 * np.eye(6)
        height = [super(LoadedArm, self).points(q + by)[:, 2] for by in (*step, *-step)]
        torque = 8 * 9.81 * (np.array(height[:6]) - height[6:]) / 2e-5
        return super().points(q - torque.T * self.yields)


@pytest.mark.parametrize("seed", [14, 15])
def test_a_load_that_was_not_declared_is_a_possible_cause(tmp_path: Path, seed: int) -> None:
    """A robot carries a load at the last two of four visits; another turns a joint then, which no load does."""

    def after(arm: DHArm, n: int, visit: int) -> DHArm:
        loaded = LoadedArm(arm.rows, arm.tilts, arm.tool)
        return arm if visit < 2 or n == 2 else (loaded, arm.turned(3, 4e-4))[n]

    document = write_fleet(tmp_path, 3, seed, after).document()
    carries, turns = (item for _, item in sorted((d["robot"], d) for d in document["geometry_drifts"]))
    assert (carries["robot"], carries["by_load"]) == ("r0", True)
    assert "a load that was not declared" in carries["sentence"]
    assert "as by a load" in document["robots"][0]["outlook"]
    assert (turns["robot"], turns["by_load"]) == ("r1", False) and "load" not in turns["sentence"]


WARMER = (15.0, 20.0, 25.0, 30.0)


def grown(arm: DHArm, visit: int) -> DHArm:
    """The arm at the temperature of a visit, of a metal that grows by 12 µm/m a kelvin."""
    return arm.grown(12e-6 * (WARMER[visit] - WARMER[0]))


@pytest.mark.statistical
def test_robots_at_other_temperatures_do_not_drift(tmp_path: Path) -> None:
    """All lengths grow by 180 µm/m over four visits; of two such robots one turns its joint 4 besides, by 0.2 mrad a visit."""
    fleet = write_fleet(
        tmp_path,
        4,
        5,
        lambda arm, n, visit: grown(arm, visit).turned(4, 2e-4 * visit * (n == 1)),
        temperatures=WARMER,
    )
    document = fleet.document()
    (drift,) = document["geometry_drifts"]
    assert drift["robot"] == "r1"
    assert [cause["name"] for cause in drift["explanations"]] == ["joint_4.offset"]
    assert document["headline"].endswith("drifting or changed: r1")
    (remark,) = [text for text in document["remarks"] if "15 to 30 °C" in text]
    assert "explains how their lengths differ" in remark


def test_growth_at_unknown_temperatures_is_named(tmp_path: Path) -> None:
    fleet = write_fleet(tmp_path, 2, 6, lambda arm, n, visit: grown(arm, visit))
    drifts = fleet.document()["geometry_drifts"]
    assert {drift["robot"] for drift in drifts} == {"r0", "r1"}
    assert all(drift["grows"] and "warmer arm" in drift["sentence"] for drift in drifts)


def test_another_reflector_and_station_are_no_drift(tmp_path: Path) -> None:
    """The reflector creeps by 0.5 mm a visit, which is nothing of the robot."""
    fleet = write_fleet(tmp_path, 1, 2, lambda arm, _, visit: arm.bumped((5e-4 * visit, 0, 0)), visits=3)
    document = fleet.document()
    assert document["counts"]["geometry_trends_tested"] == 1
    assert document["geometry_drifts"] == [] and document["robots"][0]["geometry_drift"] is None


def test_calibrations_in_other_ranges_are_a_problem(tmp_path: Path) -> None:
    write_fleet(tmp_path, 1, 3, lambda arm, *_: arm, visits=3)
    file = tmp_path / "r0" / DAYS[1] / "estimates.yaml"
    text = file.read_text("utf-8")
    (line,) = [row for row in text.splitlines() if row.strip().startswith("joint_2: [")]
    file.write_text(text.replace(line, line.partition(":")[0] + ": [2.5, 3.0]"), "utf-8")
    document = review_fleet(tmp_path).document()
    (problem,) = document["problems"]
    assert problem["place"].startswith("r0") and "joint_2" in problem["sentence"]
    (robot,) = document["robots"]
    assert "not judged; geometry not tested: " in robot["outlook"] and "joint_2" in robot["not_tested"]
    assert document["headline"].endswith("; geometry not tested: r0")
    assert document["counts"]["geometry_not_tested"] == 1


FLEETS = [30, pytest.param(300, marks=pytest.mark.slow)]


@pytest.mark.parametrize("fleets", FLEETS)
@pytest.mark.parametrize(("largest", "robots"), [(1.0, 1), (100.0, 12)])
def test_rate_of_false_alarms(largest: float, robots: int, fleets: int) -> None:
    """Normal values of 20 quantities of 4 visits, of which one scatters `largest` times as much (variance) as its covariance tells."""
    rng, alarms = np.random.default_rng(7), 0
    spread = np.sqrt(np.r_[largest, np.ones(19)])
    for _ in range(fleets):
        slopes = (spread * rng.normal(size=(robots, 20))) ** 2
        rest = (spread * rng.normal(size=(robots, 2, 20))) ** 2
        lines = [
            JointLine(20, 4, float(s.sum()), float(r.sum()), 500.0) for s, r in zip(slopes, rest, strict=True)
        ]
        alarms += joint_tests(lines)[0].probability < 0.05
    assert alarms <= binom.ppf(0.999, fleets, 0.05)
    assert alarms >= binom.ppf(0.001, fleets, 0.01)


def courses(rng: np.random.Generator, robots: int, visits: int, spread: np.ndarray) -> list[GeometryCourse]:
    """Robots that do not change, with independent values of variance 1 by their covariances and `spread` (n, m) in truth: least squares
    of a line and of every step, in closed form.
    """
    found = []
    for number in range(robots):
        values = spread[number] * rng.normal(size=(visits, spread.shape[1]))
        along = []
        for shape in (
            np.arange(visits) / (visits - 1),
            *(1.0 * (np.arange(visits) > k) for k in range(visits - 1)),
        ):
            span = shape - shape.mean()
            slope = span @ values / (span @ span)
            rest = values - values.mean(axis=0) - np.outer(span, slope)
            none = np.zeros((spread.shape[1], 0))
            change = slope * np.sqrt(span @ span)
            along.append(
                GeometryTrend(change, float((rest**2).sum()), visits, 2000.0, (), (), none, none, none)
            )
        trend, *steps = along
        dates = tuple(datetime.fromisoformat(day) for day in DAYS[:visits])
        found.append(GeometryCourse(f"r{number}", "arm", "0", dates, trend, tuple(steps)))
    return found


def any_alarm(seed: int, factor: float, share: float, directions: int, robots: int, visits: int) -> bool:
    rng = np.random.default_rng([visits + robots, seed])
    spread = np.ones((robots, 20))
    spread[: max(1, round(share * robots)), :directions] = factor
    drifts = geometry_drifts(courses(rng, robots, visits, spread), 1, 0.05)
    return any(drift.probability <= 0.05 for drift in drifts)


def slow(*values: float) -> Any:
    return pytest.param(*values, marks=pytest.mark.slow)


@pytest.mark.parametrize("fleets", FLEETS)
@pytest.mark.parametrize(
    ("factor", "share", "directions", "robots", "visits"),
    [
        slow(1.0, 1.0, 1, 8, 4),
        (3.0, 1.0, 1, 8, 4),
        (5.0, 0.25, 1, 8, 3),
        slow(100.0, 1.0, 1, 2, 3),
        slow(3.0, 1.0, 1, 20, 3),
        slow(5.0, 0.2, 1, 20, 3),
        slow(5.0, 0.5, 1, 20, 4),
        slow(5.0, 0.3, 1, 3, 4),
        slow(3.0, 1.0, 5, 20, 3),
    ],
)
def test_rate_of_false_alarms_of_trends_and_jumps_together(
    factor: float, share: float, directions: int, robots: int, visits: int, fleets: int
) -> None:
    """Any robot of a fleet is named, for a trend or a jump, in 5 % of the fleets at most, though a share of them scatters by a factor more
    than their covariances tell.
    """
    alarms = sum(over_seeds(any_alarm, range(fleets), factor, share, directions, robots, visits))
    print(f"{factor} {share} {directions} {robots} {visits}: {alarms} of {fleets}")
    assert alarms <= binom.ppf(0.999, fleets, 0.05)


def any_is_named(seed: int, folder: Path) -> bool:
    """In a fleet of five robots whose zeros of joints 2 and 3 and whose size go up and down with the temperature."""

    def warm(arm: DHArm, number: int, visit: int) -> DHArm:
        rng = np.random.default_rng((number, visit, seed + 1))
        rows = arm.rows.copy()
        rows[1:3, 0] += 1e-4 * rng.normal()
        rows[:, 1:3] *= 1 + 1e-4 * rng.normal()
        return replace(arm, rows=rows)

    return write_fleet(folder / str(seed), 5, seed, warm, visits=3).document()["counts"]["drifting"] > 0


@pytest.mark.slow
def test_rate_of_false_alarms_over_fleets(tmp_path: Path) -> None:
    """Fleets of robots whose zeros of joints 2 and 3 and whose size go up and down with the temperature: any is named in 5 % at most."""

    named = over_seeds(any_is_named, range(40), tmp_path)
    print(f"{sum(named)} of {len(named)} fleets")
    assert sum(named) <= binom.ppf(0.999, len(named), 0.05)
