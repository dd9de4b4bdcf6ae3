"""A stranger's Delta: relations keep its platform parallel, loops of balls close two of its arms."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arm_points import assert_intervals_cover, prediction_of, write_points
from delta import Delta, poses, write_robot
from over_seeds import over_seeds
from palletiser import turn
from refusals import assert_refusal

from flexcal import RobotModel, fit_geometry, read_poses, tool_at_rest
from flexcal.calibration.measurement import predict_measurements


def test_the_platform_is_where_three_spheres_meet(tmp_path: Path) -> None:
    model = RobotModel.from_yaml(write_robot(tmp_path))
    assert model.motor_names == ("motor_1", "motor_2", "motor_3")
    true, q = Delta.nominal(), poses(40, np.random.default_rng(0))
    at = tool_at_rest(model, q, None, np.full(40, "smr"), jacobians=True)
    np.testing.assert_allclose(at.kinematics.position, true.reflector(q), rtol=0, atol=1e-11)
    steps = 1e-6 * np.eye(3)
    slopes = np.stack([(true.reflector(q + e) - true.reflector(q - e)) / 2e-6 for e in steps], axis=2)
    np.testing.assert_allclose(at.command_jacobian()[:, :3], slopes, rtol=0, atol=1e-8)


def test_without_noise_the_fit_predicts_exactly(tmp_path: Path) -> None:
    """Lengths of arms and rods, zeros, and where the motors are on the ring and how they lean."""
    model, true, rng = RobotModel.from_yaml(write_robot(tmp_path)), Delta.drawn(2), np.random.default_rng(2)
    q, fresh = poses(40, rng), poses(30, rng)
    here = read_poses(write_points(tmp_path / "points.csv", q, true.reflector(q)), model)
    fit = fit_geometry(model, here, terms=("kinematic",))
    there = read_poses(write_points(tmp_path / "fresh.csv", fresh, true.reflector(fresh)), model)
    assert np.abs(predict_measurements(model, there).residual).max() > 5e-4
    assert np.abs(predict_measurements(fit.model, there).residual).max() < 1e-7


def test_calibrated_verified_compensated(run, tmp_path: Path) -> None:
    robot, true, rng = write_robot(tmp_path), Delta.drawn(3), np.random.default_rng(3)
    q, fresh = poses(60, rng), poses(40, rng)
    points = write_points(tmp_path / "points.csv", q, true.measured(q, rng))
    checked = write_points(tmp_path / "checked.csv", fresh, true.measured(fresh, rng))
    outcome = run("calibrate", robot, points, "--terms", "kinematic")
    assert outcome.status == 0 and "delta does not turn its tool" in outcome.out
    verified = run("verify", robot, checked, "--out", tmp_path / "out", "--json").document["verification"]
    assert verified["measured"]["mean_mm"] < 0.06 and verified["nominal"]["mean_mm"] > 0.3, verified
    assert (tmp_path / "out" / "report.html").exists()
    stand = (turn(2, -1.3) @ turn(1, 0.04))[0]
    wanted = Delta.nominal().reflector(0.85 * poses(20, rng)) @ stand.T + [1.5, 0.9, 1.6]
    lines = [f"{i + 1},{x!r},{y!r},{z!r},tracker" for i, (x, y, z) in enumerate(wanted.tolist())]
    (tmp_path / "targets.csv").write_text("\n".join(["pose,x,y,z,station", *lines, ""]))
    assert run("compensate", robot, tmp_path / "targets.csv", "--out", tmp_path / "commands.csv").status == 0
    with (tmp_path / "commands.csv").open() as stream:
        rows = {int(row["pose"]): [float(row[f"q{k}"]) for k in (1, 2, 3)] for row in csv.DictReader(stream)}
    kept = np.array(sorted(rows)) - 1
    assert len(kept) >= 15
    reached = true.reflector(np.array([rows[i + 1] for i in kept])) @ stand.T + [1.5, 0.9, 1.6]
    assert np.linalg.norm(reached - wanted[kept], axis=1).mean() < 0.05e-3
    # it hangs, so that no floor at its base is in the way, and the calibrated geometry shows no more than the nominal one
    designed = run(
        "design", "poses", robot, "--count", "12", "--candidates", "60", "--out", tmp_path / "plan.yaml"
    )
    assert designed.status == 0, designed.err
    assert "32 of 87 parameters are identifiable" in designed.out


def test_a_rod_that_is_too_short(run, tmp_path: Path) -> None:
    robot = write_robot(tmp_path)
    urdf = tmp_path / "delta.urdf"
    urdf.write_text(urdf.read_text().replace("0.8 0 0", "0.3 0 0"))
    q = poses(30, np.random.default_rng(5))
    points = write_points(tmp_path / "points.csv", q, Delta.nominal().reflector(q))
    outcome = run("calibrate", robot, points)
    assert outcome.status == 2
    assert_refusal(outcome.err, "E-TABLE-041", "points.csv line", "motor_1 at", "mm apart")


def predicted(seed: int, folder: Path) -> dict[str, Any]:
    """What `verify` says of fresh points of one Delta."""
    robot, true, rng = write_robot(folder / str(seed)), Delta.drawn(100 + seed), np.random.default_rng(seed)
    q, fresh = poses(60, rng), poses(60, rng)
    points = write_points(robot.parent / "points.csv", q, true.measured(q, rng))
    checked = write_points(robot.parent / "checked.csv", fresh, true.measured(fresh, rng))
    return prediction_of(robot, points, checked, "--terms", "kinematic")


@pytest.mark.slow
def test_intervals_cover(tmp_path: Path) -> None:
    """Fresh points of 20 Deltas."""
    assert_intervals_cover(over_seeds(predicted, range(20), tmp_path))
