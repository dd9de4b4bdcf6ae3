"""Joint offsets and Denavit-Hartenberg tables of another simulator's arms: what was not measured is not exported as if it were."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from stranger_arm import SIX, StrangerArm

from flexcal.model.robot import RobotModel

SLIDER = [
    ((0, 0, 1), (0, 0, 0.4)),
    ((0, 0, 1), (0.35, 0, 0.4)),
    ((0, 0, 1), (0.6, 0, 0.3)),
    ((0, 0, 1), (0.6, 0, 0.3)),
]
"""A SCARA: all axes parallel, the third one slides on the fourth."""


def calibrated(run, folder: Path, arm: StrangerArm, more: str = "") -> Path:
    robot, rng = arm.write(folder, more), np.random.default_rng(arm.seed + 20)
    q = arm.postures(60, rng)
    done = run("calibrate", robot, arm.write_poses(folder / "poses.csv", q, arm.measured(q, rng)))
    assert done.status == 0, done.err
    return robot


@pytest.mark.parametrize("xyz", [(0.05, 0.03, 0.08), (0.0005, 0.0, 0.08), (0.16, 0, 0.02)])
def test_zeros_that_no_reflector_tells_are_zero_and_marked(run, tmp_path: Path, xyz) -> None:
    arm = StrangerArm(seed=6, axes=tuple(SIX), declared_xyz=xyz, point_error=(0.002, 0.005, -0.002), size=0.0)
    arm.zeros = 1e-3 * np.array([1.5, -2.0, 1.0, 3.0, -1.0, 0.5])
    robot = calibrated(run, tmp_path, arm)
    done = run("export", "offsets", robot, "--out", tmp_path / "offsets.csv", "--json")
    assert done.status == 0, done.err
    joints = done.document["joints"]
    for name in ("a1", "a6"):
        assert (
            joints[name]["offset"] == 0.0 and not joints[name]["determined"] and joints[name]["std"] is None
        )
    found = np.array([joints[f"a{i}"]["offset"] for i in range(2, 6)])
    std = np.array([joints[f"a{i}"]["std"] for i in range(2, 6)])
    assert (
        (np.abs(found - arm.zeros[1:5]) < 4 * std + 2e-5).all() and std.max() < 5e-4 and done.document["safe"]
    )
    rows = [r for r in csv.reader((tmp_path / "offsets.csv").read_text().splitlines()) if len(r) == 8]
    assert [row[-1] for row in rows[1:7]] == ["no", "yes", "yes", "yes", "yes", "no"]
    page = run("export", "offsets", robot, "--out", tmp_path / "offsets.csv")
    assert "Not determined, and zero here: a1, a6." in page.out and "not determined" in page.out
    kept = run("export", "offsets", robot, "--out", tmp_path / "kept.csv", "--keep-frames", "--json")
    assert kept.document["joints"]["a1"]["offset"] == kept.document["joints"]["a6"]["offset"] == 0.0


def test_in_the_base_frame_the_first_zero_is_told(run, tmp_path: Path) -> None:
    arm = StrangerArm(seed=7, axes=tuple(SIX), tracker_at_base=True)
    arm.zeros[0] = 4e-3
    robot = calibrated(run, tmp_path, arm)
    found = run("export", "offsets", robot, "--out", tmp_path / "o.csv", "--keep-frames", "--json").document
    assert found["joints"]["a1"]["determined"]
    assert found["joints"]["a1"]["offset"] == pytest.approx(4e-3, abs=1.5e-3)


@pytest.mark.parametrize("convention", ["dh", "mdh"])
def test_tables_stay_near_nominal_and_mark_what_is_open(run, tmp_path: Path, convention: str) -> None:
    arm = StrangerArm(seed=8, axes=tuple(SIX), point_error=(0.002, 0.005, -0.002))
    robot = calibrated(run, tmp_path, arm)
    for options in ((), ("--four-parameters",)):
        done = run("export", convention, robot, "--out", tmp_path / "t.csv", *options, "--json")
        document = done.document
        assert document["safe"] and "enter the calibrated ones" in done.err
        for row in document["joints"].values():
            for key, value in row["calibrated"].items():
                assert abs(value - row["nominal"][key]) < 6e-3, key
        assert "theta" in document["joints"]["a1"]["undetermined"]
        assert document["joints"]["a1"]["std"]["theta"] is None
        assert "Not determined by what was measured" in " ".join(document["remarks"])


def test_theta_of_a_slide_stays(tmp_path: Path) -> None:
    """A SCARA, whose slide and last axis coincide: tenths of a millimetre between them must not turn its theta."""
    from flexcal.export import render_dh

    arm = StrangerArm(seed=9, axes=tuple(SLIDER))
    robot = arm.write(tmp_path)
    text = (tmp_path / "arm.urdf").read_text()
    third = text.index('name="a3" type="revolute"')
    text = text[:third] + text[third:].replace("revolute", "prismatic", 1)
    (tmp_path / "arm.urdf").write_text(text)
    nominal = RobotModel.from_yaml(robot)
    rng = np.random.default_rng(0)
    wrong = nominal.with_values(
        {
            f"a{i}.{key}": 3e-4 * rng.normal()
            for i in (1, 2, 3, 4)
            for key in ("length_x", "length_y", "misalignment_1")
        }
    )
    for convention in ("standard", "modified"):
        for four in (False, True):
            rows = render_dh(wrong, nominal, convention, four_parameters=four).table["joints"]
            change = [rows[j]["calibrated"]["theta"] - rows[j]["nominal"]["theta"] for j in rows]
            assert np.abs(change).max() < 5e-3
            assert all(abs(r["calibrated"]["d"] - r["nominal"]["d"]) < 5e-3 for r in rows.values())
