"""What positions cannot tell is not told, and a controller of another kind is not trusted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from refusals import refused
from servo_arm import NAMES, TRUTH, arm, command, simulate

from flexcal.data.recordings import CommandLog
from flexcal.export import render_mjcf
from flexcal.jobs.actuators import ActuatorIdentification, identify_actuators
from flexcal.model.robot import RobotModel

URDF = """<robot name="axis"><link name="base"/><link name="arm"><inertial><origin xyz="0.1 0 0"/><mass value="4"/>
<inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="turn" type="revolute">
<parent link="base"/><child link="arm"/><axis xyz="{axis}"/><limit lower="-3" upper="3" effort="200" velocity="20"/></joint></robot>"""
INERTIA = 0.03 + 4 * 0.1**2
ARMATURE, STIFFNESS, DAMPING, COULOMB, DELAY = 0.4, 250.0, 18.0, 1.2, 0.01
STEP, RATE, SECONDS = 1e-3, 100.0, 14.0


def robot(folder: Path, axis: str = "0 0 1", extra: str = "") -> RobotModel:
    (folder / "axis.urdf").write_text(URDF.format(axis=axis))
    (folder / "robot.yaml").write_text("robot: axis.urdf\n" + extra)
    return RobotModel.from_yaml(folder / "robot.yaml", estimates=False)


def moves(weight: float = 0.0, integral: float = 0.0, stiffness: float = STIFFNESS) -> CommandLog:
    """One axis, step by step; `weight` N m where it is horizontal, `integral` of the controller N m/(rad s)."""
    rng = np.random.default_rng(2)
    time = np.arange(round(SECONDS * RATE)) / RATE
    frequency, phase = np.array([0.13, 0.37, 0.83, 1.7]), rng.uniform(0, 6, 4)
    command = np.sin(2 * np.pi * time[:, None] * frequency + phase) @ [0.5, 0.3, 0.1, 0.05]
    for at, jump in zip(rng.uniform(0, SECONDS, 8), rng.uniform(-0.15, 0.15, 8), strict=True):
        command += jump * (time > at)
    known = np.arange(round(SECONDS / STEP)) * STEP
    target = np.interp(known - DELAY, time, command)
    inertia, q, v, total = INERTIA + ARMATURE, float(command[0]), 0.0, 0.0
    reached = np.zeros(len(known))
    for k in range(len(known)):
        reached[k] = q
        total += integral * (target[k] - q) * STEP
        push = stiffness * (target[k] - q) + total + weight * np.cos(q)
        free = ((inertia - 0.5 * STEP * DAMPING) * v + STEP * push) / (inertia + 0.5 * STEP * DAMPING)
        stop = STEP * COULOMB / (inertia + 0.5 * STEP * DAMPING)
        v = free - min(max(free, -stop), stop)
        q += STEP * v
    every = round(1 / RATE / STEP)
    measured = reached[::every] + 1e-4 * rng.standard_normal(len(time))
    return CommandLog(1 / RATE, command[:, None], measured[:, None], name="moves")


def value(found: ActuatorIdentification, key: str) -> float:
    return found.estimate.values[f"turn.actuator.{key}"]


def told(found: ActuatorIdentification) -> set[str]:
    names = found.estimate.parameters.names
    return {
        n.rpartition(".")[2] for n, known in zip(names, found.estimate.identifiable, strict=True) if known
    }


def test_no_torques_without_gravity_and_changing_inertia(tmp_path: Path) -> None:
    found = identify_actuators(robot(tmp_path), [moves()])
    assert told(found) == {"delay"}
    assert "turn are known up to a common factor only" in found.summary()
    assert found.trust.trusted is None
    share = found.fit.unseen.simulated / found.fit.unseen.commanded
    assert share < 0.02, "the motion is right in any case"
    moved = (value(found, "armature") + INERTIA) / (ARMATURE + INERTIA)
    for key, true in (("stiffness", STIFFNESS), ("damping", DAMPING), ("coulomb", COULOMB)):
        assert value(found, key) / moved == pytest.approx(true, rel=0.02)


@pytest.mark.parametrize("extra", ["drives: {rotor_inertia: [0.4], viscous: [0], coulomb: [0]}\n", "gains"])
def test_a_known_rotor_or_gains_tell_the_torques(tmp_path: Path, extra: str) -> None:
    gains = extra == "gains"
    model = robot(
        tmp_path,
        extra=f"controller: {{kp: [250], kd: [{0.8 * DAMPING}], rate_hz: 1000}}\n" if gains else extra,
    )
    found = identify_actuators(model, [moves()], known_gains=gains)
    assert told(found) >= {"armature", "coulomb", "delay"}
    assert value(found, "armature") == pytest.approx(ARMATURE, rel=0.05)
    assert value(found, "coulomb") == pytest.approx(COULOMB, rel=0.05)
    if gains:
        assert value(found, "viscous") == pytest.approx(0.2 * DAMPING, rel=0.05)
    low, high = found.estimate.interval("turn.actuator.armature") or (0.0, 0.0)
    assert low < ARMATURE < high


def test_gravity_tells_them_too(tmp_path: Path) -> None:
    found = identify_actuators(robot(tmp_path, "0 1 0"), [moves(weight=4 * 0.1 * 9.81)])
    assert told(found) == {"stiffness", "damping", "coulomb", "armature", "delay"}
    assert value(found, "stiffness") == pytest.approx(STIFFNESS, rel=0.05)
    low, high = found.estimate.interval("turn.actuator.armature") or (0.0, 0.0)
    assert low < ARMATURE < high


def test_logs_of_the_same_numbers_twice_or_of_exchanged_columns_are_refused(tmp_path: Path) -> None:
    log = moves()
    with refused("E-DYN-048", "turn"):
        identify_actuators(robot(tmp_path), [replace(log, q=log.command)])
    with refused("E-DYN-052", "turn"):
        identify_actuators(robot(tmp_path), [replace(log, command=np.full_like(log.command, 0.5))])
    with refused("E-DYN-050", "turn"):
        identify_actuators(robot(tmp_path), [replace(log, q=-log.q)])
    commands = command(20.0, 100.0, np.random.default_rng(5))
    q = np.roll(commands, 1, axis=0) + 1e-4 * np.random.default_rng(6).standard_normal(commands.shape)
    with refused("E-DYN-049", "shoulder", "elbow"):
        identify_actuators(arm(tmp_path), [CommandLog(0.01, commands, q[:, ::-1], name="log")])


def test_gravity_compensation_is_found(tmp_path: Path) -> None:
    """Taken to feel gravity, the stiffness would be many times too large; without it nothing tells the torques of a single axis."""
    found = identify_actuators(robot(tmp_path, "0 1 0"), [moves(weight=0.0)])
    assert found.servo.compensates_gravity and "compensates gravity" in found.summary()
    assert told(found) == {"delay"}
    moved = (value(found, "armature") + INERTIA) / (ARMATURE + INERTIA)
    assert value(found, "stiffness") / moved == pytest.approx(STIFFNESS, rel=0.02)
    assert found.fit.unseen.simulated / found.fit.unseen.commanded < 0.02


@pytest.mark.slow
def test_the_torques_of_two_balanced_links_are_told(tmp_path: Path) -> None:
    """By the inertia of the second on the first, which changes; the simulator's file then stays up by itself."""
    commands = np.stack([command(40.0, 250.0, np.random.default_rng(seed)) for seed in (1,)])
    servo = replace(TRUTH, balanced=True)
    q = simulate(servo, commands, 250.0)[0]
    model = arm(tmp_path)
    measured = q + 1e-5 * np.random.default_rng(3).standard_normal(q.shape)
    found = identify_actuators(model, [CommandLog(1 / 250.0, commands[0], measured, name="log")])
    assert found.servo.compensates_gravity
    for i, joint in enumerate(NAMES):
        for key in ("stiffness", "coulomb"):
            assert found.estimate.values[f"{joint}.actuator.{key}"] == pytest.approx(
                getattr(TRUTH, key)[i], rel=0.05
            )
    compiled = mujoco.MjModel.from_xml_string(render_mjcf(model, found.actuators).text)
    data = mujoco.MjData(compiled)
    data.qpos[:] = data.ctrl[:] = [0.3, 0.4]
    for k in range(compiled.nu):
        mujoco.mj_initCtrlHistory(
            compiled, data, k, None, np.full(compiled.actuator_history[k, 0], data.ctrl[k])
        )
    for _ in range(4000):
        mujoco.mj_step(compiled, data)
    np.testing.assert_allclose(data.qpos, [0.3, 0.4], atol=1e-4)


@pytest.mark.slow
def test_integral_action_is_not_trusted(tmp_path: Path) -> None:
    """Much of it: the sag that gives the torques away is no longer there."""
    found = identify_actuators(robot(tmp_path, "0 1 0"), [moves(weight=4 * 0.1 * 9.81, integral=2000.0)])
    assert found.trust.trusted is not True
