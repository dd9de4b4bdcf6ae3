"""Calibration with a camera and a printed board; OpenCV projects and renders, and the robot shares no code with the package."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import assert_refusal
from scipy.spatial.transform import Rotation
from test_full_poses import Arm, recorded, urdf

from flexcal import RobotModel, calibrate, prediction_errors, read_poses, verify
from flexcal.cli.main import main
from flexcal.data.camera import projected
from flexcal.data.poses import concatenate, read_grouped_poses
from flexcal.model.kinematics import point_kinematics

CAMERA = np.array([[1100, 0, 630], [0, 1090, 490], [0, 0, 1.0]])
DISTORTION = np.array([-0.2, 0.1, 0.001, -0.0005, 0.02])
SIZE = (1280, 960)
SQUARE = 0.03
MIDDLE = np.array([0.135, 0.105, 0])
BOARD = np.array([[c * SQUARE, r * SQUARE, 0] for r in range(1, 7) for c in range(1, 9)]) - MIDDLE
"""Corners from the middle of the board."""
START = np.array([0.3, -0.5, 0.9, 0.2, 0.7, 0.1])
ROBOT = """robot: six.urdf
points: {{camera: {{frame: l6, xyz: [0.05, 0.03, 0.12]}}}}
measurements:
  eye: {{kind: camera, size: [1280, 960], board: {{kind: charuco, columns: 9, rows: 7, square: {square}, marker: 0.022, std: 1.0e-4}}}}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    urdf(tmp_path / "six.urdf")
    (tmp_path / "robot.yaml").write_text(ROBOT.format(square=SQUARE))
    return tmp_path


