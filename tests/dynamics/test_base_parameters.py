"""Base parameters against the closed-form count and the regrouping published for the TX40."""

from dataclasses import replace

import numpy as np
import pytest

from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel

PUBLISHED = [  # thanhndv212/figaroh-examples, TX40_bp_5.csv, in the names used here
    "link_1.Izz + link_2.Iyy + 0.05185 link_3.mass + 0.07 link_3.mc_z + link_3.Iyy + 0.05185 link_4.mass + 0.05185 link_5.mass"
    " + 0.05185 link_6.mass + joint_1.rotor_inertia",
    "link_2.Ixz - 0.007875 link_3.mass - 0.225 link_3.mc_z - 0.007875 link_4.mass - 0.007875 link_5.mass - 0.007875 link_6.mass",
    "link_3.mc_y - 0.225 link_4.mass - link_4.mc_z - 0.225 link_5.mass - 0.225 link_6.mass",
    "link_5.mc_y - link_6.mc_z",
    "link_6.Ixx - link_6.Iyy",
    "joint_6.rotor_inertia_at_joint_5",
]


@pytest.mark.parametrize("name", ["tx40", "tx90l", "ur5"])
def test_a_6r_arm_on_a_vertical_axis_has_36(name: str, request: pytest.FixtureRequest) -> None:
    """7 a joint, less 4 that the fixed base takes and 2 that gravity along the first axis hides (Khalil & Dombre)."""
    model: RobotModel = request.getfixturevalue(name)
    assert BaseParameters.of(Observation(model, ())).rank == 7 * 6 - 4 - 2


def test_gravity_across_the_first_axis_shows_two_more(ur5: RobotModel) -> None:
    leaning = replace(ur5, config=replace(ur5.config, gravity=(5.0, 0.0, -8.0)))
    assert BaseParameters.of(Observation(leaning, ())).rank == 38


def test_the_tx40_regroups_as_published(tx40: RobotModel) -> None:
    """61: the published list plus the rotor inertia of joint 6, which an index error there hides."""
    base = BaseParameters.of(Observation(tx40, CLASSIC))
    assert base.rank == 61
    assert base.identifiability.gap > 6
    assert set(PUBLISHED) <= set(base.expressions)
    assert "joint_6.rotor_inertia" in base.expressions


def test_base_parameters_give_the_same_torques(
    tx40: RobotModel, motion: Motion, rng: np.random.Generator
) -> None:
    observation = Observation(tx40, CLASSIC)
    found = BaseParameters.of(observation).identifiability
    parameters = rng.normal(size=len(observation.names))
    regrouped = np.zeros(len(parameters))
    regrouped[list(found.kept)] = found.regrouping @ parameters
    for members, columns in zip(observation.column_indices, observation.columns(motion), strict=True):
        expected = parameters[members] @ columns
        assert np.abs(regrouped[members] @ columns - expected).max() < 1e-8 * np.abs(expected).max()


def test_coupled_friction_is_that_of_one_motor(tx40: RobotModel, motion: Motion) -> None:
    """With its own and its coupled terms equal, the torques on joints 5 and 6 are Tᵀ times those of a motor that turns at T q̇."""
    observation = Observation(tx40, CLASSIC)
    parameters = np.zeros(len(observation.names))
    for key, value in (("rotor_inertia", 0.3), ("viscous", 0.7)):
        for name in (f"joint_6.{key}", f"joint_5.{key}", f"joint_6.{key}_at_joint_5"):
            parameters[observation.names.index(name)] = value
    parameters[observation.names.index("joint_6.coulomb_at_joint_5")] = 2.0
    speed, push = (values[:, 4] + values[:, 5] for values in (motion.dq, motion.ddq))
    one = 0.3 * push + 0.7 * speed + 2.0 * np.sign(speed)
    columns = observation.columns(motion)
    for joint in (4, 5):
        np.testing.assert_allclose(
            parameters[observation.column_indices[joint]] @ columns[joint], one, atol=1e-12
        )
