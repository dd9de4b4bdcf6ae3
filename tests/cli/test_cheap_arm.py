"""`calibrate` of a low-cost arm: joint zeros far off, play of degrees, a camera of half a millimetre, and what that can tell."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cheap_arm import CheapArm
from over_seeds import over_seeds

from flexcal import RobotModel, calibrate, fit_geometry, read_poses, verify
from flexcal.calibration.diagnostics import is_implausible
from flexcal.model.parts import rotation_vector

NAMES = ("pan", "lift", "elbow", "flex", "roll")


def true_zeros(arm: CheapArm) -> np.ndarray:
    """Errors (5,) of the joint zeros, rad, with the tilts of the axes about the joints' own."""
    tilts = np.array([rotation_vector(tilt) for tilt in arm.tilts])
    zeros = arm.zeros + np.einsum("ij,ij->i", tilts, arm.axis)
    zeros[3] += tilts[4][1]
    return zeros


def zeros_in_use(arm: CheapArm, q: np.ndarray, with_backlash: list[str]) -> np.ndarray:
    """Errors (5,) of the joint zeros, rad, with the mean play that gravity takes up at the commands `q` where no backlash is modelled."""
    torque = np.array([arm.torques(row + arm.zeros) for row in q])
    play = np.where(np.abs(torque) > arm.friction, 0.5 * np.sign(torque) * arm.gap, 0.0).mean(axis=0)
    return true_zeros(arm) + np.where(np.isin(NAMES, with_backlash), 0.0, play)


def test_zeros_are_found_and_play_is_the_floor(tmp_path: Path, run) -> None:
    """One zero 17° off: it is found, the scatter is said to be the arm's, and nothing is told in micrometres."""
    arm, rng = CheapArm(13), np.random.default_rng(1013)
    robot = arm.write(tmp_path)
    file = arm.write_poses(tmp_path / "poses.csv", arm.postures(40, rng), rng)
    outcome = run("calibrate", robot, file, "--out", tmp_path / "out")
    assert outcome.status == 0
    found = json.loads((tmp_path / "out" / "results.json").read_text())
    worst = NAMES[1 + int(np.argmax(np.abs(arm.zeros[1:4])))]
    error = found["parameters"][f"{worst}.offset"]["estimate"] - true_zeros(arm)[NAMES.index(worst)]
    assert abs(np.rad2deg(error)) < 2.5
    assert not found["fit"]["is_implausible"]
    assert 3.0 < found["floor"]["rms_mm"] < 9.0
    assert f"joint zeros are far from those of the URDF: {worst}" in outcome.out
    assert "no better, or something moved between the poses" in outcome.out
    rows = [line for line in outcome.out.splitlines() if line.startswith("│ selected")]
    assert rows and not any(len(cell.split(".")[-1].strip()) > 1 for cell in rows[0].split("│")[3:6])


@pytest.mark.parametrize("joint", [1, 4])
def test_a_wrong_sign_is_no_play(tmp_path: Path, joint: int) -> None:
    arm, rng = CheapArm(3), np.random.default_rng(3)
    model = RobotModel.from_yaml(arm.write(tmp_path))
    poses = read_poses(arm.write_poses(tmp_path / "p.csv", arm.postures(40, rng), rng), model)
    wrong = poses.q * np.where(np.arange(5) == joint, -1, 1)
    assert is_implausible(fit_geometry(model, replace(poses, q=wrong), terms=("kinematic",)))


def of_one_arm(seed: int, folder: Path, count: int, board: bool) -> tuple[list[bool], float, list[float]]:
    """Whether zeros lie in their intervals, the error at fresh poses over that predicted, and errors of zeros, degrees."""
    arm, rng, folder = CheapArm(seed), np.random.default_rng(1000 + seed), folder / str(seed)
    model = RobotModel.from_yaml(arm.write(folder))
    files = [
        arm.write_poses(folder / f"{n}.csv", arm.postures(n, rng), rng, board=board) for n in (count, 41)
    ]
    calibration = calibrate(model, read_poses(files[0], model))
    assert not calibration.document()["fit"]["is_implausible"], seed
    rms = verify(calibration.robot, read_poses(files[1], model)).document()["rms_mm"]
    inside, far = [], []
    found = calibration.selected.model
    modelled = [found.joints[i].name for i in found.backlash_joints]
    used = zeros_in_use(arm, read_poses(files[0], model).q, modelled)
    for name, true in list(zip(NAMES, used, strict=True))[1:4]:
        far.append(np.rad2deg(calibration.model.value(f"{name}.offset") - true))
        interval = calibration.estimate.interval(f"{name}.offset")
        if interval is not None:
            inside.append(interval[0] <= true <= interval[1])
    return inside, rms["measured"] / rms["expected"], far


@pytest.mark.slow
@pytest.mark.parametrize(("count", "board"), [(25, True), (40, False), (60, True)])
def test_twenty_cheap_arms(tmp_path: Path, count: int, board: bool) -> None:
    """Zeros are found, errors at fresh poses are those predicted, and no data are refused."""
    found = over_seeds(of_one_arm, range(20, 40), tmp_path, count, board)
    inside, far = (np.concatenate([one[k] for one in found]) for k in (0, 2))
    ratios = [ratio for _, ratio, _ in found]
    assert np.sqrt(np.mean(np.square(far))) < 2.0
    # of one arm in twenty the play of several joints may add up at two of the 41 poses, to four times the rest
    assert 0.75 < np.sqrt(np.mean(np.square(ratios))) < 1.15 and np.sum(np.array(ratios) > 1.5) <= 1
    assert np.mean(inside) > 0.88