class Cell:
    """An arm with a camera on its hand, and a board somewhere before it."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.arm = Arm(self.rng)
        self.arm.mounted = Rotation.from_rotvec(0.05 * self.rng.normal(size=3)).as_matrix()
        at, axes = self.camera(START)
        self.axes = axes @ Rotation.from_rotvec(0.2 * self.rng.normal(size=3)).as_matrix()
        self.at = at + 0.5 * axes[:, 2]

    def camera(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Place (3,) and axes (3, 3) of the camera in the robot's base."""
        at, axes = self.arm.measured(q)
        return self.arm.seen.T @ (at - self.arm.from_), self.arm.seen.T @ axes

    def view(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Rotation vector and translation of the board before the camera, None where it is not well in sight."""
        at, axes = self.camera(q)
        corners = (BOARD @ self.axes.T + self.at - at) @ axes
        if corners[:, 2].min() < 0.2 or corners[:, 2].max() > 0.9 or self.axes[:, 2] @ axes[:, 2] < 0.6:
            return None
        turn = Rotation.from_matrix(axes.T @ self.axes).as_rotvec()
        pixels = cv2.projectPoints(BOARD, turn, axes.T @ (self.at - at), CAMERA, DISTORTION)[0][:, 0]
        inside = ((pixels > 5) & (pixels < np.array(SIZE) - 5)).all(axis=1)
        return (turn, axes.T @ (self.at - at)) if inside.sum() >= 24 else None

    def poses(self, count: int) -> list[np.ndarray]:
        found: list[np.ndarray] = []
        while len(found) < count:
            q = START + self.rng.uniform(-1, 1, 6) * [0.4, 0.3, 0.3, 0.7, 0.7, 1.2]
            if self.view(q) is not None:
                found.append(q)
        return found

    def corners(self, path: Path, count: int, *, noise: float = 0.2, mirrored: bool = False) -> Path:
        """Write a file of corners with pixel noise."""
        rows = ["pose,q1,q2,q3,q4,q5,q6,corner,u,v"]
        for k, q in enumerate(self.poses(count)):
            view = self.view(q)
            assert view is not None
            pixels = cv2.projectPoints(BOARD, *view, CAMERA, DISTORTION)[0][:, 0] + noise * self.rng.normal(
                size=(48, 2)
            )
            for i in np.flatnonzero(((pixels > 0) & (pixels < SIZE)).all(axis=1)):
                number = i // 8 * 8 + 7 - i % 8 if mirrored else i
                rows.append(",".join(map(repr, [k + 1, *q.tolist(), int(number), *pixels[i].tolist()])))
        path.write_text("\n".join(rows) + "\n")
        return path


def test_projection_is_that_of_opencv() -> None:
    points = np.random.default_rng(0).normal(size=(20, 3)) * [0.2, 0.2, 0.1] + [0, 0, 1]
    lens = np.array([1100, 1090, 630, 490, *DISTORTION])
    seen = cv2.projectPoints(points, np.zeros(3), np.zeros(3), CAMERA, DISTORTION)[0][:, 0]
    np.testing.assert_allclose(projected(points, lens)[0], seen, atol=1e-9)


def test_a_camera_on_the_hand_calibrates_robot_camera_and_board(folder: Path) -> None:
    cell = Cell(1)
    model = RobotModel.from_yaml(folder / "robot.yaml")
    poses = read_poses(cell.corners(folder / "views.csv", 60), model)
    found = calibrate(model, poses)
    assert found.estimate.reduced_chi2 == pytest.approx(1, abs=0.3)
    for key, true in zip(("fx", "fy", "cx", "cy", "k1"), (1100, 1090, 630, 490, -0.2), strict=True):
        low, high = found.estimate.interval(f"camera.eye.{key}")  # type: ignore[misc]
        assert low - 0.5 * (high - low) < true < high + 0.5 * (high - low)
    order = np.random.default_rng(0).permutation(len(poses))
    again = calibrate(model, poses.subset(order), terms=["kinematic"])
    before = calibrate(model, poses, terms=["kinematic"])
    np.testing.assert_allclose(again.residuals, before.residuals[order], atol=1e-8)


def test_the_command_line_takes_corners_and_verifies_others(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell, robot = Cell(2), str(folder / "robot.yaml")
    cell.corners(folder / "views.csv", 50), cell.corners(folder / "fresh.csv", 30)
    assert main(["calibrate", robot, str(folder / "views.csv"), "--out", str(folder / "out")]) == 0
    assert "by a camera" in capsys.readouterr().out
    assert (
        main(["verify", robot, str(folder / "fresh.csv"), "--estimates", str(folder / "out"), "--json"]) == 0
    )
    document = json.loads(capsys.readouterr().out)
    assert document["rms_mm"]["measured"] == pytest.approx(document["rms_mm"]["expected"], rel=0.35)


def test_a_camera_in_the_cell_calibrates_a_robot_that_holds_the_board(folder: Path) -> None:
    text = ROBOT.format(square=SQUARE).replace("kind: camera,", "kind: camera, mounted: cell,")
    (folder / "robot.yaml").write_text(text.replace("points: {camera:", "points: {board:"))
    model, cell, rows = (
        RobotModel.from_yaml(folder / "robot.yaml"),
        Cell(7),
        ["pose,q1,q2,q3,q4,q5,q6,corner,u,v"],
    )
    at, axes = cell.camera(START)  # of the board, which the hand holds now
    eye = axes @ Rotation.from_rotvec([0.1, -0.15, 0.2]).as_matrix()
    place, pose = at - 0.6 * eye[:, 2], 0
    while pose < 50:
        q = START + cell.rng.uniform(-1, 1, 6) * [0.3, 0.25, 0.25, 0.7, 0.6, 1.2]
        at, axes = cell.camera(q)
        turn, move = eye.T @ axes, eye.T @ (at - place)
        corners = BOARD @ turn.T + move
        if corners[:, 2].min() < 0.25 or turn[2, 2] < 0.6:
            continue
        pixels = cv2.projectPoints(BOARD, Rotation.from_matrix(turn).as_rotvec(), move, CAMERA, DISTORTION)[
            0
        ][:, 0]
        inside = np.flatnonzero(((pixels > 5) & (pixels < np.array(SIZE) - 5)).all(axis=1))
        if len(inside) < 24:
            continue
        pose, pixels = pose + 1, pixels + 0.2 * cell.rng.normal(size=(48, 2))
        rows += [",".join(map(repr, [pose, *q.tolist(), int(i), *pixels[i].tolist()])) for i in inside]
    (folder / "views.csv").write_text("\n".join(rows) + "\n")
    found = calibrate(model, read_poses(folder / "views.csv", model))
    assert found.estimate.reduced_chi2 == pytest.approx(1, abs=0.3)
    assert found.estimate.values["camera.eye.fx"] == pytest.approx(1100, abs=1.5)
    mounted = Rotation.from_rotvec([found.model.value(f"point.board.r{axis}") for axis in "xyz"]).inv()
    assert np.rad2deg((mounted * Rotation.from_matrix(cell.arm.mounted)).magnitude()) < 0.6


def test_images_give_what_their_corners_do(folder: Path) -> None:
    cell = Cell(3)
    model = RobotModel.from_yaml(folder / "robot.yaml")
    printed = cv2.aruco.CharucoBoard(
        (9, 7), SQUARE, 0.022, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    )
    texture = cv2.cvtColor(printed.generateImage((1800, 1400)), cv2.COLOR_GRAY2BGR)[:, :, 0]
    rows = ["pose,q1,q2,q3,q4,q5,q6,image"]
    rays = cv2.undistortPoints(
        np.stack(np.meshgrid(np.arange(1280.0), np.arange(960.0)), -1).reshape(-1, 1, 2), CAMERA, DISTORTION
    )[:, 0]
    for k, q in enumerate(cell.poses(12)):
        view = cell.view(q)
        assert view is not None
        turn = Rotation.from_rotvec(view[0]).as_matrix()
        plane = (
            np.linalg.inv(np.column_stack([turn[:, :2], view[1]]))
            @ np.column_stack([rays, np.ones(len(rays))]).T
        )
        on_board = ((plane[:2] / plane[2]).T + MIDDLE[:2]) / SQUARE * 200 - 0.5
        image = cv2.remap(
            texture,
            *np.ascontiguousarray(on_board.reshape(960, 1280, 2).transpose(2, 0, 1), dtype=np.float32),
            cv2.INTER_AREA,
            borderValue=(255,),
        )
        cv2.imwrite(str(folder / f"{k}.png"), image)
        rows.append(",".join([*map(repr, [k + 1, *q.tolist()]), f"{k}.png"]))
    (folder / "images.csv").write_text("\n".join(rows) + "\n")
    poses = read_poses(folder / "images.csv", model)
    for pose, q in zip(poses.position, poses.q, strict=True):
        at, _ = cell.camera(q)
        np.testing.assert_allclose(pose, cell.axes.T @ (at - cell.at), atol=4e-3)


def test_bad_boards_and_images_are_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell, robot = Cell(4), str(folder / "robot.yaml")
    cell.corners(folder / "mirrored.csv", 12, mirrored=True)
    assert main(["calibrate", robot, str(folder / "mirrored.csv")]) == 2
    assert_refusal(capsys.readouterr().err, "E-POSES-051", "mirrored")
    cv2.imwrite(str(folder / "empty.png"), np.full((960, 1280), 200, np.uint8))
    (folder / "empty.csv").write_text("pose,q1,q2,q3,q4,q5,q6,image\n1,0,0,0,0,0,0,empty.png\n")
    assert main(["calibrate", robot, str(folder / "empty.csv")]) == 2
    assert_refusal(capsys.readouterr().err, "E-POSES-055", "empty.png")
    (folder / "none.csv").write_text("pose,q1,q2,q3,q4,q5,q6,image\n1,0,0,0,0,0,0,none.png\n")
    assert main(["calibrate", robot, str(folder / "none.csv")]) == 2
    assert_refusal(capsys.readouterr().err, "E-POSES-053", "none.png")


def test_views_that_are_left_out_are_in_no_group(folder: Path) -> None:
    header, *rows = Cell(6).corners(folder / "views.csv", 8).read_text().splitlines()
    seen = [row for k, row in enumerate(rows) if not row.startswith("3,") or rows[k - 3].startswith("2,")]
    grouped = [f"{row},day{int(row.split(',')[0]) % 2}" for row in seen]
    (folder / "views.csv").write_text("\n".join([f"{header},day", *grouped]) + "\n")
    model = RobotModel.from_yaml(folder / "robot.yaml")
    poses, labels = read_grouped_poses([folder / "views.csv"], model, "day")
    assert poses.pose.tolist() == [1, 2, 4, 5, 6, 7, 8]
    assert labels.tolist() == [f"day{number % 2}" for number in poses.pose.tolist()]


@pytest.mark.parametrize("larger", [0.003, -0.04])
def test_a_board_of_another_size_is_told(folder: Path, larger: float) -> None:
    """Nominal lengths say by how much; of a board that is known to 1 ‰ only the robot takes a part only."""
    cell = Cell(5)
    text = ROBOT.format(square=SQUARE / (1 + larger))
    (folder / "robot.yaml").write_text(text.replace("1.0e-4", "1.0e-3") if larger < 0.01 else text)
    model = RobotModel.from_yaml(folder / "robot.yaml")
    found = calibrate(model, read_poses(cell.corners(folder / "views.csv", 40), model), terms=["kinematic"])
    size = found.document()["size"]
    (board,) = size["standards"]
    assert abs(board["seen"] - larger) < 2 * board["seen_std"] + 0.1 * abs(larger)
    assert board["seen_std"] < 1.5e-3
    # 3 ‰ are two standard deviations of board and robot together
    if larger < -0.01:
        assert size["contradicted"] and {c.code: c.status for c in found.trust.checks}["size"] == "care"
    said = re.search(r"the board is (.*) ± .* ‰ (.*) than declared", found.summary().replace("\n", " "))
    assert said is not None and said[2] == ("larger" if larger > 0 else "smaller")
    if larger == 0.003:
        q = START + np.random.default_rng(5).uniform(-1, 1, (200, 6)) * [0.4, 0.3, 0.3, 0.7, 0.7, 1.2]
        truth = np.array([cell.camera(row)[0] for row in q])
        at = point_kinematics(found.model, q, jacobians=False).position
        far = [np.linalg.norm(p[::2] - p[1::2], axis=1).sum() for p in (at, truth)]
        assert abs(far[0] / far[1] - 1) < 2e-3


def over_prediction(seed: int, folder: Path) -> float:
    """Mean square of what is left of fresh views over the predicted one."""
    model, cell = RobotModel.from_yaml(folder / "robot.yaml"), Cell(seed)
    found = calibrate(model, read_poses(cell.corners(folder / f"views_{seed}.csv", 60), model))
    fresh = verify(found.robot, read_poses(cell.corners(folder / f"fresh_{seed}.csv", 60), model))
    return float(np.sum(fresh.residuals**2) / np.sum(fresh.predicted.expected_rms**2))


@pytest.mark.slow
def test_the_predicted_error_of_fresh_views_is_true(folder: Path) -> None:
    ratio = np.mean(over_seeds(over_prediction, range(300, 320), folder))
    print(f"{ratio:.3f} of the predicted square")
    assert ratio == pytest.approx(1, abs=0.1)


def squares(seed: int, folder: Path, wired: bool) -> list[float]:
    """Sums of squared errors at fresh poses, of an arm calibrated from 30 points of a tracker and from 40 views too, and the predicted sum
    of the latter; `wired` adds 80 lengths of a wire.
    """
    own = folder / str(seed)
    own.mkdir()
    model, cell = RobotModel.from_yaml(folder / "robot.yaml"), Cell(seed)
    lines = cell.corners(own / "views.csv", 40).read_text().splitlines()
    rows = [f"{lines[0]},target", *(f"{line},camera" for line in lines[1:])]
    (own / "views.csv").write_text("\n".join(rows) + "\n")
    others = [read_poses(own / "views.csv", model)]
    if wired:
        lengths = ["q1,q2,q3,q4,q5,q6,length,target"]
        for q in cell.rng.uniform(-1.5, 1.5, (80, 6)):
            at = cell.arm.seen.T @ (cell.arm.measured(q)[0] - cell.arm.from_)
            length = float(np.linalg.norm(at - [1.5, 0.8, 0.1]) - 0.02 + 1e-4 * cell.rng.normal())
            lengths.append(",".join(map(repr, [*q.tolist(), length])) + ",smr")
        (own / "wire.csv").write_text("\n".join(lengths) + "\n")
        others.insert(0, read_poses(own / "wire.csv", model))
    tracked = read_poses(recorded(own / "points.csv", cell.arm, cell.rng, 30, turned=False), model)
    fresh = read_poses(recorded(own / "fresh.csv", cell.arm, cell.rng, 150, turned=False), model)
    fresh = replace(fresh, position=np.array([cell.arm.measured(q)[0] for q in fresh.q]))
    fits = [
        calibrate(model, poses, terms=["kinematic"]) for poses in (tracked, concatenate([tracked, *others]))
    ]
    errors = [prediction_errors(fit.model, fresh, noise_free=True) for fit in fits]
    return [*(float(np.sum(e.errors**2)) for e in errors), float(np.sum(errors[1].parameter_rms ** 2))]


@pytest.mark.slow
def test_a_camera_beside_a_tracker_makes_the_robot_more_accurate(folder: Path) -> None:
    both = "points: {smr: {frame: l6, xyz: [0.05, 0.03, 0.12]}, "
    (folder / "robot.yaml").write_text(ROBOT.format(square=SQUARE).replace("points: {", both))
    alone, mixed, expected = np.sum(over_seeds(squares, range(500, 508), folder, False), axis=0)
    print(f"{mixed / alone:.2f} of the square of the tracker alone, {mixed / expected:.2f} of the predicted")
    assert mixed < alone
    assert mixed == pytest.approx(expected, rel=0.3)


@pytest.mark.slow
def test_points_a_wire_and_a_camera_are_better_than_points(folder: Path) -> None:
    """Errors at fresh poses of 16 arms: all three together beside the tracker alone, and as large as predicted."""
    (folder / "robot.yaml").write_text(
        ROBOT.format(square=SQUARE).replace(
            "points: {", "points: {smr: {frame: l6, xyz: [0.05, 0.03, 0.12]}, "
        )
        + "  rope: {kind: wire, std: 1.0e-4, scale_std: 1.0e-4}\n"
    )
    alone, mixed, expected = np.sum(over_seeds(squares, range(520, 536), folder, True), axis=0)
    print(f"{mixed / alone:.2f} of the square of the tracker alone, {mixed / expected:.2f} of the predicted")
    assert mixed < alone
    assert mixed == pytest.approx(expected, rel=0.3)
