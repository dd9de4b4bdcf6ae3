"""The MJCF export: loads in MuJoCo, stands where the model stands, swings as the model swings."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from scipy.linalg import eigh

from flexcal.export import export_mjcf, mjcf_spec
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel, carried_inertias
from flexcal.units import DEGREE

mujoco = pytest.importorskip("mujoco")


@pytest.fixture(params=["after", "before"])
def tx90l(request: pytest.FixtureRequest, tx90l: RobotModel) -> RobotModel:
    """The TX90L with bearings that turn with the child link, and with bearings fixed to the parent."""
    return tx90l.with_bearings(request.param)


def with_geometric_errors(model: RobotModel, rng: np.random.Generator) -> RobotModel:
    geometric = [
        n
        for n in model.values
        if n.endswith(("offset", "misalignment_1", "misalignment_2")) or ".length_" in n
    ]
    return model.with_values(
        {name: 1e-3 * rng.standard_normal() for name in geometric if "torque" not in name}
    )


def test_the_file_stands_where_the_model_stands(
    tx90l: RobotModel, rng: np.random.Generator, tmp_path: Path
) -> None:
    model = with_geometric_errors(tx90l, rng)
    export_mjcf(model, tmp_path / "robot.xml")
    loaded = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data = mujoco.MjData(loaded)
    q, deflection = rng.uniform(-1, 1, 6), np.zeros((1, 6, 3))
    deflection[0, :3] = 0.01 * rng.standard_normal((3, 3))
    for i, name in enumerate(model.joint_names):
        data.joint(name).qpos[0] = q[i]
        if i < 3:
            for c, spring in enumerate(("bearing_x", "bearing_y", "drive")):
                data.joint(f"{name}.{spring}").qpos[0] = deflection[0, i, c]
    mujoco.mj_kinematics(loaded, data)
    expected = point_kinematics(model, q[None], deflection)
    np.testing.assert_allclose(data.site("smr").xpos, expected.position[0], atol=1e-6)
    np.testing.assert_allclose(data.site("smr").xmat.reshape(3, 3), expected.orientation[0], atol=1e-6)


def test_the_spec_is_exact_where_text_rounds(tx90l: RobotModel, rng: np.random.Generator) -> None:
    model = with_geometric_errors(tx90l, rng)
    compiled = mjcf_spec(model).compile()
    data = mujoco.MjData(compiled)
    q = rng.uniform(-1, 1, 6)
    for i, name in enumerate(model.joint_names):
        data.joint(name).qpos[0] = q[i]
    mujoco.mj_kinematics(compiled, data)
    np.testing.assert_allclose(
        data.site("smr").xpos, point_kinematics(model, q[None]).position[0], atol=1e-13
    )


def test_springs_dampers_and_rotors_are_joints_of_one_tree(tx90l: RobotModel) -> None:
    """Locked-motor modes of the bare arm stretched out."""
    expected = {"after": [11.1, 13.3, 39.7, 63.7], "before": [11.0, 13.3, 39.9, 63.7]}[tx90l.bearings]
    q = np.array([0, 90, 0, 0, 0, 0]) * DEGREE
    compiled = mjcf_spec(tx90l, q=q, free=(), payload=0.0).compile()
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    mass = np.empty((compiled.nv, compiled.nv))
    for row, unit in zip(mass, np.eye(compiled.nv), strict=True):
        mujoco.mj_mulM(compiled, data, row, unit)
    squares = eigh(np.diag(compiled.jnt_stiffness), mass, eigvals_only=True)
    np.testing.assert_allclose(np.sqrt(squares[:4]) / (2 * np.pi), expected, atol=0.06)
    whole = mjcf_spec(tx90l).compile()
    assert whole.nv == 15 and whole.ntendon == 0
    assert whole.joint("joint_2").damping[0] == tx90l.drives.viscous[1]
    assert whole.dof_armature[whole.joint("joint_2").dofadr[0]] == tx90l.drives.rotor_inertia[1]


def test_the_payload_is_merged_into_its_link(tx90l: RobotModel) -> None:
    bare, loaded = carried_inertias(tx90l, 0.0)[5], carried_inertias(tx90l, 6.0)[5]
    assert loaded.mass == pytest.approx(bare.mass + 6)
    held = tx90l.payload
    assert held is not None
    np.testing.assert_allclose(loaded.mass * loaded.com, bare.mass * bare.com + 6 * held.com_in_link)


def test_what_cannot_be_built_is_refused(tx90l: RobotModel, ur5: RobotModel) -> None:
    with refused("E-EXPORT-003"):
        mjcf_spec(tx90l, free=(0,))
    with refused("E-ROBOT-001"):
        carried_inertias(ur5, 2.0)


def test_warnings_of_mujoco_leave_no_log_file(
    tx90l: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    weightless = replace(tx90l, drives=replace(tx90l.drives, rotor_inertia=np.zeros(tx90l.n)))
    with pytest.warns(UserWarning, match="Inertia matrix"):
        mjcf_spec(weightless).compile()
    assert list(tmp_path.iterdir()) == []
