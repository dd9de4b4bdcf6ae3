"""Calibration from measured points and orientations of a robot that shares no code with the package."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import assert_refusal
from scipy.spatial.transform import Rotation

from flexcal import RobotModel, calibrate, read_poses, verify
from flexcal.cli.main import main

PLACES = np.array([[0, 0, 0.4], [0.15, 0, 0], [0, 0, 0.6], [0.7, 0, 0.12], [0, 0, 0], [0.1, 0, 0]])
TURNS = np.deg2rad([[0, 0, 0], [-90, 0, 0], [0, 0, -90], [0, 90, 0], [0, -90, 0], [0, 90, 0]])
TARGET = np.array([0.05, 0.03, 0.12])
NOISE, TURNING = 3e-5, 2e-4


def urdf(path: Path) -> Path:
    parts = ['<link name="l0"/>']
    for i, (xyz, rpy) in enumerate(zip(PLACES, TURNS, strict=True)):
        parts.append(
            f'<link name="l{i + 1}"/><joint name="j{i + 1}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
            f'<origin xyz="{" ".join(map(repr, xyz.tolist()))}" rpy="{" ".join(map(repr, rpy.tolist()))}"/><axis xyz="0 0 1"/>'
            '<limit lower="-2.9" upper="2.9" effort="50" velocity="2"/></joint>'
        )
    path.write_text(f'<robot name="six">{"".join(parts)}</robot>')
    return path


class Arm:
    """An arm with axes off by 0.5 mm and 1 mrad, a target turned anyhow on its flange, and an instrument anywhere."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.place = PLACES + 5e-4 * rng.normal(size=PLACES.shape)
        bent = Rotation.from_rotvec(1e-3 * rng.normal(size=TURNS.shape))
        self.turn = (Rotation.from_euler("xyz", TURNS) * bent).as_matrix()
        self.offset = 2e-3 * rng.normal(size=6)
        self.target = TARGET + 2e-3 * rng.normal(size=3)
        self.mounted = Rotation.random(random_state=int(rng.integers(1 << 31))).as_matrix()
        self.seen = Rotation.random(random_state=int(rng.integers(1 << 31))).as_matrix()
        self.from_ = rng.uniform(-3, 3, 3)

    def measured(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) and orientation (3, 3) of the target as the instrument sees them."""
        at, axes = np.zeros(3), np.eye(3)
        for place, turn, angle in zip(self.place, self.turn, q + self.offset, strict=True):
            at, axes = at + axes @ place, axes @ turn @ Rotation.from_euler("z", angle).as_matrix()
        at = at + axes @ self.target
        return self.seen @ at + self.from_, self.seen @ axes @ self.mounted


def recorded(
    path: Path, arm: Arm, rng: np.random.Generator, count: int, *, turned: bool = True, sigma: bool = True
) -> Path:
    rows = []
    for k in range(count):
        q = rng.uniform(-1.5, 1.5, 6)
        at, axes = arm.measured(q)
        at = at + NOISE * rng.normal(size=3)
        w = (Rotation.from_rotvec(TURNING * rng.normal(size=3)) * Rotation.from_matrix(axes)).as_quat()[
            [3, 0, 1, 2]
        ]
        row = [k + 1, *q, *at, *(w * rng.choice([-1, 1]) if turned else []), *([NOISE] if sigma else [])]
        rows.append(",".join(repr(float(v)) for v in [*row, *([TURNING] if sigma and turned else [])]))
    header = [
        "pose",
        *(f"q{i + 1}" for i in range(6)),
        "x",
        "y",
        "z",
        *(["qw", "qx", "qy", "qz"] if turned else []),
    ]
    header += ["sigma"] if sigma else []
    header += ["sigma_angle"] if sigma and turned else []
    path.write_text("\n".join([",".join(header), *rows]) + "\n")
    return path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    urdf(tmp_path / "six.urdf")
    point = "points: {target: {frame: l6, xyz: [0.05, 0.03, 0.12]}}\n"
    (tmp_path / "robot.yaml").write_text(f"robot: six.urdf\n{point}")
    return tmp_path


def test_orientations_make_the_orientation_of_the_tool_accurate(folder: Path) -> None:
    rng = np.random.default_rng(5)
    arm = Arm(rng)
    model = RobotModel.from_yaml(folder / "robot.yaml")
    poses = read_poses(recorded(folder / "full.csv", arm, rng, 60), model)
    fresh = read_poses(recorded(folder / "fresh.csv", arm, rng, 100), model)
    both = verify(calibrate(model, poses).robot, fresh)
    points = verify(calibrate(model, poses.without_orientations()).robot, fresh)
    assert both.orientation is not None and points.orientation is not None
    full, alone = both.orientation.document(), points.orientation.document()
    assert alone["placed"] == ["target"] and not full["placed"]
    assert full["mean_deg"] < 0.025  # the noise alone leaves 0.018
    assert full["rms_deg"] == pytest.approx(full["expected_rms_deg"], rel=0.12)
    assert both.errors.mean < 1.02 * points.errors.mean
    assert full["mean_deg"] <= alone["mean_deg"]


def test_a_coupling_that_robot_yaml_lacks_is_found_in_full_poses(folder: Path) -> None:
    """The fifth joint follows a tenth of the fourth; the orientations of the bad fit do no harm."""
    rng = np.random.default_rng(8)
    arm = Arm(rng)
    measured = arm.measured
    arm.measured = lambda q: measured(q + 0.1 * q[3] * np.eye(6)[4])  # type: ignore[method-assign]
    model = RobotModel.from_yaml(folder / "robot.yaml")
    found = calibrate(
        model, read_poses(recorded(folder / "full.csv", arm, rng, 40), model), terms=["kinematic"]
    )
    assert found.coupling is not None
    assert (found.coupling.joint, found.coupling.other) == (model.joint_names[4], model.joint_names[3])
    assert found.coupling.ratio == pytest.approx(0.1, abs=0.01)


def test_the_command_line_tells_the_orientations(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(6)
    arm = Arm(rng)
    recorded(folder / "full.csv", arm, rng, 40, sigma=False)
    recorded(folder / "fresh.csv", arm, rng, 30, sigma=False)
    robot = str(folder / "robot.yaml")
    assert main(["calibrate", robot, str(folder / "full.csv"), "--out", str(folder / "out")]) == 0
    assert "angle to the measured orientations" in capsys.readouterr().out
    results = json.loads((folder / "out" / "results.json").read_text())
    assert results["orientation"]["before"]["mean_deg"] > 5 * results["orientation"]["calibrated"]["mean_deg"]
    assert results["parameters"]["scatter.orientation"]["estimate"] == pytest.approx(TURNING, rel=0.15)
    assert (
        main(["verify", robot, str(folder / "fresh.csv"), "--estimates", str(folder / "out"), "--json"]) == 0
    )
    document = json.loads(capsys.readouterr().out)
    calibrated = document["orientation"]["calibrated"]
    assert calibrated["rms_deg"] == pytest.approx(calibrated["expected_rms_deg"], rel=0.25)


def test_orientations_of_another_convention_are_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(7)
    lines = recorded(folder / "full.csv", Arm(rng), rng, 30).read_text().splitlines()
    header = lines[0].replace("qw,qx,qy,qz", "qx,qy,qz,qw")
    (folder / "other.csv").write_text("\n".join([header, *lines[1:]]) + "\n")
    assert main(["calibrate", str(folder / "robot.yaml"), str(folder / "other.csv")]) == 2
    assert_refusal(capsys.readouterr().err, "E-CAL-012", "flexcal import")


def test_a_wrong_orientation_is_listed(folder: Path) -> None:
    rng = np.random.default_rng(8)
    model = RobotModel.from_yaml(folder / "robot.yaml")
    poses = read_poses(recorded(folder / "full.csv", Arm(rng), rng, 50), model)
    assert poses.quaternion_wxyz is not None
    turn = Rotation.from_quat(poses.quaternion_wxyz[17], scalar_first=True) * Rotation.from_euler(
        "x", 3, degrees=True
    )
    poses.quaternion_wxyz[17] = turn.as_quat(scalar_first=True)
    calibration = calibrate(model, poses)
    assert list(calibration.selected.estimate.outliers) == [17]
    assert "pose 18" in calibration.summary() and "3.0" in calibration.summary()


def over_prediction(seed: int, folder: Path) -> float:
    """Mean square of the angles to fresh orientations over the predicted one."""
    model, rng = RobotModel.from_yaml(folder / "robot.yaml"), np.random.default_rng(seed)
    arm, stated = Arm(rng), bool(seed % 2)
    poses = read_poses(recorded(folder / f"full_{seed}.csv", arm, rng, 50, sigma=stated), model)
    fresh = read_poses(recorded(folder / f"fresh_{seed}.csv", arm, rng, 200, sigma=stated), model)
    orientation = verify(calibrate(model, poses).robot, fresh).orientation
    assert orientation is not None and orientation.expected is not None
    return float(np.mean(np.sum(orientation.rotations**2, axis=1))) / orientation.expected**2


@pytest.mark.slow
def test_the_predicted_error_of_fresh_orientations_is_true(folder: Path) -> None:
    ratio = np.mean(over_seeds(over_prediction, range(100, 120), folder))
    print(f"{ratio:.3f} of the predicted square")
    assert ratio == pytest.approx(1, abs=0.05)
