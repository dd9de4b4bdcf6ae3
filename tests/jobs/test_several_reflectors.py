"""Three reflectors of one pose share the errors of the joints, which differ from joint to joint; an arm of the test's own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm, postures, ry, rz, write_robot

from flexcal import Calibration, PoseSet, RobotModel, calibrate, read_poses, verify
from flexcal.calibration.measurement import predict_measurements
from flexcal.jobs.inputs import CalibratedRobot

PLATE = np.array([[0.10, 0.0, 0.08], [-0.06, 0.09, 0.10], [-0.05, -0.08, 0.14]])
"""Reflectors r0, r1 and r2 in the flange, m, as declared."""
STRONG_WRIST, STRONG_BASE = (20.0, 20.0, 20.0, 150.0, 150.0, 150.0), (60.0, 30.0, 20.0, 5.0, 5.0, 5.0)
"""Repeatability of the joints, µrad."""


@dataclass
class Plate:
    """An arm with three reflectors on its flange, before a tracker of 10 µm."""

    folder: Path
    seed: int
    scatter: tuple[float, ...]

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng([self.seed, 3])
        self.arm = DHArm.made(self.seed)
        self.true = PLATE + 1e-3 * self.rng.normal(size=PLATE.shape)
        self.tracker = rz(self.rng.uniform(-3, 3)) @ ry(0.2 * self.rng.normal())
        robot = write_robot(self.folder)
        points = "".join(f"  r{k}: {{frame: flange, xyz: {xyz.tolist()}}}\n" for k, xyz in enumerate(PLATE))
        robot.write_text(f"robot: robot.urdf\npoints:\n{points}geometry: {{terms: [kinematic]}}\n")
        self.model = RobotModel.from_yaml(robot, estimates=False)

    def measured(self, count: int, *, still: bool = False) -> PoseSet:
        """All reflectors in every pose; `still`: without scatter and noise."""
        q = postures(self.rng, count)
        moved = q if still else q + 1e-6 * np.array(self.scatter) * self.rng.normal(size=q.shape)
        lines = ["pose,target,q1,q2,q3,q4,q5,q6,x,y,z,sigma"]
        for k, xyz in enumerate(self.true):
            seen = replace(self.arm, tool=xyz).points(moved) @ self.tracker[:3, :3].T + [2.0, 0.3, 0.1]
            seen += 0.0 if still else 1e-5 * self.rng.normal(size=seen.shape)
            for i, numbers in enumerate(np.hstack([q, seen]).tolist()):
                lines.append(",".join([str(i), f"r{k}", *map(repr, numbers), "1e-5"]))
        (self.folder / "poses.csv").write_text("\n".join(lines) + "\n")
        return read_poses(self.folder / "poses.csv", self.model)


def of(poses: PoseSet, targets: tuple[str, ...]) -> PoseSet:
    return poses.subset(np.isin(poses.target, targets))


def p90(calibration: Calibration, exact: PoseSet) -> float:
    return float(
        np.percentile(np.linalg.norm(predict_measurements(calibration.model, exact).residual, axis=1), 90)
    )


@pytest.mark.parametrize("scatter", [STRONG_WRIST, STRONG_BASE], ids=["wrist", "base"])
def test_three_reflectors_together_are_no_worse_and_err_as_predicted(
    tmp_path: Path, scatter: tuple[float, ...]
) -> None:
    """P90 at exact fresh points of each reflector; observed over predicted errors at measured ones, which was .66 and 1.1."""
    alone, together, ratios = [], [], []
    names = ("r0", "r1", "r2")
    for seed in range(2):
        (tmp_path / str(seed)).mkdir()
        plate = Plate(tmp_path / str(seed), seed, scatter)
        poses, exact, fresh = plate.measured(40), plate.measured(150, still=True), plate.measured(60)
        whole = calibrate(plate.model, poses)
        together += [p90(whole, of(exact, (name,))) for name in names]
        alone += [p90(calibrate(plate.model, of(poses, (n,))), of(exact, (n,))) for n in names]
        ratios.append(verify(whole.robot, fresh).document()["prediction"]["ratio"])
    assert np.mean(together) < np.mean(alone)
    assert np.sqrt(np.mean(np.square(ratios))) == pytest.approx(1, abs=0.15)


def test_the_scatter_of_each_joint_is_found_and_stored(tmp_path: Path) -> None:
    """Of 80 poses, to a third where it is large; a robot that is read again predicts the same."""
    plate = Plate(tmp_path, 5, STRONG_WRIST)
    calibration = calibrate(plate.model, plate.measured(80))
    found = [calibration.model.value(f"scatter.joint_{k}.angular") for k in range(1, 7)]
    np.testing.assert_allclose(found[3:], 150e-6, rtol=0.35)
    assert max(found[:3]) < 60e-6
    every = calibration.model.value("scatter.angular")
    assert every == pytest.approx(float(np.sqrt(np.mean(np.square(found)))), rel=1e-9)
    low, high = calibration.estimate.interval("scatter.joint_5.angular")  # type: ignore[misc]
    assert low < found[4] < high
    fresh = plate.measured(20)
    calibration.write(tmp_path / "out")
    again = CalibratedRobot.from_yaml(plate.folder / "robot.yaml", tmp_path / "out").model
    assert again.scatter.joints == pytest.approx(calibration.model.scatter.joints, rel=1e-6)
    assert verify(calibration.robot, fresh).document()["rms_mm"]["expected"] < 0.12


def test_one_reflector_tells_no_joints_apart(tmp_path: Path) -> None:
    plate = Plate(tmp_path, 5, STRONG_WRIST)
    calibration = calibrate(plate.model, of(plate.measured(60), ("r0",)))
    assert not calibration.model.scatter.joints.any()
    assert not any("joint_" in name for name in calibration.estimate.values if name.startswith("scatter."))
