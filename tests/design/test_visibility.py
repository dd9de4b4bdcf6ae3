import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
from refusals import refused

from flexcal.design.poses import random_candidates
from flexcal.design.scene import CollisionChecker, MeasuringSetup, station_position, visible
from flexcal.design.scene.visibility import line_of_sight_blocked
from flexcal.model.kinematics import link_frames, point_kinematics
from flexcal.model.parts import rpy_rotation
from flexcal.model.robot import AcceptanceConfig
from flexcal.model.robot.measuring_config import StationConfig
from flexcal.units import DEGREE


def _inside(model, q, points, inflated):
    """Whether any of `points` (samples, k, 3) is inside a URDF primitive grown by `inflated`, read here without coal."""
    rotation, origin = link_frames(model, q)
    links = {joint.link: i for i, joint in enumerate(model.joints)}
    hit = np.zeros(len(q), dtype=bool)
    for link in ET.parse(model.urdf).getroot().iter("link"):
        for shape in link.iter("collision"):
            place = shape.find("origin")
            offset = np.array(place.get("xyz").split(), dtype=float)
            turn = rpy_rotation(np.array(place.get("rpy").split(), dtype=float))
            i = links.get(link.get("name"))
            local = points if i is None else (points - origin[:, i, None]) @ rotation[:, i]
            local = (local - offset) @ turn
            box, tube = shape.find("geometry/box"), shape.find("geometry/cylinder")
            if box is not None:
                half = np.array(box.get("size").split(), dtype=float) / 2 + inflated
                inside = np.all(np.abs(local) < half, axis=2)
            else:
                inside = np.hypot(local[..., 0], local[..., 1]) < float(tube.get("radius")) + inflated
                inside &= np.abs(local[..., 2]) < float(tube.get("length")) / 2 + inflated
            hit |= inside.any(axis=1)
    return hit


def test_line_of_sight_against_points_along_the_beam(tx90l, rng):
    q = random_candidates(CollisionChecker(tx90l), 200, rng)
    checker = CollisionChecker(tx90l)
    origin = station_position(tx90l)
    q = np.concatenate([q, rng.uniform(-2, 2, (200, 6))])
    target = point_kinematics(tx90l, q, jacobians=False).position
    found = line_of_sight_blocked(checker, q, origin, target, 0.01, 0.03)
    span = target - origin
    length = np.linalg.norm(span, axis=1)
    reach = (length - 0.03)[:, None] * np.linspace(0, 1, 600)
    beam = origin + (span / length[:, None])[:, None] * reach[..., None]
    surely, perhaps = _inside(tx90l, q, beam, 0.0), _inside(tx90l, q, beam, 0.02)
    assert surely.sum() > 20
    assert np.all(found[surely])
    assert np.all(perhaps[found])


def test_behind_the_robot_the_target_is_hidden(tx90l):
    # arm straight up, bent backwards: the tracker in front looks through the column
    checker = CollisionChecker(tx90l)
    q = np.array([[0, 0, 0, 0, 0, 0], [180, 100, 0, 0, 0, 0], [0, 100, 0, 0, 0, 0]]) * DEGREE
    np.testing.assert_array_equal(visible(checker, q)[1:], [False, True])


def test_acceptance_is_an_angle_about_the_axis(tx90l, rng):
    checker = CollisionChecker(tx90l)
    q = rng.uniform(-2, 2, (400, 6))
    free = visible(checker, q)
    narrow = visible(checker, q, MeasuringSetup(acceptance=AcceptanceConfig((0.0, 0.0, 2.0), 40 * DEGREE)))
    motion = point_kinematics(tx90l, q, jacobians=False)
    towards = np.array([2.5, 0, 1]) - motion.position
    angle = np.arccos(np.sum(motion.orientation[:, :, 2] * towards, axis=1) / np.linalg.norm(towards, axis=1))
    np.testing.assert_array_equal(narrow, free & (angle <= 40 * DEGREE))
    assert 0 < narrow.sum() < free.sum()


def test_a_station_without_a_place_is_only_a_name(ur5) -> None:
    """Calibration finds the place; a line of sight cannot do without."""
    config = replace(ur5.config, stations={"tracker": StationConfig()})
    assert station_position(replace(ur5, config=config)) is None
    with refused("E-ROBOT-020"):
        StationConfig(line_of_sight=True)


def test_without_a_declared_station_everything_is_seen(ur5, rng):
    assert station_position(ur5) is None
    assert visible(CollisionChecker(ur5), rng.uniform(-3, 3, (5, 6))).all()


def test_bad_input(tx90l):
    with refused("E-DESIGN-040", "x"):
        station_position(tx90l, "x")
    with refused("E-ROBOT-004"):
        AcceptanceConfig((0.0, 0.0, 0.0))
