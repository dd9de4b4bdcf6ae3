"""Two links that swing in a vertical plane under a position controller: a robot whose closed loop is simulated in a blink."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import recovery

from flexcal.data.recordings import Decimation
from flexcal.dynamics.estimators import RecordedRows
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.signals import Motion, Window
from flexcal.dynamics.simulation import SimulatedExperiment
from flexcal.estimation import Estimate
from flexcal.model.robot import RobotModel

LINK = """<link name="{name}"><inertial><origin xyz="0.2 0 0.02"/><mass value="{mass}"/>
<inertia ixx="0.02" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{x} 0 0"/>
<axis xyz="0 1 0"/><limit lower="-9" upper="9" effort="100" velocity="20"/></joint>"""
URDF = f"""<robot name="two_links"><link name="base"/>{LINK.format(name="upper", mass=6)}{LINK.format(name="lower", mass=3)}
{JOINT.format(name="shoulder", parent="base", child="upper", x=0)}{JOINT.format(name="elbow", parent="upper", child="lower", x=0.4)}
</robot>"""
CONTROLLER = "controller: {kp: [1500, 500], kd: [120, 40], rate_hz: 1000}\n"
RATE = 100.0
GAINS = np.array([1.3, 0.8])
"""What torques must be multiplied by."""
PAYLOAD = "payload: {frame: lower, mass: 4.0, com: [0.3, 0, 0]}\n"
HELD = np.array([4.0, 1.6, 0.0, 0.1, 0.02, 0.0, -0.04, 0.7, 0.0, 0.7])
"""The payload's ten parameters in the lower link: not where robot.yaml says, but for the mass."""


def two_links(folder: Path, extra: str = "") -> RobotModel:
    (folder / "two_links.urdf").write_text(URDF)
    (folder / "robot.yaml").write_text("robot: two_links.urdf\n" + extra)
    return RobotModel.from_yaml(folder / "robot.yaml", estimates=False)


def true_values(observation: Observation) -> np.ndarray:
    """CAD, and drives that it does not know."""
    values = dict(zip(observation.names, observation.values(), strict=True))
    drives = {
        "rotor_inertia": (0.4, 0.1),
        "viscous": (3.0, 1.0),
        "coulomb": (0.4, 0.15),
        "torque_offset": (0.5, -0.3),
    }
    for key, (shoulder, elbow) in drives.items():
        values[f"shoulder.{key}"], values[f"elbow.{key}"] = shoulder, elbow
    return np.array(list(values.values()))


def driven(observation: Observation, truth: np.ndarray, samples: int) -> Motion:
    """What the robot with the `truth` does when its controller is told a sum of sines, and the torques that this takes."""
    time = np.arange(samples) / RATE
    rate = 2 * np.pi * 0.1 * np.array([1, 2, 3, 5, 7])
    rng = np.random.default_rng(7)
    size, phase = rng.normal(size=(5, 2)), rng.uniform(0, 2 * np.pi, (5, 2))
    q = np.einsum("jn,tjn->tn", size, np.sin(time[:, None, None] * rate[:, None] + phase))
    command = Motion(time, q, np.gradient(q, time, axis=0), np.zeros_like(q), np.zeros_like(q))
    simulated = Motion.joined(SimulatedExperiment(observation, truth, command, Decimation(1)).blocks())
    return recovery.driven(observation, simulated, truth)


def swings(arm: Observation, held: np.ndarray, seed: int) -> Motion:
    """Forty seconds of sums of sines, with torques that read 1/GAINS of what they are."""
    rng, time = np.random.default_rng(seed), np.arange(2000) / 50.0
    rate = 2 * np.pi * 0.1 * np.array([1, 2, 3, 5, 7])
    size, phase = rng.normal(size=(5, 2)), rng.uniform(0, 2 * np.pi, (5, 2))
    angle = time[:, None, None] * rate[:, None] + phase
    q, dq = np.sum(size * np.sin(angle), axis=1), np.sum(size * rate[:, None] * np.cos(angle), axis=1)
    ddq = -np.sum(size * rate[:, None] ** 2 * np.sin(angle), axis=1)
    motion = Motion(time, q, dq, ddq, np.zeros_like(q))
    values = true_values(arm)
    values[10:20] += held
    held_up = recovery.driven(arm, motion, values)
    return replace(held_up, torque=held_up.torque / GAINS)


def recorded(observation: Observation, motion: Motion, factor: int) -> RecordedRows:
    base = BaseParameters.of(observation)
    return RecordedRows(observation, base, [motion], [Window()], Decimation(factor))


def errors(estimate: Estimate, observation: Observation, truth: np.ndarray) -> np.ndarray:
    """Of the base parameters, and their standard deviations (2, k)."""
    expected = estimate.regrouped(dict(zip(observation.names, truth, strict=True)))
    hidden = {entry.name for entry in estimate.dropped}
    rows = [(estimate.values[n] - v, estimate.std(n)) for n, v in expected.items() if n not in hidden]
    return np.array(rows, dtype=float).T


def write_logs(arm: Observation, folder: Path) -> None:
    """free.csv and loaded.csv: the motion without and with `HELD`, motor torques by `GAINS` with noise of 0.1 N m."""
    rng = np.random.default_rng(1)
    for name, held, seed in (("free", 0 * HELD, 7), ("loaded", HELD, 9)):
        motion = swings(arm, held, seed)
        torque = motion.torque * GAINS + 0.1 * rng.normal(size=motion.torque.shape)
        columns = {"t": motion.time} | {f"q{i + 1}": motion.q[:, i] for i in range(2)}
        columns |= {f"tau{i + 1}": torque[:, i] for i in range(2)}
        pl.DataFrame(columns).write_csv(folder / f"{name}.csv")
