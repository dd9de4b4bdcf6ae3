"""Pseudo-inertias, closed loops and meshes against Pinocchio, the open loop and elementary geometry."""

from collections import Counter

import numpy as np
import pinocchio as pin
import pytest

from flexcal.model.kinematics.triangle_meshes import box, capsule
from flexcal.model.parts import Inertia, pseudo_inertia
from flexcal.model.robot import RobotModel
from flexcal.model.vibration import linearise, multisine_torque, transfer_matrix
from flexcal.model.vibration.closed_loop import closed_loop_motion, drive_stretch

POSE = np.array([0.3, 0.7, -0.4, 0.5, 0.6, 0.2])
LINES = np.array([3.0, 11.0, 13.3, 40.0])
KP, KD = np.array([2e4, 3e4, 1e4]), np.array([300.0, 500.0, 100.0])


def test_pseudo_inertia_is_pinocchios(rng: np.random.Generator) -> None:
    root = rng.normal(size=(3, 3))
    body = Inertia(3.7, rng.normal(size=3), root @ root.T)
    expected = pin.PseudoInertia.FromInertia(pin.Inertia(body.mass, body.com, body.inertia)).toMatrix()
    np.testing.assert_allclose(pseudo_inertia(body), expected, rtol=1e-12, atol=1e-12)


def test_closed_loop_is_the_open_loop_with_feedback(tx90l: RobotModel) -> None:
    """Motors move by Y (1 + (kp + kd s) Y)⁻¹, Y the open loop's."""
    system = linearise(tx90l, POSE)
    s = 2j * np.pi * LINES[:, None, None]
    free = transfer_matrix(system, LINES).response / s**2
    feedback = np.diag(KP) + s * np.diag(KD)
    expected = free @ np.linalg.inv(np.eye(3) + feedback @ free)
    found = closed_loop_motion(system, LINES, KP, KD)[:, :3]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_torque_in_the_drives_is_summed_over_lines_and_motors(tx90l: RobotModel) -> None:
    system = linearise(tx90l, POSE)
    amplitude = np.arange(1.0, 13.0).reshape(3, 4)
    moved = closed_loop_motion(system, LINES, KP, KD)
    pull = drive_stretch(tx90l, system)
    for axis, joint in enumerate(tx90l.driven):
        squares = [
            0.5
            * abs(joint.stiffness[2] * amplitude[motor, line] * (pull[:, axis] @ moved[line, :, motor])) ** 2
            for motor in range(3)
            for line in range(4)
        ]
        found = multisine_torque(tx90l, system, LINES, amplitude, KP, KD)[axis]
        assert found == pytest.approx(np.sqrt(np.sum(squares)), rel=1e-12)


@pytest.mark.parametrize(
    ("mesh", "volume", "far"),
    [
        (box(np.array([0.1, 0.2, 0.3])), 8 * 0.1 * 0.2 * 0.3, (0.1, 0.2, 0.3)),
        (capsule(0.1, 0.25), np.pi * 0.01 * 0.5 + 4 / 3 * np.pi * 1e-3, (0.1, 0.1, 0.35)),
    ],
    ids=["box", "capsule"],
)
def test_meshes_are_closed_and_have_the_volume(mesh, volume: float, far: tuple[float, float, float]) -> None:
    """Every edge belongs to two triangles, once in each direction; the volume is the divergence theorem's.

    Corners in one place are one, and triangles without an area are none.
    """
    points, numbers = np.unique(mesh[0].round(9) + 0.0, axis=0, return_inverse=True)
    triangles = numbers.ravel()[mesh[1]]
    triangles = np.array([t for t in triangles if len(set(t.tolist())) == 3])
    edges = Counter((int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3))
    assert set(edges.values()) == {1} and all((b, a) in edges for a, b in edges)
    a, b, c = points[triangles].transpose(1, 0, 2)
    assert abs(np.sum(a * np.cross(b, c))) / 6 == pytest.approx(volume, rel=0.06)
    np.testing.assert_allclose(np.abs(points).max(axis=0), far, atol=1e-8)
