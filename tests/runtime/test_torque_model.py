"""Torques for a motion against Pinocchio, against the columns of the identification, and in C++ against NumPy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

from flexcal import RobotModel, TorqueModel, read_torque_model
from flexcal.dynamics.inverse_model import CLASSIC, Observation
from flexcal.dynamics.signals import Motion
from flexcal.export import render_runtime
from flexcal.jobs.dynamics import identify_robot_dynamics
from flexcal.kernels import RuntimeRobot
from flexcal.model.statics import static_equilibrium

RNG_SEED = 8


def motion(n: int, count: int = 200) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(RNG_SEED)
    return rng.uniform(-2, 2, (count, n)), rng.uniform(-3, 3, (count, n)), rng.uniform(-9, 9, (count, n))


def in_cpp(
    model: TorqueModel, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, payload: np.ndarray
) -> np.ndarray:
    robot = RuntimeRobot.read(render_runtime(model.model, model.model, model.document()).text)
    torque, status, _ = robot.torque(q, dq, ddq, payload)
    assert (status == 0).all()
    return torque


@pytest.mark.parametrize("payload", [0.0, 3.0])
def test_links_and_payload_are_those_of_pinocchio(tx90l: RobotModel, payload: float) -> None:
    """The URDF by Pinocchio's own reader and algorithm, the payload appended there; rotors and friction are none."""
    drives = replace(
        tx90l.drives, **{key: np.zeros(6) for key in ("rotor_inertia", "viscous", "coulomb", "torque_offset")}
    )
    bare = replace(tx90l, drives=drives)
    held = bare.payload
    assert held is not None
    other = pin.buildModelFromUrdf(str(tx90l.urdf))
    other.gravity.linear = tx90l.gravity
    one = held.carried(payload)
    other.appendBodyToJoint(held.joint + 1, pin.Inertia(payload, one.com, one.inertia), pin.SE3.Identity())
    q, dq, ddq = motion(6)
    data = other.createData()
    expected = np.array([pin.rnea(other, data, *state) for state in zip(q, dq, ddq, strict=True)])
    model = TorqueModel.of(bare)
    carried = np.full(len(q), payload)
    np.testing.assert_allclose(model.torque(q, dq, ddq, carried), expected, rtol=0, atol=1e-9)
    np.testing.assert_allclose(in_cpp(model, q, dq, ddq, carried), expected, rtol=0, atol=1e-9)


def test_slides_and_branches_are_those_of_pinocchio(tree: RobotModel) -> None:
    other = pin.buildModelFromUrdf(str(tree.urdf))
    other.gravity.linear = tree.gravity
    order = [other.joints[other.getJointId(name)].idx_v for name in tree.joint_names]
    q, dq, ddq = motion(tree.n)
    placed = [np.zeros_like(q) for _ in range(3)]
    for there, here in zip(placed, (q, dq, ddq), strict=True):
        there[:, order] = here
    data = other.createData()
    expected = np.array([pin.rnea(other, data, *state) for state in zip(*placed, strict=True)])[:, order]
    with_point = replace(tree, points={})
    np.testing.assert_allclose(TorqueModel.of(with_point).torque(q, dq, ddq), expected, rtol=0, atol=1e-9)


