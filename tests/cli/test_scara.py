"""A stranger's SCARA: motors coupled by a ball screw spline, parallel axes, a tool that turns about the vertical only."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arm_points import assert_intervals_cover, prediction_of, write_points
from over_seeds import over_seeds
from scara import LEAD, Scara, poses, write_robot

from flexcal import RobotModel, tool_at_rest

NOISE = 0.032
"""mm, mean distance by the tracker's noise."""


def measured_points(path: Path, robot: Scara, count: int, rng: np.random.Generator) -> Path:
    q = poses(count, rng)
    return write_points(path, q, robot.measured(q, rng))


def test_the_spline_lifts_the_quill(tmp_path: Path) -> None:
    model = RobotModel.from_yaml(write_robot(tmp_path))
    q = poses(30, np.random.default_rng(0))
    at = tool_at_rest(model, q, None, np.full(30, "smr"), jacobians=True)
    np.testing.assert_allclose(at.kinematics.position, Scara.nominal().reflector(q), rtol=0, atol=1e-12)
    nominal, h = Scara.nominal(), 1e-6 * np.eye(4)
    slopes = np.stack([(nominal.reflector(q + e) - nominal.reflector(q - e)) / 2e-6 for e in h], axis=2)
    np.testing.assert_allclose(at.command_jacobian()[:, :3], slopes, rtol=0, atol=1e-8)


def test_calibrated_with_default_options(run, tmp_path: Path) -> None:
    """What cannot be told by a tool that stays upright is said as such, and not asked of further poses."""
    robot, true, rng = write_robot(tmp_path), Scara.drawn(1), np.random.default_rng(1)
    outcome = run(
        "calibrate", robot, measured_points(tmp_path / "points.csv", true, 60, rng), "--out", tmp_path / "out"
    )
    assert outcome.status == 0, outcome.err
    assert "turns its tool about one direction only" in outcome.out
    assert "measure poses with other tool orientations" not in outcome.out
    text = (tmp_path / "out" / "estimates.yaml").read_text()
    assert (
        "j3.offset: {estimate: " in text and "unit: m" in text.partition("j3.offset: ")[2].partition("std")[0]
    )
    fresh = measured_points(tmp_path / "fresh.csv", true, 40, rng)
    verified = run("verify", robot, fresh, "--estimates", tmp_path / "out", "--json").document
    errors = verified["verification"]
    assert errors["measured"]["mean_mm"] < 1.4 * NOISE and errors["nominal"]["mean_mm"] > 0.5, errors


@pytest.mark.parametrize(
    "forgotten", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["forgotten", "wrong sign"]
)
def test_a_coupling_that_is_not_as_declared(run, tmp_path: Path, forgotten: bool) -> None:
    """The sentence has the relation that robot.yaml lacks, and nothing is trusted; with it, everything is as above."""
    robot, true, rng = write_robot(tmp_path), Scara.drawn(2), np.random.default_rng(2)
    right = robot.read_text()
    relation = right[right.index("relations:") :]
    wrong = "" if forgotten else relation.replace(repr(-LEAD), repr(LEAD))
    robot.write_text(right.replace(relation, wrong))
    points = measured_points(tmp_path / "points.csv", true, 60, rng)
    outcome = run("calibrate", robot, points, "--terms", "kinematic")
    assert "Trusted: no" in outcome.out and "repeat no better" not in outcome.out
    said = re.search(
        r"declare `(relations: \[\{joint: j3, of: \{j3: 1, j4: (-?[0-9.]+)\}\}\])` in robot.yaml", outcome.out
    )
    assert said is not None and float(said[2]) == pytest.approx(-true.lead, rel=2e-3), outcome.out
    robot.write_text(right.replace(relation, said[1] + "\n"))
    assert "Trusted: no" not in run("calibrate", robot, points, "--terms", "kinematic").out


def predicted(seed: int, folder: Path) -> dict[str, Any]:
    """What `verify` says of fresh points of one SCARA."""
    robot, true, rng = write_robot(folder / str(seed)), Scara.drawn(100 + seed), np.random.default_rng(seed)
    points = measured_points(robot.parent / "points.csv", true, 60, rng)
    fresh = measured_points(robot.parent / "fresh.csv", true, 60, rng)
    return prediction_of(robot, points, fresh)


@pytest.mark.slow
def test_intervals_cover(tmp_path: Path) -> None:
    """Fresh points of 20 SCARAs, by default options."""
    assert_intervals_cover(over_seeds(predicted, range(20), tmp_path))
