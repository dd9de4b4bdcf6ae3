"""Robots that can be built: the optimum against another parametrisation and optimiser, the truth without noise, the way to a URDF."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from log_cholesky import LogCholesky
from scipy.optimize import minimize

from flexcal.data.recordings import Decimation, read_recording
from flexcal.dynamics.estimators import (
    feasible_least_squares,
    noise_levels,
    weighted_least_squares,
    weighted_system,
)
from flexcal.dynamics.estimators.physical_constraints import feasible_set
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import RegressionData, assemble_regression
from flexcal.dynamics.signals import Motion, Window
from flexcal.estimation import Estimate
from flexcal.export import export_urdf
from flexcal.model.parts import PSEUDO_INERTIA, is_physically_consistent, pseudo_inertia
from flexcal.model.robot import RobotModel

NOISE = np.array([3.0, 2.0, 1.0, 0.3, 0.2, 0.05])

TWO_RODS = """<robot name="two_rods">
  <link name="base"/>
  <link name="link_1">
    <inertial><origin xyz="0 0 0.2"/><mass value="6"/><inertia ixx="0.09" iyy="0.09" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="link_2">
    <inertial><origin xyz="0.2 0 0"/><mass value="3"/><inertia ixx="0.002" iyy="0.04" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="weight">
    <inertial><origin xyz="0 0 0.1"/><mass value="0.5"/><inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="joint_1" type="revolute">
    <parent link="base"/><child link="link_1"/><axis xyz="0 0 1"/><limit effort="9" velocity="9" lower="-9" upper="9"/>
  </joint>
  <joint name="joint_2" type="revolute">
    <parent link="link_1"/><child link="link_2"/><origin xyz="0 0 0.4" rpy="0.3 0 0"/><axis xyz="0 1 0"/>
    <limit effort="9" velocity="9" lower="-9" upper="9"/>
  </joint>
  <joint name="bolts" type="fixed"><parent link="link_2"/><child link="weight"/><origin xyz="0.4 0 0"/></joint>
</robot>
"""


@pytest.fixture(scope="module")
def rods(tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    folder = tmp_path_factory.mktemp("rods")
    (folder / "rods.urdf").write_text(TWO_RODS)
    (folder / "robot.yaml").write_text("robot: rods.urdf\n")
    return RobotModel.from_yaml(folder / "robot.yaml")


def true_values(model: RobotModel, *, spread: float) -> np.ndarray:
    """Bodies off from CAD by `spread` in every direction of the pseudo-inertia, and positive drives that CAD does not know."""
    rng = np.random.default_rng(5)
    names = Observation(model, CLASSIC).names
    values = np.zeros(len(names))
    flat = PSEUDO_INERTIA.reshape(10, 16).T
    for i, link in enumerate(model.inertias):
        sized = replace(link, inertia=link.inertia + 1e-4 * np.eye(3))  # link 6 of the TX40 is a point in CAD
        factor = np.linalg.cholesky(pseudo_inertia(sized)) @ (np.eye(4) + spread * rng.normal(size=(4, 4)))
        values[10 * i : 10 * i + 10] = np.linalg.lstsq(flat, (factor @ factor.T).ravel(), rcond=None)[0]
    drives = range(10 * model.n, len(names))
    values[drives] = [0.1 if "_at_" in names[k] else rng.uniform(0.2, 1.0) for k in drives]
    return values


def simulated(
    model: RobotModel, swing: Motion, *, every: int = 1, noise: float = 0.0, spread: float = 0.05
) -> tuple[RegressionData, np.ndarray]:
    """What `model` with true values makes of the first joints' swing, every so many samples; and the truth."""
    observation = Observation(model, CLASSIC)
    values = true_values(model, spread=spread)
    n = model.n
    few = Motion(
        swing.time[::every],
        *(part[::every, :n] for part in (swing.q, swing.dq, swing.ddq, swing.torque)),
    )
    columns = observation.columns(few)
    torque = np.stack(
        [values[m] @ c for m, c in zip(observation.column_indices, columns, strict=True)], axis=1
    )
    torque = torque + noise * NOISE[:n] * np.random.default_rng(8).normal(size=torque.shape)
    return assemble_regression(
        observation, BaseParameters.of(observation), [replace(few, torque=torque)], Decimation(1)
    ), values


def with_torques(data: RegressionData, parameters: np.ndarray) -> RegressionData:
    """The same motion with the torques of other parameters, without noise."""
    subsystems = []
    for s in data.subsystems:
        factor = s.triangle.factor.copy()
        factor[:, -1] = s.triangle.matrix @ parameters[s.column_indices]
        subsystems.append(replace(s, triangle=replace(s.triangle, factor=factor)))
    return replace(data, subsystems=tuple(subsystems))


def bodies(model: RobotModel, estimate: Estimate) -> list[bool]:
    return [is_physically_consistent(estimate.values, joint.link) for joint in model.joints]


