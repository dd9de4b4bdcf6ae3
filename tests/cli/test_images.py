"""Images rendered from a true robot: every kind of board, bad images among them, and a folder of them beside a tracker and a wire."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from refusals import assert_refusal, refused
from scipy.spatial.transform import Rotation
from test_camera import DISTORTION, SQUARE, Cell
from test_full_poses import urdf

from flexcal import RobotModel, read_poses
from flexcal.cli.main import main
from flexcal.jobs.inputs import image_provenance

SIZE = (640, 480)
LENS = np.array([[550, 0, 315], [0, 545, 245], [0, 0, 1.0]])
RAYS = cv2.undistortPoints(
    np.stack(np.meshgrid(np.arange(640.0), np.arange(480.0)), -1).reshape(-1, 1, 2), LENS, DISTORTION
)[:, 0]
DOTS = 100
"""Dots of a printed square's edge."""
BOARDS = {
    "charuco": "kind: charuco, columns: 9, rows: 7, square: 0.03, marker: 0.022",
    "chessboard": "kind: chessboard, columns: 9, rows: 7, square: 0.03",
    "tags": "kind: tags, columns: 6, rows: 4, square: 0.045, marker: 0.035, dictionary: DICT_APRILTAG_36h11",
}


def printed(kind: str) -> tuple[np.ndarray, float]:
    """Texture of a board about its middle, and dots a metre."""
    if kind == "charuco":
        words = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        board = cv2.aruco.CharucoBoard((9, 7), 0.03, 0.022, words)
        return board.generateImage((9 * DOTS, 7 * DOTS)), DOTS / SQUARE
    if kind == "chessboard":
        squares = np.indices((7, 9)).sum(axis=0) % 2
        return np.kron(255 * squares, np.ones((DOTS, DOTS))).astype(np.uint8), DOTS / SQUARE
    words = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    dots = 140
    page = np.full((4 * dots, 6 * dots), 255, np.uint8)
    side = round(dots * 0.035 / 0.045)
    edge = (dots - side) // 2
    for k in range(24):
        row, column = divmod(k, 6)
        at = (
            slice(row * dots + edge, row * dots + edge + side),
            slice(column * dots + edge, column * dots + edge + side),
        )
        page[at] = cv2.aruco.generateImageMarker(words, k, side)
    return page, dots / 0.045


def rendered(cell: Cell, q: np.ndarray, page: np.ndarray, dots: float) -> np.ndarray:
    """Image of the board, white around it, that the camera takes at `q`."""
    view = cell.view(q)
    assert view is not None
    turn = Rotation.from_rotvec(view[0]).as_matrix()
    plane = (
        np.linalg.inv(np.column_stack([turn[:, :2], view[1]])) @ np.column_stack([RAYS, np.ones(len(RAYS))]).T
    )
    on_page = (plane[:2] / plane[2]).T * dots + np.array(page.shape[::-1]) / 2 - 0.5
    maps = np.ascontiguousarray(on_page.reshape(480, 640, 2).transpose(2, 0, 1), dtype=np.float32)
    # the page has four dots a pixel and more: smoothed first, as a lens does
    return cv2.remap(cv2.GaussianBlur(page, (0, 0), 1.6), *maps, cv2.INTER_LINEAR, borderValue=(255,))


def whole(cell: Cell, q: np.ndarray) -> bool:
    """Whether all of the board is in the image."""
    edge = np.array([[x, y, 0] for x in (-0.14, 0.14) for y in (-0.11, 0.11)])
    pixels = cv2.projectPoints(edge, *cell.view(q), LENS, DISTORTION)[0][:, 0]
    return bool(((pixels > 2) & (pixels < np.array(SIZE) - 2)).all())


def folder_of(path: Path, kind: str, cell: Cell, count: int) -> list[np.ndarray]:
    """A robot, and a folder `images` with a table and `count` images; the joint positions of these."""
    urdf(path / "six.urdf")
    (path / "robot.yaml").write_text(
        "robot: six.urdf\npoints: {eye: {frame: l6, xyz: [0.05, 0.03, 0.12]}, smr: {frame: l6, xyz: [0.0, 0.05, 0.1]}}\n"
        "measurements:\n"
        f"  eye: {{kind: camera, size: [640, 480], board: {{{BOARDS[kind]}}}}}\n"
        "  rope: {kind: wire, std: 1.0e-4, scale_std: 1.0e-5}\n"
    )
    (path / "images").mkdir(exist_ok=True)
    page, dots = printed(kind)
    poses = [q for q in cell.poses(7 * count) if whole(cell, q)][:count]
    rows = ["pose,q1,q2,q3,q4,q5,q6,image"]
    for k, q in enumerate(poses):
        cv2.imwrite(str(path / "images" / f"{k + 1}.png"), rendered(cell, q, page, dots))
        rows.append(",".join([*map(repr, [k + 1, *q.tolist()]), f"{k + 1}.png"]))
    (path / "images" / "joints.csv").write_text("\n".join(rows) + "\n")
    return poses


