import pickle

import numpy as np
from refusals import refused

from flexcal.design.scene import CollisionChecker
from flexcal.model.robot import RobotModel
from flexcal.units import DEGREE

_LINK = '<link name="{name}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>{shape}</link>'
_BOX = '<collision><origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry></collision>'
_JOINT = (
    '<joint name="{name}" type="{kind}"><origin xyz="{xyz}"/><parent link="{parent}"/><child link="{child}"/>'
    '<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
)


def _planar(folder, last="", obstacles=""):
    """Three links of 1 m turning about z; the first has a bulge that always covers the third's root."""
    links = [
        _LINK.format(name="base", shape=""),
        _LINK.format(
            name="one",
            shape=_BOX.format(xyz="0.4 0 1", size=".8 .1 .1") + _BOX.format(xyz="1 0 1", size=".3 .3 .3"),
        ),
        _LINK.format(name="two", shape=""),
        _LINK.format(name="three", shape=last or _BOX.format(xyz="0.5 0 1", size="1 .1 .1")),
    ]
    joints = [
        _JOINT.format(name="a", kind="continuous", xyz="0 0 0", parent="base", child="one"),
        _JOINT.format(name="b", kind="revolute", xyz="1 0 0", parent="one", child="two"),
        _JOINT.format(name="c", kind="revolute", xyz="0 0 0", parent="two", child="three"),
    ]
    (folder / "planar.urdf").write_text(f'<robot name="planar">{"".join(links + joints)}</robot>')
    (folder / "robot.yaml").write_text(
        f"robot: planar.urdf\npoints: {{tip: {{frame: three, xyz: [1, 0, 1]}}}}\n{obstacles}"
    )
    return RobotModel.from_yaml(folder / "robot.yaml")


def test_known_poses(tx90l):
    checker = CollisionChecker(tx90l)
    folded = np.array([0, 130, 145, 0, 0, 0]) * DEGREE
    low = np.array([0, 120, 0, 0, 0, 0]) * DEGREE
    np.testing.assert_array_equal(checker.collides(np.array([np.zeros(6), folded, low])), [False, True, True])
    assert checker.colliding(np.zeros(6)) == ()
    assert any("base_link" in a and "link_4" in b for a, b in checker.colliding(folded))
    assert {b for _, b in checker.colliding(low)} == {"floor"}


def test_without_floor_only_the_robot_itself_counts(tx90l):
    low = np.array([[0, 120, 0, 0, 0, 0]]) * DEGREE
    assert not CollisionChecker(tx90l, floor=None).collides(low)[0]
    assert not CollisionChecker(tx90l, floor=-1.0).collides(low)[0]


def test_neighbours_are_left_out_and_nothing_overlaps_for_good(tx90l):
    checker = CollisionChecker(tx90l)
    assert checker.permanent == ()
    for first, second in checker.pairs:
        assert (
            second == "floor"
            or int(second.rsplit("_")[1]) - (0 if "base" in first else int(first.rsplit("_")[1])) > 1
        )


def test_a_wider_margin_only_adds_collisions(tx90l, rng):
    q = rng.uniform(-2, 2, (500, 6))
    narrow, wide = (
        CollisionChecker(tx90l, margin=0.0).collides(q),
        CollisionChecker(tx90l, margin=0.1).collides(q),
    )
    assert np.all(wide >= narrow)
    assert wide.sum() > narrow.sum()


def test_shapes_that_always_overlap_are_set_aside_and_named(tmp_path):
    checker = CollisionChecker(_planar(tmp_path), floor=None)
    assert checker.permanent == (("one_1", "three_0"),)
    folded, stretched = [0.5, 2.9, 0.2], [0.5, 0.3, 0.2]
    np.testing.assert_array_equal(checker.collides(np.array([folded, stretched])), [True, False])
    assert checker.colliding(np.array(folded)) == (("one_0", "three_0"),)


def test_obstacles_of_robot_yaml(tmp_path):
    (tmp_path / "wall.urdf").write_text(
        f'<robot name="wall">{_LINK.format(name="wall", shape=_BOX.format(xyz="1.5 0 1", size=".1 1 1"))}</robot>'
    )
    model = _planar(tmp_path, obstacles="obstacles: [wall.urdf]\n")
    checker = CollisionChecker(model, floor=None)
    np.testing.assert_array_equal(
        checker.collides(np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])), [True, False]
    )
    (tmp_path / "wall.urdf").unlink()
    with refused("E-DESIGN-037"):
        CollisionChecker(model)


_MESH = '<collision><geometry><mesh filename="part.stl"/></geometry></collision>'


def _write_mesh(path):
    """A wedge of four corners, 1 m long."""
    corners = np.array([[0, -0.05, 0.95], [1, -0.05, 0.95], [1, 0.05, 0.95], [0.5, 0, 1.05]])
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x:e} {y:e} {z:e}\n" for x, y, z in corners[list(face)])
        + "endloop\nendfacet\n"
        for face in faces
    )
    path.write_text(f"solid part\n{facets}endsolid part\n")


def test_meshes_count_as_their_hull_and_missing_ones_are_an_error(tmp_path):
    model = _planar(tmp_path, last=_MESH)
    with refused("E-DESIGN-036"):
        CollisionChecker(model)
    _write_mesh(tmp_path / "part.stl")
    checker = CollisionChecker(model, floor=None)
    np.testing.assert_array_equal(checker.collides(np.array([[0, 2.9, 0.2], [0, 0.3, 0.2]])), [True, False])


def test_a_checker_travels_without_its_files(tmp_path, rng):
    wall = _LINK.format(name="wall", shape=_BOX.format(xyz="1.5 0 1", size=".1 1 1"))
    (tmp_path / "wall.urdf").write_text(f'<robot name="wall">{wall}</robot>')
    _write_mesh(tmp_path / "part.stl")
    model = _planar(tmp_path, last=_MESH, obstacles="obstacles: [wall.urdf]\n")
    checker = CollisionChecker(model)
    sent = pickle.dumps(checker)
    for path in list(tmp_path.iterdir()):
        path.unlink()
    there = pickle.loads(sent)
    q = rng.uniform(-3, 3, (200, 3))
    assert 20 < checker.collides(q).sum() < 180
    np.testing.assert_array_equal(there.collides(q), checker.collides(q))
    np.testing.assert_array_equal(there.margins, checker.margins)
    assert there.permanent == checker.permanent


def test_no_shapes_no_collisions(ur5, rng):
    assert not CollisionChecker(ur5).collides(rng.uniform(-3, 3, (10, 6))).any()
