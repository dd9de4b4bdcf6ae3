"""Denavit-Hartenberg tables: published ones come out, and calibrated ones stand where Pinocchio puts the exported URDF."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from panda import ALPHA_QUARTERS, A, D, panda
from refusals import refused

from flexcal.estimation import Parameter, Parameters
from flexcal.export import render_dh
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import GEOMETRY, Posterior, RobotModel


@pytest.fixture
def robot(request: pytest.FixtureRequest, tmp_path: Path) -> RobotModel:
    return panda(tmp_path) if request.param == "panda" else request.getfixturevalue(request.param)


def turn(axis: str, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    rotation = {
        "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
        "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }[axis]
    return np.block([[np.array(rotation), np.zeros((3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])


def shift(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def table_of(text: str, column: str = "calibrated") -> dict[str, dict[str, float]]:
    rows: dict[str, dict[str, float]] = {}
    for row in csv.DictReader(line for line in text.splitlines() if not line.startswith("#")):
        rows.setdefault(row["joint"], {})[row["parameter"]] = float(row[column])
    return rows


def stand(
    rows: dict[str, dict[str, float]], convention: str, q: np.ndarray, slides: tuple[int, ...] = ()
) -> np.ndarray:
    """The tool by the formula in the table's header, written once more."""
    base, *joints, tool = rows.values()
    at = _frame(base)
    for k, row in enumerate(joints):
        theta, d = row["theta"] + (0 if k in slides else q[k]), row["d"] + (q[k] if k in slides else 0)
        about_z = turn("z", theta) @ shift(0, 0, d)
        about_x = turn("x", row["alpha"]) @ shift(row["a"], 0, 0) @ turn("y", row["beta"])
        at = at @ (about_z @ about_x if convention == "standard" else about_x @ about_z)
    return at @ _frame(tool)


def _frame(row: dict[str, float]) -> np.ndarray:
    turned = turn("z", row["yaw"]) @ turn("y", row["pitch"]) @ turn("x", row["roll"])
    return shift(row["x"], row["y"], row["z"]) @ turned


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("robot", ["tx90l", "ur5", "panda"], indirect=True)
def test_the_table_stands_where_pinocchio_does(
    robot: RobotModel, convention, erroneous, pinocchio_of, rng: np.random.Generator
) -> None:
    wrong = erroneous(robot)
    rows = table_of(render_dh(wrong, robot, convention).text)
    q = rng.uniform(-2.5, 2.5, (30, robot.n))
    ours = np.array([stand(rows, convention, own) for own in q])
    np.testing.assert_allclose(ours, pinocchio_of(wrong)(q), atol=1e-9)


def test_the_panda_has_its_published_table(tmp_path: Path) -> None:
    model = panda(tmp_path)
    rows = table_of(render_dh(model, model, "modified").text)
    joints = [rows[name] for name in model.joint_names]
    np.testing.assert_allclose([row["a"] for row in joints], A, atol=1e-12)
    np.testing.assert_allclose([row["d"] for row in joints], D, atol=1e-12)
    np.testing.assert_allclose(
        [row["alpha"] for row in joints], np.pi / 2 * np.array(ALPHA_QUARTERS), atol=1e-12
    )
    np.testing.assert_allclose([row["theta"] for row in joints], 0, atol=1e-12)
    for name in ("base", "tool"):
        np.testing.assert_allclose(list(rows[name].values()), 0, atol=1e-12)


def test_the_ur5_has_its_published_lengths(ur5: RobotModel) -> None:
    """Universal Robots: a = 0, -0.425, -0.39225, 0, 0, 0; d = 0.089159, 0, 0, 0.10915, 0.09465, 0.0823, here 31 mm on to the reflector."""
    rows = table_of(render_dh(ur5, ur5, "standard").text)
    joints = [rows[name] for name in ur5.joint_names]
    np.testing.assert_allclose([abs(row["a"]) for row in joints], [0, 0.425, 0.39225, 0, 0, 0], atol=1e-9)
    lengths = [0.089159, 0, 0, 0.10915, 0.09465, 0.0823 + 0.031]
    np.testing.assert_allclose([row["d"] for row in joints], lengths, atol=1e-9)
    alpha = np.array([row["alpha"] for row in joints])
    np.testing.assert_allclose(np.abs(alpha), np.pi / 2 * np.array([1, 0, 0, 1, 1, 0]), atol=1e-9)