@pytest.mark.parametrize("kind", ["charuco", "chessboard", "tags"])
def test_boards_are_found(tmp_path: Path, kind: str) -> None:
    """Places of the camera before the board, from corners to a fraction of a pixel."""
    cell = Cell(21)
    folder_of(tmp_path, kind, cell, 14)
    poses = read_poses(tmp_path / "images", RobotModel.from_yaml(tmp_path / "robot.yaml"))
    assert len(poses) >= 13
    away = []
    for pose, q in zip(poses.position, poses.q, strict=True):
        truth = cell.axes.T @ (cell.camera(q)[0] - cell.at)
        upside_down = kind == "chessboard"
        away.append(
            min(np.linalg.norm(pose - truth * sign) for sign in ([1, 1, 1], [-1, -1, 1])[: 1 + upside_down])
        )
    # a focal length that is off by a standard deviation moves all places alike
    assert np.sqrt(np.mean(np.square(away))) < 7e-3


def test_bad_images_among_good_ones_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A blurred image, one of another board, and an empty one are left out; one of another pose is an outlier."""
    cell = Cell(22)
    poses = folder_of(tmp_path, "charuco", cell, 20)
    images = tmp_path / "images"
    page, dots = printed("charuco")
    blurred = cv2.GaussianBlur(rendered(cell, poses[3], page, dots), (0, 0), 2.2) + np.random.default_rng(
        0
    ).integers(-12, 13, (480, 640))
    cv2.imwrite(str(images / "4.png"), np.clip(blurred, 0, 255).astype(np.uint8))
    cv2.imwrite(str(images / "8.png"), rendered(cell, poses[7], *printed("chessboard")))
    cv2.imwrite(str(images / "12.png"), np.full((480, 640), 180, np.uint8))
    cv2.imwrite(str(images / "16.png"), rendered(cell, poses[0], page, dots))
    status = main(["calibrate", str(tmp_path / "robot.yaml"), str(images), "--terms", "kinematic"])
    said = capsys.readouterr()
    assert status == 0
    assert re.search(r"2 views show fewer than 6 corners of the board: 8.png, 12.png", said.out)
    assert re.search(r"eye: blurred and left out, their edges .*: 4.png", said.out)
    assert "1 outlier: pose 16" in said.out
    (stored,) = re.findall(
        r"input.20 images of joints.csv: (\w{64})", (tmp_path / "estimates.yaml").read_text()
    )
    assert stored in image_provenance([images / "joints.csv"]).values()
    cv2.imwrite(str(images / "12.png"), np.full((480, 640), 181, np.uint8))
    assert stored not in image_provenance([images / "joints.csv"]).values()


@pytest.mark.parametrize("kind", ["charuco", "tags"])
def test_images_that_are_blurred_in_any_way_are_named(tmp_path: Path, kind: str) -> None:
    """Out of focus, moved sideways, moved along a diagonal; and an image of the cell without the board is not blurred."""
    cell = Cell(25)
    poses = folder_of(tmp_path, kind, cell, 14)
    page, dots = printed(kind)
    moved = np.zeros((15, 15), np.float32)
    moved[7] = 1 / 15
    kernels = {2: moved, 5: np.eye(13, dtype=np.float32) / 13}
    for k in (2, 5, 9):
        sharp = rendered(cell, poses[k - 1], page, dots)
        soft = cv2.GaussianBlur(sharp, (0, 0), 4) if k == 9 else cv2.filter2D(sharp, -1, kernels[k])
        cv2.imwrite(str(tmp_path / "images" / f"{k}.png"), soft)
    cell_wall = np.full((480, 640), 90, np.uint8)
    for k in range(1, 9):
        cv2.rectangle(cell_wall, (70 * k, 40 * k), (70 * k + 50, 40 * k + 90), 30 * k % 256, -1)
        cv2.circle(cell_wall, (600 - 60 * k, 30 * k), 20, 255 - 30 * k, -1)
    cv2.imwrite(str(tmp_path / "images" / "12.png"), cell_wall)
    poses = read_poses(tmp_path / "images", RobotModel.from_yaml(tmp_path / "robot.yaml"))
    said = "; ".join(poses.notes)
    (blurred,) = re.findall(r"blurred and left out, [^:]*: ([^;]*)", said)
    assert {name.split(" ")[0] for name in blurred.split(", ")} == {"2.png", "5.png", "9.png"}
    assert "1 views show fewer than 6 corners of the board: 12.png" in said


def test_images_that_are_all_blurred_are_refused_as_such(tmp_path: Path) -> None:
    cell = Cell(26)
    folder_of(tmp_path, "charuco", cell, 5)
    for file in (tmp_path / "images").glob("*.png"):
        cv2.imwrite(str(file), cv2.GaussianBlur(cv2.imread(str(file)), (0, 0), 6))
    with refused("E-POSES-055", "5 of 5", "edges", "sharper"):
        read_poses(tmp_path / "images", RobotModel.from_yaml(tmp_path / "robot.yaml"))


def test_chessboards_are_turned_the_same_way_up(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A board of odd columns and rows looks the same upside down; mirrored images of it turn otherwise than the robot."""
    cell = Cell(23)
    folder_of(tmp_path, "chessboard", cell, 16)
    robot, images = str(tmp_path / "robot.yaml"), tmp_path / "images"
    status = main(["calibrate", robot, str(images), "--terms", "kinematic"])
    said = capsys.readouterr()
    assert status == 0
    assert "upside down" in said.out and "outlier" not in said.out
    for file in images.glob("*.png"):
        cv2.imwrite(str(file), cv2.flip(cv2.imread(str(file)), 1))
    status = main(["calibrate", robot, str(images), "--terms", "kinematic"])
    said = capsys.readouterr()
    assert_refusal(said.err, "E-CAL-029", "eye", "mirrored")


