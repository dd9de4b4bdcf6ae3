"""The MuJoCo plant against Pinocchio: the same robot twice, errors of geometry and payload included."""

from dataclasses import replace

import numpy as np
import pytest

from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium
from flexcal.model.vibration import linearise as pinocchio_linearise
from flexcal.units import DEGREE
from flexcal.virtual_cell import CellConfig, MismatchConfig, SpreadConfig, draw_truth
from flexcal.virtual_cell.equilibrium import rest
from flexcal.virtual_cell.plant import WRIST_DAMPING, Plant, build_plant, linearise, unresolved
from flexcal.virtual_cell.step_size import resolved_plant

mujoco = pytest.importorskip("mujoco")

NO_GAP = SpreadConfig(backlash=(0.0, 0.0))
POSE = np.array([10, 45, 60, 20, -45, 30]) * DEGREE


@pytest.fixture(params=["after", "before"])
def tx90l(request: pytest.FixtureRequest, tx90l: RobotModel) -> RobotModel:
    """The TX90L with bearings that turn with the child link, and with bearings fixed to the parent."""
    return tx90l.with_bearings(request.param)


def rotor_and_arm_coordinates(plant: Plant, model: RobotModel) -> np.ndarray:
    """Matrix from (rotors, arm coordinates of the elastic joints) to the plant's, whose twist is the arm beyond the rotor."""
    names = list(plant.coordinates)
    columns = [*model.driven, *((e, c) for e in model.elastic for c in e.components)]
    matrix = np.zeros((len(names), len(columns)))
    for k, column in enumerate(columns):
        if isinstance(column, tuple):
            spring, component = column
            matrix[names.index(f"{spring.name}.{('bearing_x', 'bearing_y', 'drive')[component]}"), k] = 1
        else:
            matrix[names.index(column.name), k] = 1
            matrix[names.index(f"{column.name}.drive"), k] = -1
    return matrix


@pytest.mark.parametrize(("payload", "wrist"), [(0.0, 0.0), (6.0, 0.0), (6.0, 50e3)])
def test_mass_damping_stiffness_and_gravity_are_pinocchios(
    tx90l: RobotModel, rng: np.random.Generator, payload: float, wrist: float
) -> None:
    """`wrist`: stiffness of the drives of joints 4 to 6, whose motors are braked; 0 is rigid."""
    truth = tx90l.with_values(draw_truth(tx90l, NO_GAP, rng))
    config = CellConfig(mismatch=MismatchConfig(elastic_wrist=wrist))
    plant = build_plant(truth, config, q=POSE, free=(0, 1, 2), payload=payload)
    if wrist > 0:
        truth = truth.with_drive_springs(dict.fromkeys((3, 4, 5), (wrist, WRIST_DAMPING * wrist)))
    found = rest(plant, mujoco.MjData(plant.mjmodel), POSE[:3])
    ours = linearise(plant, found.position)
    theirs = pinocchio_linearise(truth, POSE, payload)
    to = rotor_and_arm_coordinates(plant, truth)
    for mine, other in (
        (ours.mass, theirs.mass),
        (ours.damping, theirs.damping),
        (ours.stiffness, theirs.stiffness),
    ):
        mapped = to.T @ mine @ to
        scale = np.sqrt(np.outer(np.abs(np.diag(other)), np.abs(np.diag(other))))
        assert np.all(np.abs(mapped - other) <= 1e-6 * scale)
    equilibrium = static_equilibrium(truth, POSE, payload)
    np.testing.assert_allclose(found.torque, equilibrium.torque[0, :3], rtol=1e-6, atol=1e-9)


def test_gravity_of_the_rigid_arm_is_pinocchios(ur5: RobotModel, rng: np.random.Generator) -> None:
    import pinocchio as pin

    arm = pin.buildModelFromUrdf(str(ur5.urdf))
    arm.gravity = pin.Motion(ur5.gravity, np.zeros(3))
    plant = build_plant(ur5, CellConfig())
    q = rng.uniform(-2, 2, ur5.n)
    torque = rest(plant, mujoco.MjData(plant.mjmodel), q).torque
    np.testing.assert_allclose(
        torque, pin.computeGeneralizedGravity(arm, arm.createData(), q), rtol=1e-6, atol=1e-9
    )


def test_the_wrist_is_locked_by_welding_it(tx90l: RobotModel) -> None:
    plant = build_plant(tx90l, CellConfig(), q=POSE, free=(0, 1, 2))
    assert plant.mjmodel.nv == 12
    assert plant.mjmodel.nbody == 4


def test_an_elastic_wrist_adds_its_springs(tx90l: RobotModel) -> None:
    config = CellConfig(mismatch=MismatchConfig(elastic_wrist=30e3))
    plant = build_plant(tx90l, config, q=POSE, free=(0, 1, 2), time_step=0.125e-3)
    assert unresolved(plant) is None
    assert [name for name in plant.coordinates if name[6] in "456"] == [
        "joint_4.drive",
        "joint_5.drive",
        "joint_6.drive",
    ]


def test_steps_too_long_for_robot_or_friction_are_seen(tx90l: RobotModel) -> None:
    config = CellConfig()
    harsh = replace(config, friction=replace(config.friction, coulomb_velocity=1e-3))

    def judge(config: CellConfig, time_step: float) -> str | None:
        return unresolved(build_plant(tx90l, config, q=POSE, free=(0, 1, 2), time_step=time_step))

    assert judge(config, 0.25e-3) is None
    assert judge(config, 1e-3) == "the robot's fastest modes"
    assert judge(harsh, 0.25e-3) == "the motors' Coulomb friction near standstill"


def test_a_wrist_too_light_for_its_springs_moves_rigidly(tx90l: RobotModel) -> None:
    """With every motor free and nothing in the hand; with the springs of the first joints as they are."""
    config = CellConfig(mismatch=MismatchConfig(elastic_wrist=50e3))
    plant, substeps = resolved_plant(tx90l, config, q=POSE, free=range(6), payload=0.0, rate_hz=4000.0)
    rigid, same = resolved_plant(tx90l, CellConfig(), q=POSE, free=range(6), payload=0.0, rate_hz=4000.0)
    assert (plant.coordinates, substeps) == (rigid.coordinates, same)
    assert unresolved(plant) is None
