"""Start of cameras: any order, place and mounting give the same, and motions that tell too little are refused with what is missing."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from test_camera import ROBOT, SQUARE, START, Cell
from test_full_poses import urdf

from flexcal import RobotModel, calibrate, read_poses

OFF = [0.05, 0.03, 0.12]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    urdf(tmp_path / "six.urdf")
    (tmp_path / "robot.yaml").write_text(ROBOT.format(square=SQUARE))
    return tmp_path


class Held(Cell):
    """A cell whose hand keeps to some of its orientations."""

    def postures(self, turns: list[np.ndarray], tilt: float = 0.35) -> list[np.ndarray]:
        """Joint positions at which the hand is turned by `turns` in the base frame, at places around where it sees the board."""
        at, axes = self.camera(START)
        if tilt:
            self.axes = axes @ Rotation.from_euler("yx", [tilt, -tilt / 2]).as_matrix()
        else:
            self.axes = axes
        self.at, found = at + 0.5 * axes[:, 2], []
        for turn in turns:
            there = Rotation.from_rotvec(turn).as_matrix()
            want = self.at - there @ (self.at - at) + self.rng.uniform(-0.04, 0.04, 3)

            def off(q: np.ndarray, want=want, there=there) -> np.ndarray:
                reached, turned = self.camera(q)
                return np.concatenate(
                    [reached - want, Rotation.from_matrix(turned @ (there @ axes).T).as_rotvec()]
                )

            found.append(least_squares(off, START, xtol=1e-14, ftol=1e-14).x)
        return found

    def poses(self, count: int) -> list[np.ndarray]:
        return self.held[:count]

    held: list[np.ndarray]

    def view(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        at, axes = self.camera(q)
        return Rotation.from_matrix(axes.T @ self.axes).as_rotvec(), axes.T @ (self.at - at)


def turns(kind: str, cell: Cell, count: int = 14) -> tuple[list[np.ndarray], float]:
    """Rotations of the hand, and the tilt of the board."""
    if kind == "none":
        return [np.zeros(3)] * count, 0.35
    axis = {"one": np.array([0.0, 0.6, 0.8]), "optical": cell.camera(START)[1][:, 2]}[kind]
    return [angle * axis for angle in np.linspace(-0.3, 0.3, count)], 0.0 if kind == "optical" else 0.35


@pytest.mark.parametrize(
    ("kind", "code", "named"),
    [
        ("none", "E-CAL-025", ("14", "eye", "two different axes")),
        ("one", "E-CAL-026", ("14", "eye", "across")),
        ("optical", "E-CAL-026", ("14", "eye", "across")),
    ],
)
def test_motions_that_tell_too_little_are_refused(
    folder: Path, kind: str, code: str, named: tuple[str, ...]
) -> None:
    cell = Held(11)
    cell.held = cell.postures(*turns(kind, cell))
    model = RobotModel.from_yaml(folder / "robot.yaml")
    poses = read_poses(cell.corners(folder / "views.csv", 14), model)
    with refused(code, *named) as caught:
        calibrate(model, poses, terms=["kinematic"])
    if kind == "one":
        told = [float(number) for number in re.findall(r"\[(.*), (.*), (.*)\]", str(caught.value))[0]]
        np.testing.assert_allclose(told, [0.0, 0.6, 0.8], atol=0.04)


def test_a_board_that_is_hardly_tilted_is_told(folder: Path) -> None:
    """Tilts of 3° about two axes: enough for the hand, not for the focal length."""
    cell = Held(12)
    small = [0.05 * np.array([np.cos(a), np.sin(a), np.sin(2 * a)]) for a in np.linspace(0, 6, 14)]
    cell.held = cell.postures(small, tilt=0.0)
    model = RobotModel.from_yaml(folder / "robot.yaml")
    with refused("E-CAL-027", "eye", "20", "45"):
        calibrate(model, read_poses(cell.corners(folder / "views.csv", 14), model), terms=["kinematic"])


def test_any_order_gives_the_same(folder: Path) -> None:
    """Views and corners in another order in the file, and a camera that is declared elsewhere on the hand."""
    cell = Cell(13)
    lines = cell.corners(folder / "views.csv", 40).read_text().splitlines()
    rng = np.random.default_rng(0)
    views = {
        number: [line for line in lines[1:] if line.split(",")[0] == number]
        for number in {line.split(",")[0] for line in lines[1:]}
    }
    mixed = [line for number in rng.permutation(sorted(views)) for line in rng.permutation(views[number])]
    (folder / "mixed.csv").write_text("\n".join([lines[0], *mixed]) + "\n")
    model = RobotModel.from_yaml(folder / "robot.yaml")
    first, again = (
        calibrate(model, read_poses(folder / name, model), terms=["kinematic"]).selected
        for name in ("views.csv", "mixed.csv")
    )
    names = [name for name in first.estimate.parameters.names if first.estimate.std(name) is not None]
    difference = np.array([first.estimate.values[name] - again.estimate.values[name] for name in names])
    size = np.array([max(1.0, abs(first.estimate.values[name])) for name in names])
    assert np.abs(difference / size).max() < 1e-9
    (folder / "robot.yaml").write_text(
        ROBOT.format(square=SQUARE).replace("[0.05, 0.03, 0.12]", "[0.3, -0.2, -0.1]")
    )
    elsewhere = RobotModel.from_yaml(folder / "robot.yaml")
    other = calibrate(elsewhere, read_poses(folder / "views.csv", elsewhere), terms=["kinematic"]).selected
    np.testing.assert_allclose(other.residuals, first.residuals, atol=2e-6)