def base_values(data: RegressionData, parameters: np.ndarray) -> np.ndarray:
    return data.base.identifiability.regrouping @ parameters


def test_without_noise_the_truth_comes_back(tx40: RobotModel, swing: Motion) -> None:
    data, truth = simulated(tx40, swing)
    found = feasible_least_squares(data)
    assert found.rank == 61
    error = base_values(data, found.parameters.coordinates()) - base_values(data, truth)
    assert np.abs(error).max() < 1e-7
    assert all(bodies(tx40, found))


def test_where_cad_is_right_every_single_parameter_comes_back(rods: RobotModel, swing: Motion) -> None:
    """The prior fills what no torque shows with CAD's own, and leaves to the rotors what CAD does not explain."""
    data, _ = simulated(rods, swing)
    truth = data.observation.values()
    truth[20:] = np.linspace(0.2, 1.0, len(truth) - 20)
    found = feasible_least_squares(with_torques(data, truth)).parameters.coordinates()
    assert np.abs(found - truth).max() < 1e-3


def test_no_torque_at_all_is_no_traceback(rods: RobotModel, swing: Motion) -> None:
    data, truth = simulated(rods, swing)
    assert all(bodies(rods, feasible_least_squares(with_torques(data, 0 * truth))))


@pytest.mark.parametrize(("every", "noise"), [(20, 10.0), (10, 30.0)])
def test_the_optimum_is_that_of_a_general_optimiser(
    every: int, noise: float, rods: RobotModel, swing: Motion
) -> None:
    """BFGS on log-Cholesky factors from CAD; the prior may move ‖y‖, the root of the rise, by 0.05 and a thousandth."""
    data, _ = simulated(rods, swing, every=every, noise=noise)
    linear, found = weighted_least_squares(data), feasible_least_squares(data)
    assert not all(bodies(rods, linear)) and all(bodies(rods, found))
    system = weighted_system(data, noise_levels(data))
    assert system.residual(found.parameters.coordinates()) ** 2 == pytest.approx(found.cost, rel=1e-9)
    coordinates = LogCholesky(feasible_set(data.observation, system), len(data.names))

    def cost(x: np.ndarray) -> tuple[float, np.ndarray]:
        values, slopes = coordinates.parameters(x)
        residual = system.matrix @ values - system.right
        return float(residual @ residual), 2 * slopes.T @ (system.matrix.T @ residual)

    best = minimize(
        cost, coordinates.start(), jac=True, method="BFGS", options={"maxiter": 5000, "gtol": 1e-3}
    )
    assert found.cost > linear.cost + 0.5
    push, least = np.sqrt(found.cost - linear.cost), np.sqrt(best.fun - linear.cost)
    assert -0.005 < push - least < 0.05 + 0.001 * least


@pytest.fixture(scope="module")
def recorded(tx40: RobotModel, examples: Path) -> tuple[RegressionData, RegressionData]:
    """The TX40's recording, the first 70 % and the rest."""
    recording = read_recording(examples / "tx40" / "exciting.parquet", tx40)
    observation, decimation = Observation(tx40, CLASSIC), Decimation(100)
    base, motions = BaseParameters.of(observation), [Motion.of(recording, 100.0)]
    early, late = [Window(end=6.1)], [Window(start=6.3)]
    return tuple(
        assemble_regression(observation, base, motions, decimation, windows=w) for w in (early, late)
    )  # pyright: ignore[reportReturnType]


def test_a_real_robot_is_made_of_bodies_and_predicted_no_worse(
    recorded: tuple[RegressionData, RegressionData], tx40: RobotModel
) -> None:
    train, held_out = recorded
    linear = weighted_least_squares(train)
    found = feasible_least_squares(train)
    worse = [held_out.errors(e.parameters.coordinates())[0] for e in (found, linear)]
    assert worse[0] - worse[1] < 0.0005
    assert bodies(tx40, linear).count(True) < 3
    assert all(bodies(tx40, found))
    drives = [v for n, v in found.values.items() if n.endswith((".rotor_inertia", ".viscous", ".coulomb"))]
    assert len(drives) == 18 and min(drives) > 0
    for key in ("rotor_inertia", "viscous"):
        own, other = found.values[f"joint_5.{key}"], found.values[f"joint_6.{key}"]
        assert own * other > found.values[f"joint_6.{key}_at_joint_5"] ** 2
    for joint, cad in zip(tx40.joints, tx40.inertias, strict=True):
        assert 0.789 < found.values[f"{joint.link}.mass"] / cad.mass < 1.211


def test_uncertainty_is_that_of_the_base_parameters(recorded: tuple[RegressionData, RegressionData]) -> None:
    """What the prior chose is marked as before; and what it chose costs no base parameter more than the data pay for."""
    train, _ = recorded
    linear, found = weighted_least_squares(train), feasible_least_squares(train)
    assert (found.identifiable, found.dropped, found.rank) == (
        linear.identifiable,
        linear.dropped,
        linear.rank,
    )
    assert np.array_equal(found.covariance, linear.covariance)
    assert found.interval("link_1.mass") is None
    moved = base_values(train, found.parameters.coordinates() - linear.parameters.coordinates())
    std = np.sqrt(np.diag(found.covariance)[list(train.base.identifiability.kept)])
    assert np.abs(moved / std).max() < np.sqrt(1.01 * (found.cost - linear.cost))


