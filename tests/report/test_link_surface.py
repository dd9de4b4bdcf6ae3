"""The drawn links are where the kinematics has them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexcal.model.kinematics import LinkSurface, point_kinematics
from flexcal.model.kinematics.triangle_meshes import box, capsule, cylinder, decimated, ellipsoid
from flexcal.model.robot import RobotModel


def volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """Of a closed surface with consistent orientation, by the divergence theorem."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_primitives_have_the_volume_of_their_bodies() -> None:
    assert volume(*box(np.array([0.1, 0.2, 0.3]))) == pytest.approx(8 * 0.006)
    assert volume(*cylinder(0.1, 0.2)) == pytest.approx(np.pi * 0.01 * 0.4, rel=0.02)
    assert volume(*capsule(0.1, 0.2)) == pytest.approx(np.pi * (0.01 * 0.4 + 4e-3 / 3), rel=0.04)
    assert volume(*ellipsoid(np.array([0.1, 0.2, 0.3]))) == pytest.approx(4 / 3 * np.pi * 0.006, rel=0.06)


def test_decimated_mesh_keeps_its_extent() -> None:
    angle = np.linspace(-np.pi / 2, np.pi / 2, 60)
    turn = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    sphere = np.stack(
        [np.outer(np.cos(angle), np.cos(turn)), np.outer(np.cos(angle), np.sin(turn)), np.outer(np.sin(angle), np.ones(120))],
        axis=-1,
    ).reshape(-1, 3)  # fmt: skip
    ring = np.arange(59)[:, None] * 120 + np.arange(120)
    faces = np.stack([ring, ring + 120, (ring + 1) % 7200], axis=-1).reshape(-1, 3)
    vertices, triangles = decimated(sphere, faces, 800)
    assert 200 < len(triangles) <= 800
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1.0, atol=0.06)


@pytest.mark.parametrize("example", ["tx90l", "ur5_tracker"])
def test_links_follow_the_joints(examples: Path, example: str, rng: np.random.Generator) -> None:
    """Primitives of a URDF, and capsules where it has none: the last one reaches the measured point, the first the base."""
    model = RobotModel.from_yaml(examples / example / "robot.yaml", estimates=False)
    surface = LinkSurface.of(model)
    assert set(surface.owner) == {-1, *range(model.n)}
    q = rng.uniform(-1, 1, (3, model.n))
    placed = surface.at(model, q)
    tip = point_kinematics(model, q, jacobians=False).position
    reach = 0.16 if example == "tx90l" else 0.08
    assert np.linalg.norm(placed - tip[:, None], axis=2).min(axis=1).max() < reach
    moved = np.ptp(placed, axis=0).max(axis=1)
    assert moved[surface.owner < 0].max() < 1e-12 < moved[surface.owner >= 1].min()


def test_meshes_are_drawn_and_missing_ones_are_not(tmp_path: Path) -> None:
    """A tetrahedron on a turning link; without its file the collision shape, a box, takes its place."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*corners[k]) for k in face)
        + "endloop\nendfacet\n"
        for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    )
    (tmp_path / "arm.stl").write_text(f"solid arm\n{facets}endsolid arm\n")
    (tmp_path / "arm.urdf").write_text(
        '<robot name="arm"><link name="base"/><link name="tip">'
        '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
        '<visual><geometry><mesh filename="arm.stl"/></geometry></visual>'
        '<collision><geometry><box size="2 2 2"/></geometry></collision></link>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/><origin xyz="0 0 2"/><axis xyz="0 0 1"/>'
        '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>'
    )
    (tmp_path / "robot.yaml").write_text("robot: arm.urdf\npoints:\n  smr: {frame: tip, xyz: [0, 0, 1]}\n")
    model = RobotModel.from_yaml(tmp_path / "robot.yaml", estimates=False)
    surface = LinkSurface.of(model)
    assert len(surface.triangles) == 4
    placed = surface.at(model, np.array([[np.pi / 2]]))[0]
    np.testing.assert_allclose(placed.min(axis=0), [-1, 0, 2], atol=1e-6)
    np.testing.assert_allclose(placed.max(axis=0), [0, 1, 3], atol=1e-6)
    (tmp_path / "arm.stl").unlink()
    assert len(LinkSurface.of(model).triangles) == 12
