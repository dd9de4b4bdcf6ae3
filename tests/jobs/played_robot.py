"""Two elastic joints in a vertical plane under a sampled controller, in NumPy alone: it knows the files of `export excitation` alone.

Equations of motion in closed form (rotors behind springs, two links under gravity), integrated by Runge-Kutta, all recordings at once.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

LENGTH, MASSES, CENTRES, MOMENTS = 0.35, (9.0, 5.0), (0.16, 0.14), (0.12, 0.06)
ROTORS, DAMPING, VISCOUS = (0.9, 0.35), (8.0, 4.0), (6.0, 3.0)
KP, KD = (400.0, 120.0), (40.0, 12.0)
GRAVITY = 9.81
STEPS = 4
"""Steps of the integration in one of the controller."""
URDF = """<robot name="fence"><link name="base"/>
<link name="inner"><inertial><origin xyz="0.16 0 0"/><mass value="9"/>
<inertia ixx="0.02" iyy="0.12" izz="0.12" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="outer"><inertial><origin xyz="0.14 0 0"/><mass value="5"/>
<inertia ixx="0.01" iyy="0.06" izz="0.06" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="inner"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="300" velocity="9"/></joint>
<joint name="j2" type="revolute"><parent link="inner"/><child link="outer"/><origin xyz="0.35 0 0"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="150" velocity="9"/></joint></robot>"""
ROBOT = f"""robot: fence.urdf
points: {{tip: {{frame: outer, xyz: [0.3, 0, 0]}}}}
drives: {{rotor_inertia: {list(ROTORS)}, viscous: {list(VISCOUS)}, coulomb: [0.5, 0.25]}}
elastic:
  - {{joint: j1, drive: {{stiffness: 14000.0, damping: 8.0}}}}
  - {{joint: j2, drive: {{stiffness: 6000.0, damping: 4.0}}}}
controller: {{kp: {list(KP)}, kd: {list(KD)}, rate_hz: 1000}}
prior: {{mass: 0.05, com: 0.002, rotor_inertia: 0.03, torque_constant: 0.005}}
"""


@dataclass(frozen=True)
class Robot:
    """The robot and its log: stiffness, N m/rad, Coulomb friction, N m, and noise of encoder (rad) and torque (N m)."""

    stiffness: tuple[float, float] = (9000.0, 4000.0)
    coulomb: tuple[float, float] = (0.5, 0.25)
    noise: tuple[float, float] = (1e-6, 0.01)
    kp: tuple[float, float] = KP
    kd: tuple[float, float] = KD

    def play(self, folder: Path, before: float = 0.0, seed: int = 0) -> Log:
        """Play all signals of a folder, and stand still in each pose `before` s and after."""
        with (folder / "manifest.csv").open() as stream:
            rows = list(csv.DictReader(stream))
        rate = float(rows[0]["rate_hz"])
        signals = np.array([played(folder / row["file"], row) for row in rows])
        idle = ((0, 0), (round(before * rate),) * 2, (0, 0))
        q, dq, tau = np.split(signals, 3, axis=2)
        rng = np.random.default_rng(seed)
        states = self.run(np.pad(q, idle, mode="edge"), np.pad(dq, idle), np.pad(tau, idle), 1 / rate, rng)
        return Log([row["file"] for row in rows], 1 / rate, round(before * rate), *states)

    def run(
        self, q: np.ndarray, dq: np.ndarray, tau: np.ndarray, tick: float, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions and torques of the motors, and positions of the arm (samples, recordings, 2), of all steps of the integration."""
        step, (recordings, ticks, _) = tick / STEPS, q.shape
        arm = q[:, 0] - gravity(q[:, 0]) / self.stiffness
        state = np.concatenate([q[:, 0], arm, np.zeros((recordings, 4))], axis=1)
        states, torques, arms = (np.empty((ticks * STEPS, recordings, 2)) for _ in range(3))
        expected = gravity(q)
        for n in range(ticks):
            seen = state[:, :2] + self.noise[0] * rng.standard_normal((recordings, 2))
            motor = expected[:, n] + tau[:, n]
            motor += self.kp * (q[:, n] - seen) + self.kd * (dq[:, n] - state[:, 4:6])
            measured = motor + self.noise[1] * rng.standard_normal(motor.shape)
            for part in range(STEPS):
                states[n * STEPS + part], torques[n * STEPS + part] = state[:, :2], measured
                arms[n * STEPS + part] = state[:, 2:4]
                a = self.rate(state, motor)
                b = self.rate(state + 0.5 * step * a, motor)
                c = self.rate(state + 0.5 * step * b, motor)
                d = self.rate(state + step * c, motor)
                state = state + step / 6 * (a + 2 * b + 2 * c + d)
        return states + self.noise[0] * rng.standard_normal(states.shape), torques, arms

    def rate(self, state: np.ndarray, motor: np.ndarray) -> np.ndarray:
        q, arm, dq, rate = state[:, :2], state[:, 2:4], state[:, 4:6], state[:, 6:]
        spring = np.multiply(self.stiffness, q - arm) + np.multiply(DAMPING, dq - rate)
        friction = np.multiply(VISCOUS, dq) + np.multiply(self.coulomb, np.tanh(dq / 0.01))
        m1, m2, c1, c2 = *MASSES, *CENTRES
        pull = m2 * LENGTH * c2
        cosine, sine = np.cos(arm[:, 1]), np.sin(arm[:, 1])
        far = MOMENTS[1] + m2 * c2**2
        m11 = MOMENTS[0] + m1 * c1**2 + m2 * LENGTH**2 + far + 2 * pull * cosine
        m12 = far + pull * cosine
        bias = pull * sine
        load = spring - gravity(arm)
        f1 = load[:, 0] + bias * (2 * rate[:, 0] * rate[:, 1] + rate[:, 1] ** 2)
        f2 = load[:, 1] - bias * rate[:, 0] ** 2
        determinant = m11 * far - m12**2
        result = np.empty_like(state)
        result[:, :4] = state[:, 4:]
        result[:, 4:6] = (motor - friction - spring) / ROTORS
        result[:, 6] = (far * f1 - m12 * f2) / determinant
        result[:, 7] = (m11 * f2 - m12 * f1) / determinant
        return result


