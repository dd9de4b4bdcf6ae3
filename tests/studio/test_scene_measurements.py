"""What stands around the robot in the scene: arrows, points, lines of sight, volumes, motions."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from refusals import refused
from waiting import until

from flexcal.design.scene import CollisionChecker
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import Frame

viser = pytest.importorskip("viser", reason="the studio's extra is not installed")
from flexcal.studio.scene import (  # noqa: E402
    BLOCKED,
    AccuracyVolume,
    ColourScale,
    DraggablePoint,
    Instrument,
    Motion,
    Points,
    ResidualArrows,
    RobotView,
    WorkingBox,
    colliding_links,
)

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def scene() -> Iterator[viser.SceneApi]:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server.scene
    server.stop()


@pytest.fixture(scope="module")
def robot() -> RobotModel:
    return RobotModel.from_yaml(EXAMPLES / "tx90l" / "robot.yaml", estimates=False)


def drawn(scene: viser.SceneApi, name: str) -> np.ndarray:
    """All corners (M, 3) of the meshes below a node."""
    meshes = [h for n, h in scene._handle_from_node_name.items() if n.startswith(f"{name}/colour_")]
    return np.concatenate([np.asarray(mesh.vertices) for mesh in meshes])


def test_arrows_end_where_the_error_leads(scene: viser.SceneApi, rng: np.random.Generator) -> None:
    starts, vectors = rng.normal(size=(200, 3)), 1e-4 * rng.normal(size=(200, 3))
    vectors[0], vectors[1, 2] = 0.0, np.nan
    arrows = ResidualArrows(scene, starts, vectors, 300.0, name="/a", width=0.02)
    for factor in (300.0, 50.0):
        arrows.exaggeration = factor
        corners = drawn(scene, "/a").reshape(-1, 5, 3)
        assert len(corners) == 199  # the one that is not finite is left out
        tips, bases = corners[:, 4], corners[:, :4].mean(axis=1)
        order = [int(np.argmin(np.linalg.norm(starts - base, axis=1))) for base in bases]
        assert sorted(order) == [k for k in range(200) if k != 1]
        np.testing.assert_allclose(tips, (starts + factor * vectors)[order], atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(corners[:, 0] - bases, axis=1), 0.01, atol=1e-6)


def test_longer_errors_have_warmer_colours(scene: viser.SceneApi) -> None:
    vectors = np.linspace(0, 1e-3, 80)[:, None] * [0.0, 0.0, 1.0]
    ResidualArrows(scene, np.arange(240.0).reshape(80, 3), vectors, name="/warm", scale=ColourScale(1e-3))
    warmth = []
    for number in range(8):
        mesh = scene._handle_from_node_name[f"/warm/colour_{number}"]
        assert len(mesh.vertices) == 5 * 10
        warmth.append(int(mesh.color[0]) - int(mesh.color[2]))
    assert warmth[-1] > 100 and warmth[0] < 0


def test_a_click_picks_the_first_arrow_on_its_ray(scene: viser.SceneApi) -> None:
    starts = np.array([[0.0, 0, 0], [0, 0, 1], [0.5, 0, 0]])
    arrows = ResidualArrows(scene, starts, np.tile([0.3, 0, 0], (3, 1)), name="/picked", width=0.04)
    pick = arrows._arrows.pick
    down = np.array([0.0, 0, -1])
    assert pick(np.array([0.1, 0, 3]), down) == 1
    assert pick(np.array([0.1, 0, 0.5]), down) == 0
    assert pick(np.array([0.6, 0, 3]), 5 * down) == 2
    assert pick(np.array([0.81, 0, 3]), down) == 2  # beside the tip by 0.01 at 3 m: near enough
    assert pick(np.array([0.1, 0.3, 3]), down) is None
    assert pick(np.array([0.1, 0, 3]), -down) is None


def test_selected_points_and_arrows_are_marked_once(scene: viser.SceneApi) -> None:
    positions = np.array([[0.0, 0, 0], [1, 2, 3], [np.nan, 0, 0]])
    points = Points(scene, positions, name="/points", size=0.1)
    assert len(drawn(scene, "/points")) == 2 * 6
    points.highlight(1)
    corners = drawn(scene, "/points/selected")
    np.testing.assert_allclose(corners.mean(axis=0), [1, 2, 3], atol=1e-6)
    assert np.ptp(corners, axis=0).min() > 0.1
    points.highlight(None)
    assert "/points/selected/colour_0" not in scene._handle_from_node_name
    points.show(np.zeros((1, 3)))
    assert len(drawn(scene, "/points")) == 6


def test_blocked_lines_of_sight_have_their_colour(scene: viser.SceneApi) -> None:
    instrument = Instrument(scene, np.array([2.0, 1, 0.5]), "<b>tracker</b>", name="/tracker")
    points = np.arange(9.0).reshape(3, 3)
    instrument.look_at(points, np.array([False, True, False]))
    instrument.position = np.array([3.0, 0, 0])
    lines = scene._handle_from_node_name["/tracker/lines"]
    np.testing.assert_allclose(lines.points[:, 0], np.tile([3.0, 0, 0], (3, 1)))
    np.testing.assert_allclose(lines.points[:, 1], points)
    assert (lines.colors == BLOCKED).all(axis=(1, 2)).tolist() == [False, True, False]


def test_a_dragged_corner_tells_both_and_a_set_one_nobody(scene: viser.SceneApi) -> None:
    told: list[tuple[np.ndarray, np.ndarray]] = []
    box = WorkingBox(scene, np.zeros(3), np.ones(3), lambda *corners: told.append(corners), name="/box")
    box.corners = np.array([0.0, 0, 0]), np.array([1.0, 2, 3])
    assert told == []
    box._handles[0].position = (4.0, 1, 1)  # dragged past the other one
    for callback in box._handles[0]._impl_aux.update_cb:
        callback(None)
    np.testing.assert_allclose(told, [([1, 1, 1], [4, 2, 3])])
    edges = scene._handle_from_node_name["/box/edges"].points
    lengths = np.sort(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1))
    np.testing.assert_allclose(lengths, np.sort(np.repeat([3.0, 1, 2], 4)))


def test_a_point_on_a_link_stands_where_the_robot_has_it(
    scene: viser.SceneApi, robot: RobotModel, rng: np.random.Generator
) -> None:
    view = RobotView(scene, robot, name="/carrier")
    target = robot.point(None)
    point = DraggablePoint(
        scene, view, Frame(target.joint, target.rotation, target.translation), target.xyz, lambda xyz: None
    )
    q = rng.uniform(-1, 1, robot.n)
    view.pose(q)
    at = point.xyz
    for node in (view.node(target.joint) + "/point", view.node(target.joint)):
        frame = scene._handle_from_node_name[node]
        w, *v = frame.wxyz
        at = frame.position + at + 2 * np.cross(v, np.cross(v, at) + w * at)
    np.testing.assert_allclose(at, point_kinematics(robot, q).position[0], atol=1e-9)


def test_the_plane_hides_what_is_before_it(scene: viser.SceneApi) -> None:
    points = np.array([[0.0, 0, 0], [0, 1, 0], [0, 2, 0], [0, 3, 0]])
    volume = AccuracyVolume(scene, points, np.array([0.1, 0.2, 0.3, np.nan]), name="/volume")
    assert volume.mask.tolist() == [True, True, True, False]
    volume.cut("y", 1.0)
    assert volume.mask.tolist() == [True, True, False, False]
    volume.cut("y", 1.5, flipped=True)
    assert volume.mask.tolist() == [False, False, True, False]
    np.testing.assert_allclose(scene._handle_from_node_name["/volume"].points, [[0, 2, 0]])
    volume.show(np.full(4, 0.1))
    assert volume.mask.tolist() == [False, False, True, True]
    volume.restrict(np.array([True, True, True, False]))
    assert volume.mask.tolist() == [False, False, True, False]
    volume.uncut()
    volume.restrict(None)
    assert volume.mask.all()


def test_before_and_after_share_their_colours() -> None:
    before, after = np.array([0.0, 0.5, 1.0]), np.array([0.0, 0.05, 0.1])
    scale = ColourScale.shared(before, after)
    assert 0.9 < scale.largest <= 1.0
    assert not (scale.colours(after)[2] == scale.colours(before)[2]).all()
    assert (scale.colours(np.array([5.0, np.inf])) == scale.colours(np.array([2.0]))).all()
    assert (ColourScale(0.0).colours(np.zeros(2)) == ColourScale(1.0).colours(np.zeros(2))).all()
    # the ends and the middle are those of the report
    expected = [[0xA9, 0xB6, 0xC4], [0x1F, 0x6F, 0xD0], [0xD9, 0x54, 0x1E]]
    assert np.abs(ColourScale(1.0).colours(np.array([0, 0.5, 1.0])).astype(int) - expected).max() <= 1


def test_a_motion_passes_its_positions_and_ends(
    scene: viser.SceneApi, robot: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a clock that stands still until the test sets it."""
    clock = SimpleNamespace(now=100.0, monotonic=lambda: clock.now)
    monkeypatch.setattr("flexcal.studio.scene.motion.time", clock)
    view = RobotView(scene, robot, name="/moving")
    times = np.array([1.0, 1.1, 1.3])
    q = np.array([np.zeros(6), np.full(6, 0.2), np.full(6, -0.2)])
    seen: list[tuple[float, float]] = []
    motion = Motion(view, times, q, shown=lambda moment: seen.append((moment, view.q[0])))
    np.testing.assert_allclose(motion.at(1.05), np.full(6, 0.1))
    np.testing.assert_allclose(motion.at(1.2), np.zeros(6), atol=1e-12)
    np.testing.assert_allclose(motion.at(9.0), q[2])
    motion.start()
    for clock.now in (100.0, 100.05, 100.2):
        count = len(seen)
        until(lambda count=count: len(seen) > count + 1)  # the first may have been under way
        assert motion.playing and motion.time == pytest.approx(clock.now - 99.0)
    clock.now = 109.0
    until(lambda: not motion.playing)
    assert motion.time == 1.3 and {round(moment, 9) for moment, _ in seen} == {1.0, 1.05, 1.2, 1.3}
    for moment, first in seen:
        expected = 2 * (moment - 1.0) if moment <= 1.1 else 0.2 - 2 * (moment - 1.1)
        assert abs(first - expected) < 1e-9
    motion.start()  # begins anew
    until(lambda: seen[-1][0] == 1.0)
    motion.pause()
    assert not motion.playing and motion.time == 1.0 and threading.active_count() < 50


def test_times_that_do_not_increase_are_refused(scene: viser.SceneApi, robot: RobotModel) -> None:
    view = RobotView(scene, robot, name="/still")
    for times in ([0.0, 1.0], [0.0, 1.0, 1.0], [0.0, np.nan, 2.0]):
        with refused("E-STUDIO-018", "3", str(len(times))):
            Motion(view, np.array(times), np.zeros((3, 6)))


def test_links_that_touch_are_told_by_their_joints(robot: RobotModel, rng: np.random.Generator) -> None:
    checker = CollisionChecker(robot)
    touching = {name for pair in checker.pairs for name in pair}
    found = 0
    for q in rng.uniform(-2.5, 2.5, (60, 6)):
        pairs, joints = checker.colliding(q), colliding_links(checker, q)
        assert bool(pairs) == bool(joints)
        for joint in joints:  # shapes of the URDF are link_0, link_1 … behind their joints
            assert any(f"_{joint + 1}" in name for pair in pairs for name in pair), (pairs, joints)
        found += bool(pairs)
    assert found > 3 and touching