def test_parallel_axes_need_beta(ur5: RobotModel, erroneous, pinocchio_of, rng: np.random.Generator) -> None:
    """With beta every parameter stays near its nominal value; without, it does too, and the tilt that has no place is left out."""
    wrong = erroneous(ur5)
    names, q = ur5.joint_names, rng.uniform(-2.5, 2.5, (10, 6))
    five, four = (render_dh(wrong, ur5, "standard", four_parameters=few) for few in (False, True))
    near, far = table_of(five.text), table_of(four.text)
    nominal = table_of(five.text, "nominal")
    change = [abs(near[name][key] - nominal[name][key]) for name in names for key in near[name]]
    assert max(change) < 0.01
    assert near[names[1]]["beta"] != 0 and near[names[2]]["beta"] != 0
    assert all(far[name]["beta"] == 0 for name in names)
    assert max(abs(far[name][key] - nominal[name][key]) for name in names for key in far[name]) < 0.01
    assert "nearly parallel" in " ".join(four.remarks) and "is left out" in " ".join(four.remarks)
    assert four.table["safe"] and five.table["safe"]
    true = pinocchio_of(wrong)(q)
    ours, exact = (np.array([stand(rows, "standard", own) for own in q]) for rows in (far, near))
    np.testing.assert_allclose(exact, true, atol=1e-9)
    off = np.linalg.norm((ours - true)[:, :3, 3], axis=1)
    assert 1e-5 < off.max() < 3e-3  # tilts of a milliradian over the arm's length


def test_standard_deviations_are_the_scatter(ur5: RobotModel, erroneous, rng: np.random.Generator) -> None:
    """Of 150 robots drawn from a posterior in which everything hangs together."""
    names = [f"{joint}.{key}" for joint in ur5.joint_names for key in GEOMETRY]
    wrong = erroneous(ur5)
    mixing = rng.normal(size=(len(names), len(names)))
    root = 1e-4 * mixing / np.linalg.norm(mixing, axis=1)[:, None]
    parameters = Parameters(Parameter(name, "1", wrong.value(name)) for name in names)
    model = replace(wrong, posterior=Posterior(parameters, root @ root.T))
    said = render_dh(model, ur5, "modified").table["joints"]
    drawn = []
    values = parameters.coordinates()[:, None] + root @ rng.normal(size=(len(names), 150))
    for column in values.T:
        one = wrong.with_values(dict(zip(names, column.tolist(), strict=True)))
        joints = render_dh(one, ur5, "modified").table["joints"]
        drawn.append([list(row["calibrated"].values()) for row in joints.values()])
    scatter = np.std(drawn, axis=0)
    std = np.array([list(row["std"].values()) for row in said.values()])
    np.testing.assert_allclose(std, scatter, rtol=0.25, atol=1e-12)
    assert (std > 1e-6).sum() >= 20


def test_slides_and_branches(tree: RobotModel, erroneous, rng: np.random.Generator, tmp_path: Path) -> None:
    """A slide adds q to d; joints of another branch are left out, and said."""
    (tmp_path / "tree.urdf").write_bytes(tree.urdf.read_bytes())
    robot = tmp_path / "robot.yaml"
    robot.write_text("robot: tree.urdf\npoints:\n  held: {frame: hand, xyz: [0.1, 0.2, -0.1]}\n")
    nominal = RobotModel.from_yaml(robot)
    wrong = erroneous(nominal)
    found = render_dh(wrong, nominal, "modified")
    assert any("do not move the point 'held': to_right, to_finger" in remark for remark in found.remarks)
    rows, q = table_of(found.text), rng.uniform(-1, 1, (20, 6))
    expected = point_kinematics(wrong, q, jacobians=False)
    for k, own in enumerate(q):
        at = stand(rows, "modified", own[:4], slides=(2,))
        np.testing.assert_allclose(at[:3, 3], expected.position[k], atol=1e-12)
        np.testing.assert_allclose(at[:3, :3], expected.orientation[k], atol=1e-12)


def test_a_robot_without_points_has_no_chain(tree: RobotModel) -> None:
    with refused("E-EXPORT-001"):
        render_dh(tree, tree, "standard")
