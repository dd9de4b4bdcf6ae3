"""The pushed robot's elbow and roll with elastic drives, coupled as in a hollow wrist: the roll motor turns both joints.

Motion of the arm is prescribed; the motors' follows from the torques in the springs, differentiated as Fourier series of the period.
"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import polars as pl
from pushed_robot import pushed_model, pushed_torque

RATIO = 0.8
BEFORE = {"elbow": 900.0, "roll": 350.0}
"""N m/rad of the springs on the motors' axes, before the coupling."""
DAMPING = {"elbow": 0.9, "roll": 0.35}
ROTOR = np.array([0.5, 0.12])
VISCOUS = np.array([2.0, 0.6])
COULOMB = np.array([1.5, 0.5])
_RATE, _PERIOD = 1000.0, 10.0


def write_coupled(
    path: Path, seed: int, *, behind: bool = False, noise: float = 0.0, push: float = 0.0
) -> Path:
    """A log of one period and a half; with `behind` the springs sit behind the coupling, at the joints.

    With `push` (N) the hand is pushed, and the log has the sensor's columns.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(int(_PERIOD * _RATE)) / _RATE
    rate = 2 * np.pi / _PERIOD * np.array([1, 2, 5, 9, 14])
    reach = np.array([1.0, 0.2, 0.8, 1.2]) / np.array([1, 1.6, 3.5, 6, 9])[:, None]
    q = np.array([0.0, 0.35, 0.2, 0.0]) + np.einsum(
        "kj,tkj->tj",
        reach * rng.normal(size=(5, 4)),
        np.sin(time[:, None, None] * rate[:, None] + rng.uniform(0, 2 * np.pi, (5, 4))),
    )
    model = pushed_model()
    data = mujoco.MjData(model)
    dq, ddq = _derivative(q), _derivative(_derivative(q))
    arm, tones = np.empty_like(q), 2 * np.pi / _PERIOD * np.array([3, 4, 7, 6, 8, 5])
    wrench = push * np.array([1, 1, 1, 0.1, 0.1, 0.1]) * np.sin(tones * time[:, None] + np.arange(6))
    for k in range(len(time)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], dq[k], ddq[k]
        mujoco.mj_inverse(model, data)
        arm[k] = data.qfrc_inverse - pushed_torque(model, data, wrench[k])
    shares = np.array([[1.0, 0.0], [RATIO, 1.0]])  # motors' axes from joints
    shares_of_spring = np.eye(2) if behind else shares
    k, d = np.array(list(BEFORE.values())), np.array(list(DAMPING.values()))
    # torque on the joints = Sᵀ (k e + d ė), e = S (θ - q); solved line by line of the spectrum
    load = np.linalg.solve(shares_of_spring.T, arm[:, 2:].T).T
    lines = np.fft.rfft(load, axis=0)
    omega = 2j * np.pi * np.fft.rfftfreq(len(time), 1 / _RATE)[:, None]
    stretch = np.fft.irfft(lines / (k + omega * d), n=len(time), axis=0)
    theta = q.copy()
    theta[:, 2:] += np.linalg.solve(shares_of_spring, stretch.T).T
    motors = theta[:, 2:] @ shares.T
    speed, change = _derivative(motors), _derivative(_derivative(motors))
    own = ROTOR * change + VISCOUS * speed + COULOMB * np.sign(speed)
    torque = arm.copy()
    torque[:, 2:] += own @ shares
    rows = np.arange(int(1.5 * len(time))) % len(time)
    moved = torque[rows] + noise * torque.std(axis=0) * rng.normal(size=(len(rows), 4))
    columns = {"t": np.arange(len(rows)) / _RATE} | {f"q{i + 1}": theta[rows, i] for i in range(4)}
    columns |= {f"qa{i + 1}": q[rows, i] for i in range(4)} | {f"tau{i + 1}": moved[:, i] for i in range(4)}
    if push:
        names = ("fx", "fy", "fz", "mx", "my", "mz")
        columns |= {name: wrench[rows, k] for k, name in enumerate(names)}
    pl.DataFrame(columns).write_parquet(path)
    return path


def _derivative(values: np.ndarray) -> np.ndarray:
    lines = np.fft.rfft(values, axis=0)
    omega = 2j * np.pi * np.fft.rfftfreq(len(values), 1 / _RATE)[:, None]
    return np.fft.irfft(lines * omega, n=len(values), axis=0)
