"""`identify tool`: the tip from touches of a fixed point, on arms of strangers, exact and with joints that are off."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import assert_refusal
from stranger_arm import SIX, StrangerArm
from test_distances import points, reached

from flexcal import RobotModel, calibrate, read_poses
from flexcal.data.poses import read_touches
from flexcal.jobs.tool import identify_tip

PLACE = np.array([0.75, 0.1, 0.6])


def touched(
    arm: StrangerArm,
    path: Path,
    count: int,
    rng: np.random.Generator,
    *,
    noise: float = 0.0,
    spread: float = 0.5,
) -> Path:
    """Poses at which the true tip is at the fixed point, off by the noise, in orientations about one posture."""
    start = reached(arm, lambda p: p - PLACE, arm.postures(1, np.random.default_rng(1))[0])
    assert start is not None
    rows = ["q1,q2,q3,q4,q5,q6"]
    while len(rows) <= count:
        off = noise * rng.normal(size=3)
        q = reached(
            arm,
            lambda p, off=off: p - PLACE - off,
            start + spread * rng.uniform(-1, 1, 6) * [0.2, 0.3, 0.3, 1, 1, 1],
        )
        if q is not None:
            rows.append(",".join(map(repr, q.tolist())))
    path.write_text("\n".join(rows) + "\n")
    return path


def test_an_exact_arm_has_the_tip_where_it_is(tmp_path: Path, run) -> None:
    arm = StrangerArm(2, axes=tuple(SIX), size=0.0)
    robot = arm.write(tmp_path)
    file = touched(arm, tmp_path / "touches.csv", 6, np.random.default_rng(3))
    rows = file.read_text().splitlines()
    # columns of the commands that 'compensate' wrote
    file.write_text("\n".join([f"{rows[0]},target,unambiguous", *(f"{row},smr,true" for row in rows[1:])]))
    outcome = run(
        "identify", "tool", robot, file, "--frame", "tool0", "--name", "gripper", "--out", tmp_path / "out"
    )
    assert outcome.status == 0
    found = json.loads((tmp_path / "out" / "results.json").read_text())
    assert np.allclose(found["xyz_m"], arm.true_xyz, atol=2e-6)
    assert "points: {gripper: {frame: tool0, xyz: [0.05" in outcome.out
    assert found["rms_mm"] < 2e-3


def test_a_wrong_touch_is_named_and_left_out(tmp_path: Path) -> None:
    arm = StrangerArm(5, axes=tuple(SIX), size=0.3)
    model = RobotModel.from_yaml(arm.write(tmp_path))
    file = touched(arm, tmp_path / "touches.csv", 12, np.random.default_rng(4), noise=5e-5)
    lines = file.read_text().splitlines()
    cells = np.array(lines[5].split(","), dtype=float)
    lines[5] = ",".join(map(repr, (cells + np.array([0.02, 0, 0, 0, 0, 0])).tolist()))
    file.write_text("\n".join(lines) + "\n")
    found = identify_tip(model, read_touches(file, model), frame="tool0")
    assert [int(i) for i in np.flatnonzero(~found.fit.kept)] == [4]
    assert "pose 5" in " ".join(found.remarks)
    assert np.linalg.norm(found.xyz - arm.true_xyz) < 1e-3


def test_the_calibrated_arm_narrows_the_interval(tmp_path: Path) -> None:
    """Touches that an uncalibrated arm blurs are known better after a calibration, and the remark says whose error it is.

    But along the last axis, where no point tells the flange from the tool: it is known to the tolerance of lengths, as it is off.
    """
    arm, rng = StrangerArm(7, axes=tuple(SIX)), np.random.default_rng(7)
    model = RobotModel.from_yaml(arm.write(tmp_path))
    file = touched(arm, tmp_path / "touches.csv", 10, rng, noise=2e-5)
    blurred = identify_tip(model, read_touches(file, model), frame="tool0")
    q = arm.postures(60, rng)
    poses = read_poses(arm.write_poses(tmp_path / "points.csv", q, arm.measured(q, rng)), model)
    calibrated = calibrate(model, poses, terms=["kinematic"]).model
    sharp = identify_tip(calibrated, read_touches(file, model), frame="tool0")
    assert np.median(sharp.half_width) < 0.5 * np.median(blurred.half_width)
    assert 3e-4 < sharp.half_width.max() < 1.5e-3
    assert sharp.fit.rms < 0.5 * blurred.fit.rms
    assert "not calibrated" in blurred.remarks[0]
    assert "its calibration leaves" in sharp.remarks[0]


def test_bad_touches(tmp_path: Path, run) -> None:
    arm = StrangerArm(2, axes=tuple(SIX), size=0.0)
    robot = arm.write(tmp_path)
    file = touched(arm, tmp_path / "touches.csv", 6, np.random.default_rng(3))
    lines = file.read_text().splitlines()

    def refused(code: str, *named: str) -> None:
        outcome = run("identify", "tool", robot, file, "--frame", "tool0")
        assert (outcome.status, outcome.out) == (2, "")
        assert_refusal(outcome.err, code, *named)

    file.write_text("\n".join(lines[:3]) + "\n")
    refused("E-TOOL-007", "2")
    file.write_text("\n".join([lines[0], *[lines[1]] * 5]) + "\n")
    refused("E-TOOL-008", "orientation")
    first = np.array(lines[1].split(","), dtype=float)
    about = [",".join(map(repr, (first + np.array([0, 0, 0, 0, 0, 0.3 * k])).tolist())) for k in range(5)]
    file.write_text("\n".join([lines[0], *about]) + "\n")
    refused("E-TOOL-009", "axis")


def tip_inside(seed: int, folder: Path, count: int) -> np.ndarray:
    """Whether the coordinates (3,) of one arm's tip lie in their intervals."""
    arm = StrangerArm(seed, axes=tuple(SIX))
    folder = folder / str(seed)
    model = RobotModel.from_yaml(arm.write(folder))
    file = touched(arm, folder / "touches.csv", count, np.random.default_rng(seed), noise=5e-5)
    found = identify_tip(model, read_touches(file, model), frame="tool0")
    # the zero of the last joint turns the tip in the frame, which no touch tells; the flange is off by 0.03 mm besides
    axis = arm.flange[:3, :3].T @ arm.direction[-1]
    own = arm.true_xyz + np.cross(arm.zeros[-1] * axis, arm.true_xyz)
    return np.abs(found.xyz - own) <= found.half_width