@pytest.fixture(scope="module")
def identified(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> TorqueModel:
    """The TX40, whose motor 6 also turns joint 5, with friction that grows with the load and passes with speed and time."""
    folder = tmp_path_factory.mktemp("identified")
    source = examples / "tx40"
    for name in ("robot.yaml", "tx40.urdf", "joint_from_motor.csv", "joint_from_motor_torque.csv"):
        text = (source / name).read_text(encoding="utf-8")
        if name == "robot.yaml":
            terms = "viscous, coulomb, torque_offset, sublinear_viscous, load_stribeck, stribeck, presliding, warm_up, cable_stiffness"
            text = text.replace("decimation: 100}", f"decimation: 100, friction: [{terms}]}}")
            text += "points: {tip: {frame: " + text_of_last_link(source) + ", xyz: [0, 0, 0.1]}}\n"
        (folder / name).write_text(text, encoding="utf-8")
    identify_robot_dynamics(folder / "robot.yaml", [source / "exciting.parquet"])
    return read_torque_model(folder / "robot.yaml")


def text_of_last_link(source: Path) -> str:
    return RobotModel.from_yaml(source / "robot.yaml", estimates=False).joints[-1].link


def test_friction_is_that_of_the_identification(identified: TorqueModel) -> None:
    """Classic terms and couplings by the columns of the fit; the others, of a warm robot that moves, by their formulas, axis by axis."""
    model = identified.model
    assert identified.identified and (identified.velocities["load_stribeck"] != 1).all()
    q, dq, ddq = motion(6)
    still = np.zeros_like(q)
    observation = Observation(model, CLASSIC)
    columns = observation.columns(Motion(np.arange(float(len(q))), q, dq, ddq, still))
    values = observation.values()
    expected = np.column_stack(
        [part.T @ values[own] for part, own in zip(columns, observation.column_indices, strict=True)]
    )
    bare = replace(model, drives=replace(model.drives, friction=np.zeros_like(model.drives.friction)))
    np.testing.assert_allclose(TorqueModel.of(bare).torque(q, dq, ddq), expected, rtol=0, atol=1e-9)
    links = TorqueModel.of(bare)
    no_drives = replace(bare.drives, **{k: np.zeros(6) for k in ("rotor_inertia", "viscous", "coulomb", "torque_offset")},
                        coupling=np.zeros_like(bare.drives.coupling))  # fmt: skip
    load = np.abs(TorqueModel.of(replace(links.model, drives=no_drives)).torque(q, dq, ddq))
    for j, name in enumerate(model.joint_names):
        turns = dq[:, j] + (dq[:, 4] if j == 5 else 0.0)

        def of(key: str, name: str = name) -> float:
            return model.value(f"{name}.{key}")

        own = np.sign(turns) * (
            of("sublinear_viscous") * np.sqrt(np.abs(turns))
            + of("presliding")
            + of("stribeck") * np.exp(-((turns / identified.velocities["stribeck"][j]) ** 2))
            + of("load_stribeck")
            * load[:, j]
            * np.exp(-((turns / identified.velocities["load_stribeck"][j]) ** 2))
        )
        expected[:, j] += own + of("cable_stiffness") * q[:, j]
        if j == 5:
            expected[:, 4] += own
    np.testing.assert_allclose(identified.torque(q, dq, ddq), expected, rtol=0, atol=1e-9)
    found = in_cpp(identified, q, dq, ddq, np.full(len(q), np.nan))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_elastic_drives_hold_what_they_hold_at_rest(tx90l: RobotModel) -> None:
    """Of drives with springs and a gap, but no bearings: the torque at rest by Newton's method on the potential."""
    stiffness = tx90l.springs.stiffness * [np.nan, np.nan, 1.0]
    drives = replace(tx90l.drives, torque_offset=np.zeros(6), coulomb=np.zeros(6))
    soft = replace(tx90l, springs=replace(tx90l.springs, stiffness=stiffness), drives=drives)
    soft = soft.with_values(
        {f"joint_{k}.drive.stiffness": 4e4 for k in (1, 2, 3)} | {"joint_2.backlash": 1e-4}
    )
    q, _, _ = motion(6)
    still = np.zeros_like(q)
    rest = static_equilibrium(soft, q)
    model = TorqueModel.of(soft)
    found = model.torque(q, still, still, elastic=True)
    assert np.abs(model.torque(q, still, still) - rest.torque)[:, :3].max() > 0.1
    np.testing.assert_allclose(found[:, :3], rest.torque[:, :3], rtol=0, atol=1e-6)
    text = render_runtime(soft, soft, model.document()).text
    torque, _, _ = RuntimeRobot.read(text).torque(q, still, still, np.full(len(q), np.nan), True)
    np.testing.assert_allclose(torque, found, rtol=0, atol=1e-9)


def test_stribeck_friction_without_its_velocities_is_refused(identified: TorqueModel) -> None:
    with refused("E-DYN-047", "stribeck"):
        TorqueModel.of(identified.model, {})