def test_a_joint_that_never_moves(tx40: RobotModel, swing: Motion) -> None:
    """Its friction, which nothing tells, stays zero; its link is still a body."""
    still = replace(swing, **{key: getattr(swing, key) * [1, 1, 1, 1, 1, 0] for key in ("q", "dq", "ddq")})
    data, truth = simulated(tx40, still)
    found = feasible_least_squares(data)
    assert all(bodies(tx40, found))
    assert found.values["joint_6.viscous"] == 0.0
    assert abs(found.values["joint_3.viscous"] - truth[data.names.index("joint_3.viscous")]) < 1e-7


def test_a_urdf_without_inertials_gets_bodies(tx40: RobotModel, swing: Motion) -> None:
    bare = replace(
        tx40, links=replace(tx40.links, mass=np.zeros(6), com=np.zeros((6, 3)), inertia=np.zeros((6, 3, 3)))
    )
    data, truth = simulated(tx40, swing)
    observation = Observation(bare, CLASSIC)
    data = replace(data, observation=observation, base=BaseParameters.of(observation))
    found = feasible_least_squares(data)
    assert all(bodies(bare, found))
    error = base_values(data, found.parameters.coordinates()) - base_values(data, truth)
    assert np.abs(error).max() < 1e-7
    assert 0.1 < sum(found.values[f"{joint.link}.mass"] for joint in bare.joints) < 100.0


@pytest.mark.parametrize("robot", ["tx40", "rods"])
def test_the_urdf_has_the_bodies_and_needs_the_torques(
    robot: str, swing: Motion, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """Pinocchio reads positive definite pseudo-inertias back, and its torques and the drives' are those of the estimate."""
    model: RobotModel = request.getfixturevalue(robot)
    data, _ = simulated(model, swing, every=10, noise=1.0)
    identified = model.with_estimate(feasible_least_squares(data))
    export = export_urdf(identified, tmp_path / "identified.urdf")
    assert "Rotor inertia, friction and torque offset of the drives stay in estimates.yaml" in str(export)
    other = pin.buildModelFromUrdf(str(export.path))
    for inertia in list(other.inertias)[1:]:
        assert np.linalg.eigvalsh(inertia.toPseudoInertia().toMatrix())[0] > 0
    values = np.array([identified.value(name) for name in data.names])
    columns = data.observation.columns(swing_of(model, swing))
    for k in (0, 700, 1900):
        state = [part[k, : model.n] for part in (swing.q, swing.dq, swing.ddq)]
        links = pin.rnea(other, other.createData(), *state)
        for joint, (members, block) in enumerate(zip(data.observation.column_indices, columns, strict=True)):
            drive = members >= 10 * model.n
            expected = values[members] @ block[:, k] - values[members[drive]] @ block[drive, k]
            assert links[joint] == pytest.approx(expected, abs=1e-9)


def swing_of(model: RobotModel, swing: Motion) -> Motion:
    return Motion(swing.time, *(part[:, : model.n] for part in (swing.q, swing.dq, swing.ddq, swing.torque)))


def test_links_that_no_body_can_be_stay_nominal_in_a_urdf(
    tx40: RobotModel, swing: Motion, tmp_path: Path
) -> None:
    data, _ = simulated(tx40, swing, every=10, noise=1.0)
    linear = weighted_least_squares(data)
    wrong = [joint.link for joint, ok in zip(tx40.joints, bodies(tx40, linear), strict=True) if not ok]
    export = export_urdf(tx40.with_estimate(linear), tmp_path / "linear.urdf")
    assert wrong and f"identified for {', '.join(wrong)}, which stay nominal" in str(export)
    before, after = (pin.buildModelFromUrdf(str(path)) for path in (tx40.urdf, export.path))
    for joint in tx40.joints:
        at = before.getJointId(joint.name)
        assert (before.inertias[at] == after.inertias[at]) == (joint.link in wrong)


def test_a_pseudo_inertia_is_pinocchios(tx40: RobotModel) -> None:
    for link in tx40.inertias:
        theirs = pin.Inertia(link.mass, link.com, link.inertia).toPseudoInertia().toMatrix()
        np.testing.assert_allclose(pseudo_inertia(link), theirs, atol=1e-12)
    values = np.array([tx40.value(name) for name in Observation(tx40, ()).names]).reshape(6, 10)
    matrices = np.tensordot(values, PSEUDO_INERTIA, 1)
    np.testing.assert_allclose(matrices, [pseudo_inertia(link) for link in tx40.inertias], atol=1e-12)
