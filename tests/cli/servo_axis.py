"""Motor and loads on springs under a servo that acts on a noisy encoder, with load disturbances; shares nothing with the package."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

RATE = 1000.0


@dataclass(frozen=True)
class ServoAxis:
    """Masses in a row, the motor first; friction brakes the motor."""

    inertia: tuple[float, ...] = (2.0, 3.0)
    stiffness: tuple[float, ...] = (9e3,)
    damping: tuple[float, ...] = (6.0,)
    friction: float = 5.0

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        n = len(self.inertia)
        damping, stiffness = np.zeros((n, n)), np.zeros((n, n))
        for i, (k, d) in enumerate(zip(self.stiffness, self.damping, strict=True)):
            for row, column, sign in ((i, i, 1), (i + 1, i + 1, 1), (i, i + 1, -1), (i + 1, i, -1)):
                stiffness[row, column] += sign * k
                damping[row, column] += sign * d
        damping[0, 0] += self.friction
        return np.diag(self.inertia), damping, stiffness

    def frequencies(self, *, held: bool = False) -> np.ndarray:
        """Resonances (Hz), or with the motor held the antiresonances."""
        m, d, k = (matrix[1:, 1:] if held else matrix for matrix in self.matrices())
        poles = np.linalg.eigvals(
            np.block([[np.zeros_like(m), np.eye(len(m))], [-np.linalg.solve(m, k), -np.linalg.solve(m, d)]])
        )
        return np.sort(np.abs(poles[poles.imag > 1e-3])) / (2 * np.pi)

    @property
    def truth(self) -> dict[str, float]:
        """As masses are named in results.json."""
        values = {f"inertia_{i}": v for i, v in enumerate(self.inertia, 1)}
        return values | {f"stiffness_{i}": v for i, v in enumerate(self.stiffness, 1)}


TWO = ServoAxis()
THREE = ServoAxis((2.0, 1.0, 3.0), (20e3, 9e3), (8.0, 6.0))


def controlled(
    axis: ServoAxis,
    gains: tuple[float, float, float],
    added: np.ndarray,
    rng: np.random.Generator,
    *,
    encoder: float,
    load: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Servo torque and encoder angle (N,) where `added` is put on the torque.

    `gains`: of position (1/s), of velocity (N m s/rad) and of its integral (1/s). `encoder` rad is white noise, `load` N m acts on the
    motor and, half of it, on the last mass, and remembers itself for 50 ms.
    """
    m, d, k = axis.matrices()
    n, step = len(m), 1 / RATE
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(m, k), -np.linalg.solve(m, d)]])
    over, held, term = np.eye(2 * n), step * np.eye(2 * n), np.eye(2 * n)
    for order in range(1, 40):  # exponential series
        term = term @ state * step / order
        over, held = over + term, held + term * step / (order + 1)
    pushed = held @ np.vstack([np.zeros((n, n)), np.linalg.inv(m)])
    memory = np.exp(-step / 0.05)
    x, past, integral, disturbance = np.zeros(2 * n), 0.0, 0.0, np.zeros(2)
    torque, angle = np.empty(len(added)), np.empty(len(added))
    for i, extra in enumerate(added):
        seen = x[0] + encoder * rng.normal()
        error = -gains[0] * seen - (seen - past) / step
        past, integral = seen, integral + error * step
        torque[i], angle[i] = gains[1] * (error + gains[2] * integral) + extra, seen
        disturbance = memory * disturbance + load * np.sqrt(1 - memory**2) * rng.normal(size=2)
        force = np.zeros(n)
        force[0], force[-1] = torque[i] + disturbance[0], 0.5 * disturbance[1]
        x = over @ x + pushed @ force
    return torque, angle


def excitation(kind: str, count: int, rng: np.random.Generator) -> np.ndarray:
    """30 N m rms from 1 to 60 Hz."""
    t = np.arange(count) / RATE
    if kind == "sweep":
        return 42 * np.sin(2 * np.pi * (t + 59 * t**2 / (2 * t[-1])))
    if kind == "multisine":
        lines = np.zeros(1001, complex)
        lines[2:121] = np.exp(2j * np.pi * rng.uniform(size=119))
        whole = np.tile(np.fft.irfft(lines, 2000), -(-count // 2000))[:count]
    else:
        lines = np.fft.rfft(rng.normal(size=count))
        lines[np.fft.rfftfreq(count, 1 / RATE) > 60] = 0.0
        whole = np.fft.irfft(lines, count)
    return 30 * whole / whole.std()


def write_log(path: Path, torque: np.ndarray, angle: np.ndarray, added: np.ndarray | None = None) -> Path:
    """Plain CSV, with the excitation where there is one."""
    columns = {
        "time [s]": np.arange(len(torque)) / RATE,
        "motor torque [Nm]": torque,
        "motor angle [rad]": angle,
    }
    columns |= {} if added is None else {"excitation": added}
    np.savetxt(
        path,
        np.column_stack(list(columns.values())),
        "%.10g",
        ",",
        header=",".join(columns),
        comments="",
    )
    return path
