"""LeRobot's calibration in and out, with LeRobot's own reading of motors written anew here, on an arm that shares nothing with flexcal."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cheap_arm import TICK, CheapArm
from cli_files import read_csv
from lerobot_files import MOTORS, SIGNS, ZEROS, calibration_file, record, ticks_of
from refusals import assert_refusal, refused

from flexcal.errors import InputError
from flexcal.export import JointMotor, MotorCalibration, corrected_file, joint_motors, read_motor_calibrations
from flexcal.jobs.accuracy import ZerosVerdict

OPTION = (
    "--motors",
    "pan=shoulder_pan",
    "lift=-shoulder_lift+90",
    "elbow=elbow_flex",
    "flex=wrist_flex",
    "roll=-wrist_roll",
)


def degrees_of(ticks: float, entry: dict) -> float:
    """What LeRobot makes of the ticks of a motor in degrees."""
    middle = (entry["range_min"] + entry["range_max"]) / 2
    return (ticks - middle) * 360 / (4096 - 1)


@pytest.fixture
def calibrated(tmp_path: Path, run):
    """Robot file, LeRobot's file, verification file, and the arm, calibrated by what was recorded of its motors."""

    def make(arm: CheapArm, *terms: str) -> tuple[Path, Path, Path]:
        robot, motors = arm.write(tmp_path), calibration_file(tmp_path / "motors.json")
        for name, count, seed in (("recorded", 50, 1), ("others", 40, 2)):
            q = record(arm, tmp_path / f"{name}_ticks.csv", count, seed)
            outcome = run(
                "import", robot, tmp_path / f"{name}_ticks.csv", "--lerobot", motors, *OPTION, "--out", tmp_path / f"{name}.csv",
                "--unchecked", "--sigma", "0.5",
            )  # fmt: skip
            assert outcome.status == 0, outcome.err
            header, rows = read_csv(tmp_path / f"{name}.csv")
            read = rows[:, [header.index(f"q{i}") for i in range(1, 6)]]
            np.testing.assert_allclose(read, q, atol=1e-4)
        assert run("calibrate", robot, tmp_path / "recorded.csv", *terms).status == 0
        return robot, motors, tmp_path / "others.csv"

    return make


def test_degrees_of_lerobot_become_true_angles(calibrated, run, tmp_path: Path) -> None:
    """One zero 17° off: after the export LeRobot's degrees are the angles of the URDF, within play and the last joints' freedom."""
    arm = CheapArm(13)
    robot, motors, others = calibrated(arm)
    out = tmp_path / "corrected.json"
    arguments = ("export", "lerobot", robot, "--calibration", motors, *OPTION, "--out", out)
    outcome = run(*arguments, "--verification", others, "--json")
    assert outcome.status == 0, outcome.err
    before, after = (json.loads(path.read_text()) for path in (motors, out))
    far = np.zeros((2, 3))
    for k, entries in enumerate((before, after)):
        for j in (1, 2, 3):
            # the true angle of the joint is what the old file says and its zero
            ticks = ticks_of(np.full(5, 0.3))[j]
            said = SIGNS[j] * np.deg2rad(degrees_of(ticks, entries[MOTORS[j]])) + ZEROS[j]
            far[k, j - 1] = np.rad2deg(said - (0.3 + arm.zeros[j]))
    assert np.abs(far[0]).max() > 15 and np.abs(far[1]).max() < 3
    verdict = outcome.document["zeros_or_geometry"]
    assert verdict["answer"] == "zeros" and verdict["recovered"] > 0.9 and verdict["poses"] == 40
    assert verdict["zeros"]["mean_mm"] < 0.35 * verdict["without"]["mean_mm"]
    for name, entry in before.items():
        new = after[name]
        assert {k: v for k, v in entry.items() if "range" not in k} == {
            k: v for k, v in new.items() if "range" not in k
        }
        assert entry["range_min"] <= new["range_min"] < new["range_max"] <= entry["range_max"]
    for name in ("gripper", "shoulder_pan", "wrist_roll"):
        assert after[name] == before[name]
    assert any("not determined, and as before: pan, roll" in said for said in outcome.document["remarks"])
    refusal = run(*arguments[:-1], tmp_path / "third.json", "--verification", tmp_path / "recorded.csv")
    assert_refusal(refusal.err, "E-ROS-030", "recorded.csv")
    assert not (tmp_path / "third.json").exists()
    assert "by the calibration's own account" in run(*arguments[:-1], tmp_path / "fourth.json").out


def test_geometry_is_said_to_be_needed(calibrated, run, tmp_path: Path) -> None:
    arm = CheapArm(5, zero=0.8, worst=1.5, play=(0.0, 0.0), length=6e-3, tilt=2.0, friction=0.0)
    robot, motors, others = calibrated(arm, "--terms", "kinematic")
    outcome = run(
        "export", "lerobot", robot, "--calibration", motors, *OPTION, "--out", tmp_path / "new.json", "--verification", others,
    )  # fmt: skip
    assert outcome.status == 0, outcome.err
    text = " ".join(outcome.out.split())
    assert "LeRobot's file cannot hold the rest" in text and "next: flexcal export urdf" in text