def gravity(arm: np.ndarray) -> np.ndarray:
    """Torques (..., 2) that hold the links: rotation about y takes x to -z."""
    first, both = np.cos(arm[..., 0]), np.cos(arm[..., 0] + arm[..., 1])
    outer = -MASSES[1] * GRAVITY * CENTRES[1] * both
    inner = -(MASSES[0] * CENTRES[0] + MASSES[1] * LENGTH) * GRAVITY * first
    return np.stack([inner + outer, outer], axis=-1)


def played(file: Path, row: dict[str, str]) -> np.ndarray:
    """Reference, its rate and torque, if any, side by side (samples, 6), with the loop of the file repeated."""
    with file.open() as stream:
        header = next(csv.reader(stream))
        table = np.array(list(csv.reader(stream)), dtype=float)
    names = ["t", *(f"{kind}{j}" for kind in ("q", "dq", "tau") for j in (1, 2))]
    assert header in (names, names[:5])
    table = np.pad(table, ((0, 0), (0, 7 - len(header))))
    start, loop, play = (int(row[key]) for key in ("loop_start_row", "loop_rows", "play_rows"))
    middle = start + np.arange(play) % loop
    order = np.concatenate([np.arange(start), middle, np.arange(start + loop, len(table))])
    return table[order, 1:]


@dataclass(frozen=True)
class Log:
    """Positions and torques of motors, and the arm's, (steps, recordings, 2) in files of these names; `idle` samples of `tick` s first."""

    names: list[str]
    tick: float
    idle: int
    q: np.ndarray
    tau: np.ndarray
    arm: np.ndarray

    def write(
        self, out: Path, *, every: int = STEPS, late: int = 0, by_hand: int | None = None, clock: float = 1.0
    ) -> None:
        """Write every `every`-th step of each from the `late`-th on; begun `by_hand` (a seed) at times of their own, by a `clock`."""
        out.mkdir()
        rng = np.random.default_rng(by_hand)
        for number, name in enumerate(self.names):
            skip = 0 if by_hand is None else int(0.9 * self.idle * rng.random()) * STEPS
            kept = np.arange(skip + late, len(self.q), every)
            log = np.column_stack(
                [kept * self.tick / STEPS * clock, self.q[kept, number], self.tau[kept, number]]
            )
            np.savetxt(out / name, log, delimiter=",", header="t,q1,q2,tau1,tau2", comments="", fmt="%.10g")


class Stepped:
    """The robot for a program that reads and writes in every cycle of 1 ms; of torques, or of positions with a controller of its own."""

    def __init__(self, robot: Robot, at: np.ndarray, *, positions: bool = False) -> None:
        self.robot, self.positions = robot, positions
        arm = at - gravity(at) / robot.stiffness
        self.state = np.concatenate([at, arm, np.zeros(4)])[None]
        self.applied = gravity(at)
        self.before = at

    def read(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.state[0, :2], self.state[0, 4:6], self.applied

    def write(self, command: np.ndarray) -> None:
        if self.positions:
            speed, self.before = (command - self.before) / 1e-3, command
            error, rate = command - self.state[0, :2], speed - self.state[0, 4:6]
            command = gravity(command) + np.multiply(self.robot.kp, error) + np.multiply(self.robot.kd, rate)
        self.applied, step = command, 1e-3 / STEPS
        for _ in range(STEPS):
            a = self.robot.rate(self.state, command[None])
            b = self.robot.rate(self.state + 0.5 * step * a, command[None])
            c = self.robot.rate(self.state + 0.5 * step * b, command[None])
            d = self.robot.rate(self.state + step * c, command[None])
            self.state = self.state + step / 6 * (a + 2 * b + 2 * c + d)