def three_instruments(tmp_path: Path, images: int) -> tuple[str, list[str]]:
    """robot.yaml, and a tracker's points, the lengths of a wire and a folder of images."""
    cell = Cell(24)
    folder_of(tmp_path, "charuco", cell, images)
    at, rng = np.array([0.0, 0.05, 0.1]), np.random.default_rng(3)
    points, lengths = (
        ["pose,q1,q2,q3,q4,q5,q6,x,y,z,sigma,target"],
        ["pose,q1,q2,q3,q4,q5,q6,wire,length,target"],
    )
    for k in range(50):
        q = rng.uniform(-1.5, 1.5, 6)
        eye, axes = cell.camera(q)
        smr = eye + axes @ cell.arm.mounted.T @ (at - cell.arm.target)
        if k < 20:
            seen = cell.arm.seen @ smr + cell.arm.from_ + 3e-5 * rng.normal(size=3)
            points.append(",".join(map(repr, [k + 1, *q.tolist(), *seen.tolist(), 3e-5])) + ",smr")
        else:
            length = float(np.linalg.norm(smr - [1.5, 0.8, 0.1]) - 0.02 + 1e-4 * rng.normal())
            lengths.append(",".join(map(repr, [k + 1, *q.tolist()])) + f",rope,{length!r},smr")
    (tmp_path / "points.csv").write_text("\n".join(points) + "\n")
    (tmp_path / "wire.csv").write_text("\n".join(lengths) + "\n")
    names = ("points.csv", "wire.csv", "images")
    return str(tmp_path / "robot.yaml"), [str(tmp_path / name) for name in names]


def test_points_a_wire_and_images_are_read_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, files = three_instruments(tmp_path, 6)
    poses = read_poses(files, RobotModel.from_yaml(robot))
    assert (poses.located & ~poses.seen).sum() == 20 and poses.far.sum() == 30 and poses.seen.sum() == 6
    assert poses.targets == ("smr", "eye")
    points = tmp_path / "points.csv"
    points.write_text(points.read_text().replace(",smr", ",eye"))
    assert main(["calibrate", robot, *files]) == 2
    assert_refusal(capsys.readouterr().err, "E-POSES-068", "eye", "camera")
    (tmp_path / "images" / "more.csv").write_text("pose\n")
    assert main(["calibrate", robot, *files]) == 2
    assert_refusal(capsys.readouterr().err, "E-POSES-067", "images", "2", "joints.csv")


@pytest.mark.slow
def test_points_a_wire_and_images_are_one_fit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, files = three_instruments(tmp_path, 16)
    status = main(["calibrate", robot, *files, "--terms", "kinematic", "--out", str(tmp_path / "out")])
    assert status == 0 and "poses were measured by a camera" in capsys.readouterr().out
