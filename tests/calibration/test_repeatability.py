"""ISO 9283 on visits worked out by hand, and on noise of known size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from scipy.spatial.transform import Rotation

from flexcal.calibration.accuracy import noise_repeatability, visit_statistics
from flexcal.data.poses import PoseSet


def visits(q: np.ndarray, position: np.ndarray) -> PoseSet:
    size = len(q)
    return PoseSet(
        q=q, position=position, sigma=np.full((size, 3), 1e-5), torque=None, payload=None, target=np.full(size, "smr"),
        station=np.full(size, "tracker"), temperature=None, pose=np.arange(1, size + 1),
    )  # fmt: skip


A, B, C = np.array([0.1, 0.2]), np.array([0.5, -0.2]), np.array([-0.3, 0.4])


def test_four_visits_by_hand() -> None:
    """Points (±3, 0, 0) and (0, ±1, 0) mm: barycentre 0, l = 3, 3, 1, 1 mm, l̄ = 2, S_l = √(4/3), so RP = 2 + 3 √(4/3) mm."""
    points = 1e-3 * np.array([[3, 0, 0], [-3, 0, 0], [0, 1, 0], [0, -1, 0]]) + [1.0, 2.0, 3.0]
    (found,) = visit_statistics(visits(np.tile(A, (4, 1)), points))
    assert found.repeatability == pytest.approx(1e-3 * (2 + 3 * np.sqrt(4 / 3)), rel=1e-9)
    # 2 mm and 1 mm beside the command: AP = √5 mm
    commanded = np.array([1.0, 2.0, 3.0]) - [2e-3, 0, 1e-3]
    assert found.accuracy(points - commanded) == pytest.approx(1e-3 * np.sqrt(5), rel=1e-9)
    assert found.rotation is None and found.direction_variation is None


def test_visits_are_found_by_their_command_whatever_their_number() -> None:
    q = np.array([A, B, A + 9e-5, C, B, A - 9e-5])
    found = visit_statistics(visits(q, np.random.default_rng(0).standard_normal((6, 3))))
    assert [pose.rows.tolist() for pose in found] == [[0, 2, 5], [1, 4]]
    moved = replace(visits(q, np.zeros((6, 3))), payload=np.array([0.0, 0, 0, 0, 1, 0]))
    assert [pose.rows.tolist() for pose in visit_statistics(moved)] == [[0, 2, 5]]
    with refused("E-CAL-002", "2"):
        visit_statistics(visits(np.array([A, A + 2e-4]), np.zeros((2, 3))))


def test_direction_is_the_pose_before() -> None:
    """A is reached from B at (1, 0, 0) mm on average and from C at (0, 2, 0) mm: vAP = √5 mm; the first visit came from nowhere."""
    q = np.array([A, B, A, C, A, B, A, C, A])
    points = np.zeros((9, 3))
    points[[2, 6]] = [[0.9e-3, 0, 0], [1.1e-3, 0, 0]]
    points[[4, 8]] = [[0, 2e-3, 1e-4], [0, 2e-3, -1e-4]]
    found = visit_statistics(visits(q, points))[0]
    assert found.direction_variation == pytest.approx(1e-3 * np.sqrt(5), rel=1e-9)


def test_orientation_about_the_instruments_axes(rng: np.random.Generator) -> None:
    """Turns of ±1 mrad about z and ±2 mrad about x, away from a large rotation: 3 S = 3 · √(4/3) mrad, and twice that."""
    base = Rotation.from_euler("xyz", [0.5, -0.8, 2.0])
    turns = 1e-3 * np.array([[2, 0, 1], [-2, 0, 1], [2, 0, -1], [-2, 0, -1]])
    quaternion = (Rotation.from_rotvec(turns) * base).as_quat(scalar_first=True)
    poses = replace(visits(np.tile(A, (4, 1)), np.zeros((4, 3))), quaternion_wxyz=quaternion)
    rotation = visit_statistics(poses)[0].rotation
    assert rotation is not None
    np.testing.assert_allclose(rotation, 3e-3 * np.sqrt(4 / 3) * np.array([2, 0, 1]), atol=2e-8)


def test_noise_alone_shows_the_repeatability_that_is_foretold(rng: np.random.Generator) -> None:
    points = 1e-5 * rng.standard_normal((3000, 3))
    (found,) = visit_statistics(visits(np.tile(A, (3000, 1)), points))
    assert found.repeatability == pytest.approx(noise_repeatability(np.full((5, 3), 1e-5)), rel=0.03)
