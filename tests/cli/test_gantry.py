"""A stranger's gantry: slides whose leads are off, offsets in metres."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arm_points import assert_intervals_cover, prediction_of, write_points
from gantry import Gantry, poses, write_robot
from over_seeds import over_seeds

from flexcal import RobotModel, read_poses, tool_at_rest
from flexcal.calibration.measurement import predict_measurements


def test_derivatives_by_a_lead(tmp_path: Path) -> None:
    model, q = RobotModel.from_yaml(write_robot(tmp_path)), poses(20, np.random.default_rng(0))
    names = [f"{axis}.ratio_{axis}" for axis in "xyz"]
    moved = model.with_values(dict(zip(names, (2e-4, -1e-4, 3e-4), strict=True)))
    at = tool_at_rest(moved, q, None, np.full(20, "smr"), jacobians=True)
    true = Gantry.nominal()
    true.lead[:] = (2e-4, -1e-4, 3e-4)
    np.testing.assert_allclose(at.kinematics.position, true.reflector(q), rtol=0, atol=1e-12)
    steps = 1e-6 * np.eye(5)
    slopes = np.stack([(true.reflector(q + e) - true.reflector(q - e)) / 2e-6 for e in steps], axis=2)
    np.testing.assert_allclose(at.command_jacobian()[:, :3], slopes, rtol=0, atol=1e-8)
    measured = read_poses(write_points(tmp_path / "p.csv", q, true.reflector(q)), model)
    exact = predict_measurements(moved, measured, jacobians=True).jacobian(names)
    for k, name in enumerate(names):
        ends = [
            predict_measurements(moved.with_values({name: moved.value(name) + h}), measured).position
            for h in (1e-4, -1e-4)
        ]
        np.testing.assert_allclose(exact[:, :, k], (ends[0] - ends[1]) / 2e-4, rtol=0, atol=1e-9)


def test_leads_are_found(run, tmp_path: Path) -> None:
    robot, true, rng = write_robot(tmp_path), Gantry.drawn(1), np.random.default_rng(1)
    q, fresh = poses(60, rng), poses(40, rng)
    points = write_points(tmp_path / "points.csv", q, true.measured(q, rng))
    outcome = run("calibrate", robot, points)
    assert outcome.status == 0 and "considered ratio: taken" in outcome.out, outcome.err
    checked = write_points(tmp_path / "fresh.csv", fresh, true.measured(fresh, rng))
    verified = run("verify", robot, checked, "--json").document["verification"]
    assert verified["measured"]["mean_mm"] < 0.042 and verified["nominal"]["mean_mm"] > 0.5, verified
    model = RobotModel.from_yaml(robot)
    for k, axis in enumerate("xyz"):
        item = model.posterior.parameters[f"{axis}.ratio_{axis}"]
        std = float(np.sqrt(model.posterior.marginal([item.name])[0, 0]))
        assert item.unit == "1" and abs(item.value - true.lead[k]) < 4 * std < 1e-4, item
        assert model.posterior.parameters[f"{axis}.length_x"].unit == "m"
    exported = run("export", "urdf", robot, "--out", tmp_path / "found.urdf")
    assert exported.status == 0 and "transmission error" in exported.out


def predicted(seed: int, folder: Path) -> dict[str, Any]:
    """What `verify` says of fresh points of one gantry."""
    robot, true, rng = write_robot(folder / str(seed)), Gantry.drawn(100 + seed), np.random.default_rng(seed)
    q, fresh = poses(60, rng), poses(60, rng)
    points = write_points(robot.parent / "p.csv", q, true.measured(q, rng))
    checked = write_points(robot.parent / "fresh.csv", fresh, true.measured(fresh, rng))
    return prediction_of(robot, points, checked)


@pytest.mark.slow
def test_intervals_cover(tmp_path: Path) -> None:
    """Fresh points of 20 gantries, by default options."""
    assert_intervals_cover(over_seeds(predicted, range(20), tmp_path))
