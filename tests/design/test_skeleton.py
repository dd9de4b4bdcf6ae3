import numpy as np

from flexcal.model.kinematics import joint_origins, link_frames, point_kinematics


def test_frames_agree_with_pinocchio(tx90l, rng):
    import pinocchio as pin

    model = pin.buildModelFromUrdf(str(tx90l.urdf))
    data = model.createData()
    q = rng.uniform(-2, 2, (5, 6))
    rotation, origin = link_frames(tx90l, q)
    for s in range(5):
        pin.forwardKinematics(model, data, q[s])
        for i in range(6):
            np.testing.assert_allclose(rotation[s, i], data.oMi[i + 1].rotation, atol=1e-14)
            np.testing.assert_allclose(origin[s, i], data.oMi[i + 1].translation, atol=1e-14)


def test_geometric_errors_count_as_in_point_kinematics(tx90l, rng):
    names = [
        f"{j}.{k}"
        for j in tx90l.joint_names
        for k in ("offset", "misalignment_1", "misalignment_2", "length_x", "length_y")
    ]
    model = tx90l.with_values({name: rng.normal(0, 0.05) for name in names})
    q = rng.uniform(-2, 2, (20, 6))
    rotation, origin = link_frames(model, q)
    point = model.point()
    tip = point.translation + model.geometry.errors[-1, 3:] + point.rotation @ point.xyz
    np.testing.assert_allclose(
        origin[:, -1] + rotation[:, -1] @ tip, point_kinematics(model, q).position, atol=1e-13
    )


def test_chain_runs_from_base_to_target(tx90l, rng):
    q = rng.uniform(-2, 2, (4, 6))
    corners = joint_origins(tx90l, q)
    assert corners.shape == (4, 8, 3)
    np.testing.assert_array_equal(corners[:, 0], 0.0)
    np.testing.assert_allclose(corners[:, 1], np.tile([0, 0, 0.478], (4, 1)))
    np.testing.assert_allclose(np.linalg.norm(corners[:, 5] - corners[:, 4], axis=1), 0.55)
    np.testing.assert_allclose(corners[:, -1], point_kinematics(tx90l, q).position)
