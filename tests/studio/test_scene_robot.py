"""The robot in the scene: where its links stand, which meshes it has, and which it must not read."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from flexcal.model.robot import RobotModel

viser = pytest.importorskip("viser", reason="the studio's extra is not installed")
from flexcal.studio.scene import LinkShapes, MeshFolder, MeshNotDrawn, RobotView  # noqa: E402

EXAMPLES = Path(__file__).parents[2] / "examples"
CORNERS = np.array([[0.0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


@pytest.fixture(scope="module")
def scene() -> Iterator[viser.SceneApi]:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server.scene
    server.stop()


def write_stl(path: Path) -> None:
    """A tetrahedron as binary STL."""
    path.parent.mkdir(parents=True, exist_ok=True)
    triangles = b"".join(struct.pack("<12fH", 0, 0, 0, *CORNERS[face].ravel(), 0) for face in FACES)
    path.write_bytes(b"\0" * 80 + struct.pack("<I", len(FACES)) + triangles)


def arm(folder: Path, *shapes: str) -> RobotModel:
    """Robot of joints about z, y, … with one link more, whose contents are `shapes`."""
    inertial = (
        '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    )
    links = [f'<link name="link_{k}">{inertial}{shape}</link>' for k, shape in enumerate(shapes)]
    joints = [
        f'<joint name="j{k}" type="revolute"><parent link="link_{k - 1}"/><child link="link_{k}"/>'
        f'<origin xyz="0.4 0.1 0.3" rpy="0.3 -0.5 0.9"/><axis xyz="{"0 0 1" if k % 2 else "0 1 0"}"/>'
        '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        for k in range(1, len(shapes))
    ]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.urdf").write_text(f'<robot name="arm">{"".join(links + joints)}</robot>')
    (folder / "robot.yaml").write_text(
        f"robot: arm.urdf\npoints: {{ball: {{frame: link_{len(shapes) - 1}, xyz: [0.1, 0, 0]}}}}\n"
    )
    return RobotModel.from_yaml(folder / "robot.yaml")


def mesh(name: str, attributes: str = "") -> str:
    return f'<visual><origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/><geometry><mesh filename="{name}" {attributes}/></geometry></visual>'


def drawn_corners(view: RobotView, joint: int) -> np.ndarray:
    """Corners (V, 3) of a link as the window has them: its mesh, by the frame above it."""
    frame, link = view._frames[joint], view._meshes[joint]
    return np.asarray(link.vertices) @ pin.Quaternion(*frame.wxyz).toRotationMatrix().T + frame.position


def sorted_rows(corners: np.ndarray) -> np.ndarray:
    return np.unique(np.round(corners, 5), axis=0)


@pytest.mark.parametrize("name", ["tx90l", "ur5_tracker", "panda_sockets"])
def test_links_stand_where_pinocchio_has_them(
    scene: viser.SceneApi, name: str, rng: np.random.Generator
) -> None:
    model = RobotModel.from_yaml(EXAMPLES / name / "robot.yaml", estimates=False)
    view = RobotView(scene, model, name=f"/{name}")
    whole = pin.buildModelFromUrdf(str(model.urdf))
    reduced = pin.buildReducedModel(
        whole, [whole.getJointId(n) for n in model.config.locked], pin.neutral(whole)
    )
    data, q = reduced.createData(), rng.uniform(-1, 1, model.n)
    view.pose(q)
    pin.forwardKinematics(reduced, data, q)
    for joint, frame in view._frames.items():
        expected = data.oMi[joint + 1]
        np.testing.assert_allclose(frame.position, expected.translation, atol=1e-9)
        turn = pin.Quaternion(*frame.wxyz).toRotationMatrix()
        np.testing.assert_allclose(turn, expected.rotation, atol=1e-9)
    assert len(view._frames) > model.n - 2


def test_mesh_stands_where_pinocchio_has_its_shape(scene: viser.SceneApi, tmp_path: Path) -> None:
    write_stl(tmp_path / "parts" / "body.stl")
    write_stl(tmp_path / "body_of_package.STL")
    model = arm(
        tmp_path, mesh("parts/body.stl"), mesh("parts/body.stl", 'scale="0.5 2 1"'),
        mesh(f"package://{tmp_path.name}/body_of_package.STL"),
    )  # fmt: skip
    view = RobotView(scene, model, name="/meshes")
    assert view.missing == ()
    q = np.array([0.7, -1.1])
    view.pose(q)
    whole = pin.buildModelFromUrdf(str(model.urdf))
    theirs = pin.buildGeomFromUrdf(
        whole, str(model.urdf), pin.GeometryType.VISUAL, package_dirs=[str(tmp_path), str(tmp_path.parent)]
    )
    data, placed = whole.createData(), theirs.createData()
    pin.updateGeometryPlacements(whole, data, theirs, placed, q)
    for k, shape in enumerate(theirs.geometryObjects):
        scaled = CORNERS * np.array(shape.meshScale)
        at = placed.oMg[k]
        expected = scaled @ at.rotation.T + at.translation
        np.testing.assert_allclose(
            sorted_rows(drawn_corners(view, shape.parentJoint - 1)), sorted_rows(expected), atol=2e-5
        )


def test_two_arms_move_at_once(scene: viser.SceneApi, tmp_path: Path, rng: np.random.Generator) -> None:
    model = arm(tmp_path, *[""] * 4)
    text = model.urdf.read_text().replace('<parent link="link_2"/>', '<parent link="link_0"/>')
    model.urdf.write_text(text)
    tree = RobotModel.from_yaml(tmp_path / "robot.yaml")
    assert [joint.parent for joint in tree.joints] == [-1, 0, -1]
    view = RobotView(scene, tree, name="/tree")
    q = rng.uniform(-1, 1, 3)
    view.pose(q)
    whole = pin.buildModelFromUrdf(str(tree.urdf))
    data = whole.createData()
    pin.forwardKinematics(whole, data, q[[tree.joint_index(n) for n in list(whole.names)[1:]]])
    for k, name in enumerate(tree.joint_names):
        if k in view._frames:
            np.testing.assert_allclose(
                view._frames[k].position, data.oMi[whole.getJointId(name)].translation, atol=1e-9
            )
    assert {-1, 0} <= view._frames.keys()


def test_missing_and_foreign_meshes_are_named_and_replaced(tmp_path: Path) -> None:
    project = tmp_path / "project"
    write_stl(tmp_path / "secret.stl")
    write_stl(project / "good.stl")
    (project / "broken.stl").write_bytes(b"solid nothing\nfacet")
    (project / "link.stl").symlink_to(tmp_path / "secret.stl")
    names = (
        "good.stl", "gone.stl", "../secret.stl", str(tmp_path / "secret.stl"), f"file://{tmp_path}/secret.stl",
        "package://../secret.stl", f"package://{tmp_path.name}/secret.stl", "link.stl", "broken.stl", "a.step", "%2e%2e/secret.stl",
    )  # fmt: skip
    model = arm(project, *(mesh(name) for name in names))
    shapes = LinkShapes.of(model, project)
    assert [item.name for item in shapes.missing] == list(names[1:])
    reasons = {item.name: item.reason for item in shapes.missing}
    assert "outside" not in reasons["gone.stl"]
    assert all(
        "outside" in reason for name, reason in reasons.items() if "secret" in name or name == "link.stl"
    )
    assert "cannot be read" in reasons["broken.stl"] or "no triangles" in reasons["broken.stl"]
    assert set(shapes.meshes) == set(range(-1, len(names) - 1))  # capsules stand in
    vertices, faces = shapes.meshes[-1]
    assert faces.shape == (4, 3) and np.isclose(np.ptp(vertices @ np.eye(3), axis=0).max(), 0.3, atol=0.1)


def test_names_that_are_no_paths_are_not_found(tmp_path: Path) -> None:
    folder = MeshFolder(tmp_path, tmp_path / "arm.urdf")
    for name in ("a\0b.stl", "x" * 5000 + ".stl", "", ".stl", "package://", "package://a"):
        assert isinstance(folder.read(name), MeshNotDrawn)


def test_collision_shapes_stand_in_for_missing_meshes(tmp_path: Path) -> None:
    box = '<collision><geometry><box size="0.2 0.4 0.6"/></geometry></collision>'
    model = arm(tmp_path, mesh("gone.stl") + box, "", box)
    shapes = LinkShapes.of(model, tmp_path)
    for joint in (-1, 1):
        np.testing.assert_allclose(np.ptp(shapes.meshes[joint][0], axis=0), [0.2, 0.4, 0.6])
    assert set(shapes.meshes) == {-1, 1}  # a link without any shape has none


def test_marked_links_change_their_colour_and_back(scene: viser.SceneApi, tmp_path: Path) -> None:
    view = RobotView(scene, arm(tmp_path, "", "", ""), name="/marked", colour=(1, 2, 3))
    view.mark([0, 17], (9, 9, 9))
    assert tuple(view._meshes[0].color) == (9, 9, 9) and tuple(view._meshes[-1].color) == (1, 2, 3)
    view.mark([-1], (9, 9, 9))
    assert tuple(view._meshes[0].color) == (1, 2, 3) and tuple(view._meshes[-1].color) == (9, 9, 9)


def test_wrong_number_of_joints_is_refused(scene: viser.SceneApi, tmp_path: Path) -> None:
    view = RobotView(scene, arm(tmp_path, "", "", ""), name="/refusing")
    with refused("E-MODEL-001", "3", "2"):
        view.pose(np.zeros(3))
