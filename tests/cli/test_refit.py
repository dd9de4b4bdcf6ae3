"""`verify` after the tracker was moved, with another reflector, and at a point that no calibration pose measured."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from refusals import assert_refusal
from stranger_arm import SIX, StrangerArm, rigid, turn


@pytest.fixture(scope="module")
def arm() -> StrangerArm:
    return StrangerArm(seed=21, axes=tuple(SIX))


@pytest.fixture
def robot(run, tmp_path: Path, arm: StrangerArm) -> Path:
    file, rng = arm.write(tmp_path), np.random.default_rng(1)
    q = arm.postures(60, rng)
    assert run("calibrate", file, arm.write_poses(tmp_path / "p.csv", q, arm.measured(q, rng))).status == 0
    return file


def moved() -> np.ndarray:
    return rigid(turn(np.array([0.1, -0.2, 1.0])), np.array([2.0, 0.5, -0.3]))


def fresh(arm: StrangerArm, path: Path, count: int = 25, **how) -> Path:
    rng = np.random.default_rng(5)
    q = arm.postures(count, rng)
    return arm.write_poses(path, q, arm.measured(q, rng, **how))


def brute_force(run, robot: Path, file: Path, document: dict, what: str) -> None:
    """The leave-one-out errors, each by a fit of its own without that pose, by SciPy on positions that `predict` says."""
    import polars as pl
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    table = pl.read_csv(file)
    commands = file.parent / "commands.csv"
    table.select(pl.col("pose"), pl.col("^q.*$")).write_csv(commands)
    out = file.parent / "tool.csv"
    assert run("predict", robot, commands, "--out", out).status == 0
    tool, seen = pl.read_csv(out), table.select("x", "y", "z").to_numpy()
    at = tool.select("x", "y", "z").to_numpy()
    turned = Rotation.from_quat(tool.select("qx", "qy", "qz", "qw").to_numpy()).as_matrix()
    size = {"station": 6, "station point": 9}[what]
    start = rigid_start(at, seen)

    def left(p: np.ndarray, rows: np.ndarray) -> np.ndarray:
        point = at[rows] + (turned[rows] @ p[6:] if size == 9 else 0.0)
        return seen[rows] - point @ turn(p[:3]).T - p[3:6]

    errors = []
    for k in range(len(at)):
        others = np.setdiff1d(np.arange(len(at)), [k])
        fit = least_squares(
            lambda p, o=others: left(p, o).ravel(), np.r_[start, np.zeros(size - 6)], xtol=1e-13, ftol=1e-13
        )
        errors.append(float(np.linalg.norm(left(fit.x, np.array([k])))))
    assert document["verification"]["measured"]["mean_mm"] == pytest.approx(1e3 * np.mean(errors), rel=2e-3)
    assert document["verification"]["measured"]["max_mm"] == pytest.approx(1e3 * np.max(errors), rel=1e-2)


def rigid_start(at: np.ndarray, seen: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    found, _ = Rotation.align_vectors(seen - seen.mean(0), at - at.mean(0))
    vector = found.as_rotvec()
    return np.r_[vector, seen.mean(0) - turn(vector) @ at.mean(0)]


def test_a_moved_tracker_is_said_and_refitted(run, robot: Path, arm: StrangerArm, tmp_path: Path) -> None:
    file = fresh(arm, tmp_path / "moved.csv", tracker=moved())
    done = run("verify", robot, file)
    assert done.status == 0 and "after a refit of the station 0.0" in done.out
    assert "--refit station verifies the geometry alone, and costs 2 poses" in done.out
    assert "Trusted: no" in done.out
    mapped = run("map", robot, "--verification", file, "--count", "50", "--out", tmp_path / "map.html")
    assert mapped.status == 2
    assert_refusal(mapped.err, "E-RUN-010", "after a refit of the station")
    plain = run("verify", robot, file, "--json").document
    assert plain["verification"]["measured"]["mean_mm"] > 100 and plain["refit"] is None
    assert plain["refit_proposed"]["what"] == ["station"]
    document = run("verify", robot, file, "--refit", "station", "--out", tmp_path / "v", "--json").document
    assert document["refit"]["parameters"] == 6 and document["refit"]["costs_poses"] == 2
    assert document["verification"]["as_calibrated"] == plain["verification"]["measured"]
    brute_force(run, robot, file, document, "station")
    rms = document["rms_mm"]
    assert rms["measured"] == pytest.approx(rms["expected"], rel=0.35)  # honest: as large as was predicted
    assert "station refitted (leave-one-out)" in (tmp_path / "v" / "report.html").read_text(encoding="utf-8")
    assert json.loads((tmp_path / "v" / "results.json").read_text())["refit"]["statistics"] == "leave_one_out"


def test_another_reflector_is_said_and_refitted(run, robot: Path, arm: StrangerArm, tmp_path: Path) -> None:
    file = fresh(arm, tmp_path / "other.csv", xyz=arm.true_xyz + np.array([0.03, -0.02, 0.01]))
    done = run("verify", robot, file)
    assert "after a refit of the point 0.0" in done.out and "--refit point" in done.out
    document = run("verify", robot, file, "--refit", "point", "--json").document
    assert document["refit"]["parameters"] == 3 and document["verification"]["measured"]["mean_mm"] < 0.06
    both = fresh(
        arm, tmp_path / "both.csv", xyz=arm.true_xyz + np.array([0.03, -0.02, 0.01]), tracker=moved()
    )
    assert "--refit station point" in run("verify", robot, both).out
    document = run("verify", robot, both, "--refit", "station", "point", "--json").document
    assert document["refit"]["parameters"] == 9
    brute_force(run, robot, both, document, "station point")


def test_nothing_is_proposed_where_nothing_moved(run, robot: Path, arm: StrangerArm, tmp_path: Path) -> None:
    file = fresh(arm, tmp_path / "same.csv")
    document = run("verify", robot, file, "--json").document
    assert document["refit_proposed"] is None and document["verification"]["measured"]["mean_mm"] < 0.06
    # a geometry that is wrong is no moved instrument: another arm's measurements
    wrong = fresh(StrangerArm(seed=22, axes=tuple(SIX)), tmp_path / "wrong.csv", tracker=arm.tracker)
    assert run("verify", robot, wrong, "--json").document["refit_proposed"] is None


def test_too_few_poses_to_refit(run, robot: Path, arm: StrangerArm, tmp_path: Path) -> None:
    file = fresh(arm, tmp_path / "few.csv", 3, tracker=moved())
    done = run("verify", robot, file, "--refit", "station", "point")
    assert done.status == 2
    assert_refusal(done.err, "E-CAL-019", "the instrument and the measured point")


def test_an_uncalibrated_point_is_never_silent(run, tmp_path: Path, arm: StrangerArm) -> None:
    robot, rng = arm.write(tmp_path), np.random.default_rng(2)
    q = arm.postures(60, rng)
    text = robot.read_text().replace("geometry:", "  nose: {frame: tool0, xyz: [0.1, 0.0, 0.2]}\ngeometry:")
    robot.write_text(text)
    poses = arm.write_poses(tmp_path / "p.csv", q, arm.measured(q, rng))
    assert run("calibrate", robot, poses).status == 0
    q = arm.postures(25, rng)
    file = arm.write_poses(
        tmp_path / "nose.csv", q, arm.measured(q, rng, xyz=np.array([0.102, 0.001, 0.197]))
    )
    lines = file.read_text().splitlines()
    file.write_text("\n".join([lines[0] + ",target", *(line + ",nose" for line in lines[1:])]) + "\n")
    done = run("verify", robot, file)
    assert "no calibration pose measured nose" in done.out and "Trusted: yes" not in done.out
    document = run("verify", robot, file, "--json").document
    assert (
        document["uncalibrated_points"] == ["nose"]
        and "calibrated_points" in str(document["verdict"]) + str(document["remarks"])
    ) or document["verdict"]["trusted"] is False
    found = run("verify", robot, file, "--refit", "point", "--json").document
    assert found["uncalibrated_points"] == [] and found["verification"]["measured"]["mean_mm"] < 0.1
    lines = (tmp_path / "p.csv").read_text().splitlines()
    (tmp_path / "n.csv").write_text(
        "\n".join([lines[0] + ",target", *(line + ",nose" for line in lines[1:])]) + "\n"
    )
    assert run("calibrate", robot, tmp_path / "n.csv").status == 0
    mapped = run("map", robot, "--count", "50", "--out", tmp_path / "map.html")
    assert mapped.status == 0 and "no calibration pose measured smr" in mapped.out
