"""Rotations round-trip through the forms that files use, gimbal lock included."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from flexcal.model.parts import (
    rotation_rpy,
    rotation_vector,
    rotation_wxyz,
    rpy_rotation,
    vector_rotation,
    wxyz_rotation,
)

ANGLE = st.floats(-3.14, 3.14)


@given(ANGLE, st.one_of(ANGLE, st.sampled_from([np.pi / 2, -np.pi / 2, 1.5707963268, -1.5707963268])), ANGLE)
def test_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> None:
    rotation = rpy_rotation(np.array([roll, pitch, yaw]))
    np.testing.assert_allclose(
        rotation, Rotation.from_euler("xyz", [roll, pitch, yaw]).as_matrix(), atol=1e-14
    )
    np.testing.assert_allclose(rpy_rotation(rotation_rpy(rotation)), rotation, atol=2e-15)


@given(ANGLE, ANGLE, ANGLE)
def test_rotation_vector_and_quaternion(a: float, b: float, c: float) -> None:
    rotation = Rotation.from_euler("zyx", [a, b, c])
    matrix = rotation.as_matrix()
    np.testing.assert_allclose(vector_rotation(rotation_vector(matrix)), matrix, atol=1e-12)
    quaternion = rotation.as_quat(scalar_first=True)
    np.testing.assert_allclose(
        rotation_wxyz(matrix), quaternion * (1 if quaternion[0] >= 0 else -1), atol=1e-7
    )


def test_many_at_once() -> None:
    rotations = Rotation.random(200, random_state=1)
    matrices = rotations.as_matrix().reshape(20, 10, 3, 3)
    vectors, quaternions = rotation_vector(matrices), rotation_wxyz(matrices)
    np.testing.assert_allclose(vectors.reshape(-1, 3), rotations.as_rotvec(), atol=1e-12)
    np.testing.assert_allclose(wxyz_rotation(quaternions), matrices, atol=1e-14)
    assert (quaternions[..., 0] >= 0).all() and not rotation_vector(np.eye(3)).any()