def test_only_ranges_change(tmp_path: Path) -> None:
    path = calibration_file(tmp_path / "m.json")
    motors = read_motor_calibrations(path)
    joint = JointMotor("lift", motors["shoulder_lift"], -1, 1.0)
    new = joint.corrected(0.2)
    assert joint.offset_to(new) == pytest.approx(0.2, abs=TICK / 4)
    text = corrected_file(path, [new])
    assert text == path.read_text().replace('"range_min": 790', f'"range_min": {new.range_min}').replace(
        '"range_max": 3310', f'"range_max": {new.range_max}'
    )
    assert (new.range_min, new.range_max) == (790 + 261, 3310) and read_motor_calibrations(path) == motors


@pytest.mark.parametrize("readings", ["ticks", "degrees", "percent"])
@pytest.mark.parametrize("drive_mode", [0, 1])
def test_readings_of_motors(readings, drive_mode: int) -> None:
    """As LeRobot normalises: percent are reversed by drive_mode, degrees are not."""
    motor = MotorCalibration("m", 1, 1, drive_mode, 0, 900, 3100)
    joint = JointMotor("j", motor, -1, 0.4)
    ticks = 2500.0
    percent = (ticks - 900) / 2200 * 200 - 100
    said = {
        "ticks": ticks,
        "degrees": (ticks - 2000) * 360 / 4095,
        "percent": -percent if drive_mode else percent,
    }[readings]
    gain, offset = joint.scale_and_shift(readings)
    assert gain * said + offset == pytest.approx(-500 * TICK + 0.4, abs=1e-12)


def test_bad_calibrations_are_named(tmp_path: Path) -> None:
    path = calibration_file(tmp_path / "m.json")
    good, motors = path.read_text(), read_motor_calibrations(path)
    for text, code, *names in (
        (good[:-3], "E-FILE-023", "m.json", "line"),
        ('{"motor_names": ["a"], "homing_offset": [1]}', "E-ROS-021", "m.json"),
        ("{}", "E-ROS-021", "m.json"),
        (good.replace('"id": 2', '"id": "two"'), "E-ROS-022", "9", "shoulder_lift", "id"),
        (good.replace('"range_min": 790', '"range_min": 3310'), "E-ROS-023", "9", "shoulder_lift", "3310"),
    ):
        path.write_text(text)
        with refused(code, *names):
            read_motor_calibrations(path)
    path.write_bytes(b"\xff{}")
    with refused("E-ROS-026", "m.json"):
        read_motor_calibrations(path)
    with refused("E-ROS-025", "m.json", "lift"):
        joint_motors(path, motors, ["shoulder_pan", "lift"], [])
    for entry in ("lift", "lift=shoulder", "left=shoulder_lift"):
        with refused("E-ROS-024", entry):
            joint_motors(path, motors, ["shoulder_pan", "lift"], [entry])
    with refused("E-ROS-019", "j"):
        JointMotor("j", motors["shoulder_pan"]).corrected(1.99)


def test_the_verdict_needs_a_difference() -> None:
    rng = np.random.default_rng(3)
    size = rng.uniform(1e-3, 2e-3, 40)
    assert ZerosVerdict(5 * size, size, size + 1e-5 * rng.normal(size=40)).answer == "zeros"
    assert ZerosVerdict(5 * size, 2 * size, size).answer == "geometry"
    assert ZerosVerdict(20 * size, 1.5 * size, size).answer == "zeros"
    assert ZerosVerdict(size, 0.95 * size, 0.97 * size).answer == "neither"
    assert ZerosVerdict(size, 0.5 * size, 1.2 * size).recovered is None


def test_other_input_that_cannot_be_used(run, tmp_path: Path) -> None:
    arm = CheapArm(1)
    robot, motors = arm.write(tmp_path), calibration_file(tmp_path / "motors.json")
    record(arm, tmp_path / "r.csv", 20, 1)
    base = ("export", "lerobot", robot, "--calibration", motors, "--out", tmp_path / "new.json")
    assert_refusal(run(*base, *OPTION).err, "E-ROS-027", "robot.yaml")
    read = ("import", robot, tmp_path / "r.csv")
    assert_refusal(run(*read, *OPTION).err, "E-ROS-032")
    (tmp_path / "r.csv").write_text((tmp_path / "r.csv").read_text().replace("elbow_flex.pos", "elbow"))
    assert_refusal(run(*read, "--lerobot", motors, *OPTION).err, "E-ROS-031", "r.csv", "elbow_flex")
    assert not (tmp_path / "new.json").exists() and issubclass(InputError, Exception)
