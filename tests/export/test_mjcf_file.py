"""The MJCF file, loaded and let come to rest by MuJoCo, against the static equilibrium of the model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexcal.export import export_mjcf, render_mjcf, write_rendered
from flexcal.export.representation_error import random_poses, tool_positions
from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium

mujoco = pytest.importorskip("mujoco")


@pytest.fixture(params=["after", "before"])
def tx90l(request: pytest.FixtureRequest, tx90l: RobotModel) -> RobotModel:
    """The TX90L with bearings that turn with the child link, and with bearings fixed to the parent."""
    return tx90l.with_bearings(request.param)


def test_the_arm_comes_to_rest_where_the_model_rests(
    tx90l: RobotModel, erroneous, rng: np.random.Generator, tmp_path: Path
) -> None:
    """Under gravity and 6 kg of payload, the motors held by rotors too heavy to move, ringing down in two seconds with more damping."""
    model = erroneous(tx90l)
    export_mjcf(model, tmp_path / "robot.xml")
    loaded = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    motors = [loaded.joint(name).qposadr[0] for name in model.joint_names]
    loaded.dof_armature[[loaded.joint(name).dofadr[0] for name in model.joint_names]] = 1e12
    loaded.dof_damping *= 20
    for q in rng.uniform(-1, 1, (2, 6)):
        data = mujoco.MjData(loaded)
        data.qpos[motors] = q
        for _ in range(8000):
            mujoco.mj_step(loaded, data)
        np.testing.assert_allclose(data.qpos[motors], q, atol=1e-8)
        expected = tool_positions(model, q[None])[0][0]
        np.testing.assert_allclose(data.site("smr").xpos, expected, atol=1e-6)
        twist = static_equilibrium(model, q[None]).deflection[0, 1, 2]
        assert data.joint("joint_2.drive").qpos[0] == pytest.approx(twist, abs=1e-7)
        assert abs(twist) > 1e-5


def test_only_what_mjcf_has_no_place_for_is_lost(tx90l: RobotModel, tmp_path: Path) -> None:
    loose = tx90l.with_values({"joint_2.backlash": 1e-4, "joint_5.gravity_compliance": 1e-5})
    export = write_rendered(loose, tmp_path / "robot.xml", render_mjcf(loose))
    assert export.lost == ("gravity compliance",)
    q, _ = random_poses(loose, None, np.random.default_rng(0))
    tight = tx90l.with_values({"joint_2.backlash": 1e-4})
    missed = np.linalg.norm(tool_positions(loose, q)[0] - tool_positions(tight, q)[0], axis=1)
    error = export.loss.error
    assert error is not None
    np.testing.assert_allclose([error.mean, error.max], [missed.mean(), missed.max()], rtol=1e-6)
    assert "cannot carry gravity compliance." in (tmp_path / "robot.xml").read_text()
    assert export_mjcf(tx90l, tmp_path / "robot.xml").lost == ()


def test_linear_springs_in_place_of_drives_that_harden_are_told(tx90l: RobotModel, tmp_path: Path) -> None:
    hard = tx90l.with_values({"joint_2.drive.hardening": 0.2})
    export = write_rendered(hard, tmp_path / "robot.xml", render_mjcf(hard))
    assert export.lost == ("hardening of drives",)
    q, _ = random_poses(hard, None, np.random.default_rng(0))
    missed = np.linalg.norm(tool_positions(hard, q)[0] - tool_positions(tx90l, q)[0], axis=1)
    error = export.loss.error
    assert error is not None and error.max > 1e-5
    np.testing.assert_allclose([error.mean, error.max], [missed.mean(), missed.max()], rtol=1e-6)


def test_the_arm_rests_on_the_side_of_a_gap_to_which_gravity_presses_it(
    tx90l: RobotModel, tmp_path: Path
) -> None:
    """By MuJoCo's own steps: the arm falls through the gap, and the end of it holds."""
    half = 2e-3
    loose = tx90l.without_springs().with_values({"joint_2.backlash": half})
    assert export_mjcf(loose, tmp_path / "robot.xml").lost == ()
    loaded = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    motors = [loaded.joint(name).qposadr[0] for name in loose.joint_names]
    loaded.dof_armature[[loaded.joint(name).dofadr[0] for name in loose.joint_names]] = 1e12
    for q2 in (0.6, -0.6):
        q = np.array([0.2, q2, 0.1, 0.0, 0.2, 0.0])
        data = mujoco.MjData(loaded)
        data.qpos[motors] = q
        for _ in range(3000):
            mujoco.mj_step(loaded, data)
        expected = tool_positions(loose, q[None])[0][0]
        moved = np.linalg.norm(expected - tool_positions(tx90l.without_springs(), q[None])[0][0])
        assert np.linalg.norm(data.site("smr").xpos - expected) < 0.05 * moved
        assert abs(data.joint("joint_2.backlash").qpos[0]) == pytest.approx(half, rel=0.05)


def test_without_a_rotor_the_gap_is_lost(tx90l: RobotModel, tmp_path: Path) -> None:
    loose = tx90l.without_springs().with_values({"joint_2.backlash": 1e-3, "joint_2.rotor_inertia": 0.0})
    assert export_mjcf(loose, tmp_path / "robot.xml").lost == ("backlash",)