@pytest.mark.slow
@pytest.mark.parametrize("count", [4, 12])
def test_intervals_of_tips_cover(tmp_path: Path, count: int) -> None:
    """Of 40 arms with joints off by 0.8 mrad and 0.3 mm, uncalibrated."""
    assert np.mean(over_seeds(tip_inside, range(100, 140), tmp_path, count)) > 0.85


def test_points_of_the_tests_are_reached() -> None:
    arm = StrangerArm(2, axes=tuple(SIX))
    q = reached(arm, lambda p: p - PLACE, arm.postures(1, np.random.default_rng(1))[0])
    assert q is not None
    assert np.allclose(points(arm, q[None])[0], PLACE, atol=1e-9)


@pytest.mark.parametrize("off", [(0.0, 0.0, 0.0), (0.008, -0.006, 0.005)])
def test_a_misplaced_reflector_of_the_calibration_does_not_move_the_tip(
    tmp_path: Path, run, off: tuple[float, float, float]
) -> None:
    """The calibration's estimates, which a folder named by --estimates has, say where the reflector is, not where the flange is."""
    arm = StrangerArm(7, axes=tuple(SIX), point_error=off)
    holding = StrangerArm(7, axes=tuple(SIX), point_error=(-0.03, 0.02, 0.07))
    robot, rng = arm.write(tmp_path), np.random.default_rng(7)
    q = arm.postures(60, rng)
    poses = arm.write_poses(tmp_path / "points.csv", q, arm.measured(q, rng))
    assert run("calibrate", robot, poses, "--out", tmp_path / "calibrated").status == 0
    file = touched(holding, tmp_path / "touches.csv", 12, rng, noise=2e-5)
    arguments = ("identify", "tool", robot, file, "--frame", "tool0", "--json")
    stored = ("--estimates", tmp_path / "calibrated")
    found, uncalibrated = (run(*arguments, *more).document for more in (stored, ()))
    error = np.linalg.norm(np.array(found["xyz_m"]) - holding.true_xyz)
    assert error < 5e-4
    assert error < 2 * np.linalg.norm(np.array(uncalibrated["xyz_m"]) - holding.true_xyz)
