"""A robot of the 20 kg class whose bearings are fixed to the parent link, simulated by code that shares nothing with flexcal."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from heavy_robot import REPEATABILITY, TRACKER, HeavyRobot, poses, write_poses, write_robot
from refusals import assert_refusal

from flexcal.calibration.diagnostics import BearingAxes, compare_bearings
from flexcal.calibration.fit import fit_geometry
from flexcal.data.poses import read_poses
from flexcal.model.robot import RobotModel

FLOOR = 1.596 * np.hypot(TRACKER, REPEATABILITY)
"""Mean distance (m) that the noise alone makes."""


def cell(
    folder: Path, seed: int, bearings: str | None, *, turning: bool = False, sigma: float | None = None
) -> Path:
    """robot.yaml with 60 poses for the calibration (fit.csv), and 60 for its verification (fresh.csv), beside it."""
    rng, robot = np.random.default_rng(1000 + seed), HeavyRobot.drawn(seed, turning=turning)
    for name in ("fit.csv", "fresh.csv"):
        q = poses(60, rng)
        write_poses(folder / name, q, robot.measured(q, rng), sigma)
    return write_robot(folder, bearings)


@pytest.mark.parametrize(("sigma", "options"), [(None, ()), (TRACKER, ("--terms", "kinematic"))])
def test_declared_as_they_are_they_cost_nothing(
    run, tmp_path: Path, sigma: float | None, options: tuple[str, ...]
) -> None:
    robot = cell(tmp_path, 1, "before", sigma=sigma)
    calibrated = run("calibrate", robot, tmp_path / "fit.csv", "--json", *options).document
    assert calibrated["bearings"]["preferred"] == "before"
    assert not any("bearing axes" in remark for remark in calibrated["remarks"])
    mean = run("verify", robot, tmp_path / "fresh.csv", "--json").document["verification"]["measured"][
        "mean_mm"
    ]
    assert 1e3 * FLOOR < 0.043 and mean < 0.06


def test_not_declared_they_are_found(run, tmp_path: Path) -> None:
    robot = cell(tmp_path, 1, None)
    calibrated = run("calibrate", robot, tmp_path / "fit.csv", "--terms", "kinematic", "--json").document
    assert calibrated["bearings"]["declared"] is None and calibrated["bearings"]["preferred"] == "before"
    assert any(
        "these were used; `bearings: before` in robot.yaml" in remark for remark in calibrated["remarks"]
    )
    assert "bearings" not in calibrated["verdict"]["reasons"]
    verified = run("verify", robot, tmp_path / "fresh.csv", "--json").document
    assert verified["verification"]["measured"]["mean_mm"] < 0.06


@pytest.mark.parametrize("sigma", [None, TRACKER])
def test_declared_wrongly_it_is_said_and_not_trusted(run, tmp_path: Path, sigma: float | None) -> None:
    robot = cell(tmp_path, 1, "after", sigma=sigma)
    outcome = run("calibrate", robot, tmp_path / "fit.csv", "--terms", "kinematic", "--out", tmp_path / "out")
    said = " ".join(outcome.out.split())
    assert "the points fit bearing axes fixed to the parent link better (mean error 0.03" in said
    assert "write `bearings: before` in robot.yaml and calibrate again" in said
    assert "next: write `bearings: before`" in said
    assert "Trusted: no" in said and "the data fit other bearing axes than the declared ones" in said
    assert "No: with bearing axes fixed to the parent link" in (tmp_path / "out" / "report.html").read_text()
    fresh = run("verify", robot, tmp_path / "fresh.csv", "--estimates", tmp_path / "out", "--json").document
    assert fresh["verification"]["measured"]["mean_mm"] > 0.2


def test_estimates_of_other_bearings_are_refused(run, tmp_path: Path) -> None:
    robot = cell(tmp_path, 1, "after")
    run("calibrate", robot, tmp_path / "fit.csv", "--terms", "kinematic")
    robot.write_text(robot.read_text().replace("bearings: after", "bearings: before"))
    refused = run("verify", robot, tmp_path / "fresh.csv")
    assert refused.status == 2
    assert_refusal(refused.err, "E-ROBOT-047", "calibration", "bearings: after", "calibrate")
    assert run("calibrate", robot, tmp_path / "fit.csv", "--terms", "kinematic").status == 0
    assert run("verify", robot, tmp_path / "fresh.csv").status == 0


def compared(
    folder: Path,
    q: np.ndarray,
    xyz: np.ndarray,
    declared: str,
    sigmas: tuple[float | None, ...] = (None, TRACKER),
    terms: tuple[str, ...] = ("kinematic", "transmission"),
) -> Iterator[BearingAxes]:
    """What points (N, 3) at `q` say of a declaration, for each stated noise."""
    model = RobotModel.from_yaml(write_robot(folder, declared), estimates=False)
    for sigma in sigmas:
        write_poses(folder / "poses.csv", q, xyz, sigma)
        measured = read_poses([folder / "poses.csv"], model)
        found = compare_bearings(model, lambda robot: fit_geometry(robot, measured, terms=terms))  # noqa: B023
        assert found is not None
        yield found


def test_transmission_errors_are_not_taken_for_bearings(tmp_path: Path) -> None:
    """Waves of 0.2 mrad in every joint are met better by bearings of the wrong kind; with waves in both fits they are not."""
    rng, robot = np.random.default_rng(1011), HeavyRobot.drawn(11, turning=True)
    q = poses(300, rng)
    wavy = q + 2e-4 * np.sin(2 * q + rng.uniform(0, 6, 6))
    seen = robot.measured(wavy, rng)
    (plain,) = compared(tmp_path, q, seen, "after", (TRACKER,), terms=("kinematic",))
    assert plain.errors["before"].mean < plain.errors["after"].mean
    (found,) = compared(tmp_path, q, seen, "after", (TRACKER,))
    assert not found.contradicted


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20, 40))
def test_over_many_robots(run, tmp_path: Path, seed: int) -> None:
    """Every robot is met to 0.06 mm; the wrong declaration is told where it costs anything, and the right one never blamed."""
    robot = cell(tmp_path, seed, "before")
    assert run("calibrate", robot, tmp_path / "fit.csv").status == 0
    mean = run("verify", robot, tmp_path / "fresh.csv", "--json").document["verification"]["measured"][
        "mean_mm"
    ]
    assert mean < 0.06
    for turning in (False, True):
        rng = np.random.default_rng(2000 + seed)
        q = poses(60, rng)
        xyz = HeavyRobot.drawn(seed, turning=turning).measured(q, rng)
        true = "after" if turning else "before"
        assert not any(axes.contradicted for axes in compared(tmp_path, q, xyz, true))
        if not turning:
            assert all(axes.preferred == true for axes in compared(tmp_path, q, xyz, "after"))
